"""What the tests of the command line share: typing a command, and comparing the folders of two runs."""

import contextlib
import json
import re
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from carom import cli, io
from carom.io import checksums
from carom.studies import executors

CAROM = [sys.executable, "-m", "carom"]

#: 108 spheres for one or two seconds, with a frame and a checkpoint every few hundredths.
PLAN = """
[scene]
lattice = "fcc"
cells = 3
packing_fraction = 0.3

[run]
seed = 5
equilibration = {equilibration}
collisions_per_particle = {measured}
frames = {frames}
checkpoint_every = 0.02
pictures = false
"""

WAIT = 120.0
"""Seconds after which a process that should have come to some point hangs; it may have to compile."""


def carom(*arguments, cwd=None, **options):
    """Run a command to its end, in this process or in one with ``options``; return what it printed."""
    if not options:
        with contextlib.chdir(cwd or "."):
            done = CliRunner().invoke(cli.app, [*map(str, arguments)])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
        return subprocess.CompletedProcess(arguments, done.exit_code, done.stdout, done.stderr)
    return subprocess.run(
        [*CAROM, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, timeout=WAIT, **options
    )


def typed(*words):
    """Type a command in this process; return what it said, whatever it raised."""
    return CliRunner().invoke(cli.app, [*map(str, words)])


@contextlib.contextmanager
def in_this_process():
    """Let studies run here what they would run in processes."""
    choose = executors._choose
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(executors, "_choose", lambda choice, *more: choose(choice or "serial", *more))
        yield


def content(out: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    return {str(path.relative_to(out)): path.read_bytes() for path in out.rglob("*") if path.is_file()}


def refused(*arguments, cwd=None):
    """Type a command that cannot work, and touches nothing in ``cwd``; return its one sentence."""
    before = cwd and content(cwd)
    done = carom(*arguments, cwd=cwd)
    assert (done.returncode, done.stdout) == (2, ""), (arguments, done)
    (said,) = done.stderr.strip().splitlines()
    assert said.startswith("Error: ")
    assert (cwd and content(cwd)) == before, "something was touched"
    return said


def complaints(done):
    """Return what a command wrote to stderr, but for lines that say that it goes on, and that GSD knows
    no walls: which is said whenever such a file is begun, in a resumed run as well.
    """
    lines = done.stderr.splitlines(keepends=True)
    told = re.compile(r"\d+ s: |Note: .*GSD knows no walls")
    return "".join(line for line in lines if not told.match(line))


def start(*arguments, cwd=None):
    """Start a command and return at once."""
    return subprocess.Popen(
        [*CAROM, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for(condition, process):
    """Wait until the condition holds, while the process lives."""
    deadline = time.monotonic() + WAIT
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline, "nothing happened for a long time"
        time.sleep(0.002)


def plan(folder: Path, *, equilibration=100, measured=20000, frames=100) -> Path:
    """Write a small scene file and return its path."""
    path = folder / "small.toml"
    path.write_text(PLAN.format(equilibration=equilibration, measured=measured, frames=frames))
    return path


def whole_run(tmp_path_factory, **settings) -> tuple[Path, Path]:
    """Run a small scene file without interruption; return it and the folder of the run."""
    folder = tmp_path_factory.mktemp("reference")
    scene = plan(folder, **settings)
    done = carom("run", scene, "--out", folder / "run")
    assert done.returncode == 0, done.stderr
    return scene, folder / "run"


def datasets(path: Path) -> dict[str, np.ndarray]:
    """Return all arrays and attributes of an HDF5 file."""
    found = {}

    def visit(name, item):
        found.update({f"{name}@{key}": np.asarray(value) for key, value in item.attrs.items()})
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


def summary(folder: Path) -> dict:
    """Return what a run found."""
    return json.loads((folder / "summary.json").read_text())


def began(out: Path):
    """Return what tells one beginning of a run from another in the same folder: each writes the plan anew."""
    return (out / "scene.toml").stat().st_ino, (out / "scene.toml").stat().st_mtime_ns


def assert_same_run(one: Path, other: Path):
    """Two folders hold the same run, bit for bit."""
    assert sorted(p.name for p in one.iterdir()) == sorted(p.name for p in other.iterdir())
    for name in ("scene.toml", "trajectory.extxyz", "rdf.csv", "summary.json"):
        if (one / name).exists():
            assert (one / name).read_bytes() == (other / name).read_bytes(), name
    if (one / "trajectory.gsd").exists():
        # By frames, because GSD's index depends on when the file was opened.
        mine, its = (io.read(folder / "trajectory.gsd", ":") for folder in (one, other))
        assert list(map(checksums.of_frame, mine)) == list(map(checksums.of_frame, its))
    for path in (path for path in one.glob("*.h5*") if path.name != "checkpoint.h5"):
        mine, its = datasets(path), datasets(other / path.name)
        assert mine.keys() == its.keys()
        for key, value in mine.items():
            assert value.dtype == its[key].dtype
            assert np.array_equal(value, its[key]), f"{path.name}: {key}"
