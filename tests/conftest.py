"""Settings of the whole test session."""

import dataclasses
import functools
import os
import signal
from collections import Counter

import pytest
import typer.testing
from helpers.limits import SLOW_LIMIT, Limits
from helpers.marks import slow
from helpers.memory import give_back
from helpers.needs import NEEDS, needs_of, reason, skip_without
from helpers.plain import uncompiled
from hypothesis import settings

# The same examples in every run: a failure on one machine is a failure on all. Times vary with compilation.
settings.register_profile("carom", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("carom")


# To make all commands of an application takes longer than most of what they are typed for here.
typer.testing._get_command = functools.cache(typer.testing._get_command)


def pytest_configure(config):
    """Let each test have a limit, and Ctrl-C interrupt.

    A process started by ``pytest &`` in a script, or by some runners of jobs, ignores Ctrl-C otherwise, and
    so does each one that a test starts.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    config.pluginmanager.register(Limits())


@pytest.fixture
def unscheduled(monkeypatch):
    """Let simulations have no first events: nothing can run, and nothing is compiled."""
    from carom.simulation.run_state import RunState

    monkeypatch.setattr(RunState, "schedule", lambda machine: None)


@pytest.fixture
def plain():
    """Let simulations of this process run as plain Python: the same bits, and nothing is compiled."""
    with uncompiled():
        yield


@pytest.fixture
def shorten_epochs(monkeypatch):
    """Return a function that gives epochs a length, for simulations that begin or are refitted after it."""
    from carom.engine.neighbors import plan

    def shorten(epoch):
        def choose_short(*given, choose=plan.choose):
            found = choose(*given)
            width, span = min(found.width, epoch), min(found.span, epoch)
            return dataclasses.replace(found, epoch=epoch, width=width, span=span)

        monkeypatch.setattr(plan, "choose", choose_short)

    return shorten


@pytest.fixture
def short_epochs(shorten_epochs):
    """Let many epochs end in a run of some collisions."""
    shorten_epochs(2.0**-4)


@pytest.fixture(params=["plain", slow("compiled")])
def both_ways(request):
    """Let what has some hundreds of events run as plain Python by default, and compiled under ``-m slow``."""
    if request.param == "plain":
        request.getfixturevalue("plain")


MOST = 4
"""Workers: each takes a gigabyte, for all the kernels that it loads."""


def pytest_xdist_auto_num_workers(config):
    """Return how many processes share the tests: all cores for all of them; for a part, this one alone."""
    everything = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    return min(os.cpu_count() or 1, MOST) if everything else 0


def pytest_addoption(parser):
    """Add ``--needing``, for where more is installed than the default tests need."""
    text = f"run what needs one of these alone, and skip nothing; names of {', '.join(NEEDS)}"
    parser.addoption("--needing", type=lambda names: set(names.split(",")), help=text)


def _is_slow_and_plain(item):
    """Tell whether this is the plain half of a slow test, which has its compiled one."""
    way = getattr(item, "callspec", None) and item.callspec.params.get("both_ways")
    return way == "plain" and item.get_closest_marker("slow") is not None


def pytest_collection_modifyitems(config, items):
    """Give slow tests a larger limit, and leave the tests that ``--needing`` asks for."""
    items[:] = [item for item in items if not _is_slow_and_plain(item)]
    for item in items:
        if item.get_closest_marker("slow") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(SLOW_LIMIT))
    if (asked := config.getoption("needing")) is not None:
        if unknown := asked - {*NEEDS}:
            raise pytest.UsageError(f"--needing knows {', '.join(NEEDS)}; found {', '.join(unknown)}.")
        needed = {item: needs_of(item) for item in items}
        config.hook.pytest_deselected(items=[item for item in items if not asked & needed[item]])
        items[:] = [item for item in items if asked & needed[item]]


def pytest_runtest_setup(item):
    """Skip a test that needs what is not there."""
    skip_without(*needs_of(item) - (item.config.getoption("needing") or set()))


def pytest_runtest_logfinish():
    """Keep a worker below a gigabyte."""
    give_back()


def _said(report):
    """Return why a test or a file was skipped."""
    said = report.longrepr[2] if isinstance(report.longrepr, tuple | list) else report.longrepr
    return str(said).removeprefix("Skipped: ")


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter):
    """Tell in one line what was not run, for lack of what."""
    lacks = Counter(map(_said, terminalreporter.stats.get("skipped", ())))
    if lacks:
        why = ", ".join(
            f"{n} {each if n == 1 else each.replace('needs', 'need')}" for each, n in sorted(lacks.items())
        )
        terminalreporter.write_line(f"Tests not run: {why}; see Check in CONTRIBUTING.md.")


def _fail_if_skipped(report):
    if report.skipped and not hasattr(report, "wasxfail"):
        said = _said(report)
        if said not in map(reason, NEEDS):
            report.outcome = "failed"
            report.longrepr = f"This was skipped ({said}), and tests/helpers/needs.py has no such reason."
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport():
    """Let a test fail that is skipped without leave."""
    return _fail_if_skipped((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report():
    """Let a file fail that is skipped without leave."""
    return _fail_if_skipped((yield))
