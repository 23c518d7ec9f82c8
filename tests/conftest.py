"""Settings of the whole test session."""

import os

import pytest
from helpers import apart
from helpers.marks import slow
from hypothesis import settings

# The same examples in every run: a failure on one machine is a failure on all. Times vary with compilation.
settings.register_profile("carom", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("carom")


def pytest_configure(config):
    """Let workers give back the memory of each file."""
    if hasattr(config, "workerinput") and apart.POSSIBLE:
        config.pluginmanager.register(apart.Apart(config))


@pytest.fixture
def unscheduled(monkeypatch):
    """Let simulations have no first events: nothing can run, and nothing is compiled."""
    from carom.simulation.run_state import RunState

    monkeypatch.setattr(RunState, "schedule", lambda machine: None)


@pytest.fixture
def plain(monkeypatch):
    """Let simulations of this process run as plain Python: the same bits, and nothing is compiled."""
    import numpy as np

    from carom.engine import cycle, projection

    for module, name in ((cycle, "schedule"), (cycle, "run"), (projection, "project")):
        compiled = getattr(module, name)
        monkeypatch.setattr(module, name, getattr(compiled, "__wrapped__", compiled))
    with np.errstate(all="ignore"):  # compiled code divides by zero without a word
        yield


@pytest.fixture(params=["plain", slow("compiled")])
def both_ways(request):
    """Let what has some hundreds of events run as plain Python by default, and compiled under ``-m slow``."""
    if request.param == "plain" and request.node.get_closest_marker("slow") is None:
        request.getfixturevalue("plain")


MOST = 4
"""Workers: each takes a gigabyte, for all the kernels that it loads."""


def pytest_xdist_auto_num_workers(config):
    """Return how many processes share the tests: all cores for all of them; for a part, this one alone."""
    everything = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    return min(os.cpu_count() or 1, MOST) if everything else 0


MAY_SKIP = (
    "nothing is forbidden to root",
    "root may write everything",
    "no room for two spheres",
    "three dimensions at most",
    "needs two idle cores",
    "no Chromium is installed",
    "no Node is installed",
    "reads x86-64 instructions",
    "LAMMPS is not installed",
)
"""Reasons to skip that no installed package would remove."""


def pytest_addoption(parser):
    """Add ``--no-skips``, for where everything is installed that a test may need."""
    parser.addoption("--no-skips", action="store_true", help="a skip that nobody expects is a failure")


def _fail_if_skipped(config, report):
    if report.skipped and not hasattr(report, "wasxfail") and config.getoption("no_skips"):
        reason = str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
        if not any(allowed in reason for allowed in MAY_SKIP):
            report.outcome = "failed"
            report.longrepr = f"--no-skips: {reason}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Let a test fail that is skipped without leave."""
    return _fail_if_skipped(item.config, (yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let a file fail that is skipped without leave."""
    return _fail_if_skipped(collector.config, (yield))
