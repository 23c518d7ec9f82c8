"""What tests need that ``pip install ".[test]"`` does not bring: the only reasons to skip one."""

import os
import platform
import shutil
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest


def chromium():
    """Return the path of the browser, or None."""
    names = (os.environ.get("CHROMIUM"), "chromium", "chromium-browser", "google-chrome", "chrome")
    return next((path for name in names if name and (path := shutil.which(name))), None)


def mpiexec():
    """Return the path of what starts MPI processes, or None: that of a package comes first."""
    return shutil.which("mpiexec", path=str(Path(sys.executable).parent)) or shutil.which("mpiexec")


@cache
def _lammps():
    from benchmarks.lammps_spheres import available

    return available()


def _idle():
    from carom.processors import cores

    return cores() >= 2 and os.getloadavg()[0] <= 0.5


NEEDS = {
    "MPI": lambda: find_spec("mpi4py") and mpiexec(),
    "OVITO": lambda: find_spec("ovito"),
    "LAMMPS": _lammps,
    "Chromium": lambda: os.name != "nt" and chromium(),  # Windows hands no open pipes to a program
    "Node": lambda: shutil.which("node"),
    "Sphinx": lambda: find_spec("myst_nb"),
    "physical-validation": lambda: find_spec("physical_validation"),
    "transport-analysis": lambda: find_spec("transport_analysis"),
    "a user who is not root": lambda: hasattr(os, "geteuid") and os.geteuid() != 0,
    "Unix": lambda: os.name == "posix",
    "Linux": lambda: sys.platform == "linux",
    "/dev/full": lambda: os.path.exists("/dev/full"),
    "an x86-64 processor": lambda: platform.machine() in ("x86_64", "AMD64"),
    "two idle cores": _idle,
    "compiled code": lambda: not os.environ.get("NUMBA_DISABLE_JIT"),
}
"""Need -> whether it is there. A test names what it needs: ``@pytest.mark.needs("OVITO")``."""


def reason(need):
    """Return why a test is skipped."""
    return f"needs {need}"


def needs_of(item):
    """Return what a test needs."""
    return {need for mark in item.iter_markers("needs") for need in mark.args}


def skip_without(*needs):
    """Skip the test unless all these are there."""
    for need in needs:
        if not NEEDS[need]():
            pytest.skip(reason(need))
