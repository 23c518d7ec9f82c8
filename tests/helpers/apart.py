"""Files of tests in forked copies of the worker, which end when they have grown large: compiled code cannot
be given back, and what one file has compiled the next need not.
"""

import faulthandler
import gc
import os
import re
import sys
import tempfile
import traceback
from multiprocessing import Pipe
from multiprocessing.connection import wait
from pathlib import Path

import pytest

POSSIBLE = sys.platform == "linux"
"""Elsewhere a copy of a process in which threads run is not safe."""


LARGE = 1.25 * 2**30
"""Memory [bytes] of a copy that takes no further file."""


MANY = 20
"""Files of tests that are worth kernels compiled beforehand."""


def compile_common_kinds():
    """Compile the most common kernels, whose parts nearly all others inline: the cache on disk keeps whole
    kernels only.
    """
    import carom

    for dimension in (2, 3):
        scene = carom.Scene.crystal(dimension=dimension, cells=8, packing_fraction=0.3)
        carom.Simulation(scene, seed=1).run(collisions=1)


class Apart:
    """The plugin of a worker."""

    def __init__(self, config, limits):
        self.config, self.limits = config, limits
        self.pid, self.pipe, self.alive = 0, None, None
        self.stacks = tempfile.TemporaryFile()  # noqa: SIM115 (as long as this process lives)
        self.inside = False

    def pytest_collection_finish(self, session):
        """Load what every copy needs, once."""
        from numba import njit

        from carom.engine import cycle  # noqa: F401 (imported for the copies)

        self.places = {item.nodeid: k for k, item in enumerate(session.items)}
        self.config._tmp_path_factory.getbasetemp()
        njit(lambda x: x)(1)
        if len({item.path for item in session.items}) >= MANY:
            compile_common_kinds()
        gc.collect()
        gc.freeze()  # what is there before the copies is of no interest to their garbage collection

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        """Let the copy run a test."""
        if self.inside:
            return None
        if not self.pid:
            self.fork(item.session)
        goes_on = nextitem is not None and (nextitem.path == item.path or self.size() < LARGE)
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        try:
            self.pipe.send((self.places[item.nodeid], self.places[nextitem.nodeid] if goes_on else None))
            while (data := self.answer()) is not None:
                self.log(
                    item, self.config.hook.pytest_report_from_serializable(config=self.config, data=data)
                )
        except (EOFError, OSError):
            what = self.told(item.path.name, os.waitstatus_to_exitcode(self.end()))
            self.log(item, pytest.TestReport(item.nodeid, item.location, {}, "failed", what, "call"))
        else:
            if not goes_on:
                self.end()
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    @pytest.hookimpl(tryfirst=True, optionalhook=True)
    def pytest_timeout_set_timer(self):
        """Leave limits to the copy."""
        return None if self.inside else True

    def pytest_sessionfinish(self):
        """Leave no copy behind."""
        if self.pid and not self.inside:
            self.end()

    def log(self, item, report):
        item.ihook.pytest_runtest_logreport(report=report)

    def answer(self):
        """Return what the copy says next; EOFError once it has ended, also where its child has the pipe."""
        if self.pipe not in wait([self.pipe, self.alive]):
            raise EOFError
        return self.pipe.recv()

    def told(self, name, status):
        """Return how a copy has ended, and where it was, but for the lines of pytest itself."""
        self.stacks.seek(0)
        lines = self.stacks.read().decode(errors="replace").splitlines()
        how = "hung in this test until its time was over" if lines and "Timeout" in lines[0] else "ended"
        own = [line for line in lines if not re.search(r"/(_pytest|pluggy|xdist|execnet)/", line)]
        return "\n".join([f"The process of {name} {how}: status {status}.", *own])

    def size(self):
        """Return the memory [bytes] of the copy."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")

    def fork(self, session):
        """Start the copy."""
        self.pipe, other = Pipe()
        self.stacks.seek(0)
        self.stacks.truncate()
        self.pid = os.fork()
        if self.pid:
            self.alive = os.pidfd_open(self.pid)
            other.close()
            return
        try:
            self.pipe.close()
            self.inside = True
            self.limits.file = self.stacks.fileno()
            faulthandler.enable(self.limits.file)
            self.config.pluginmanager.register(self.limits)
            run(session, other)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(1)

    def end(self):
        """Wait until the copy has ended; return its status."""
        self.pipe.close()
        _, status = os.waitpid(self.pid, 0)
        os.close(self.alive)
        self.pid, self.pipe, self.alive = 0, None, None
        return status


def run(session, pipe):
    """Run tests as they are asked for, and send the reports, each time with None at the end."""
    plugins = session.config.pluginmanager
    for plugin in plugins.get_plugins():
        if type(plugin).__name__ == "WorkerInteractor":
            plugins.unregister(plugin)
    plugins.register(Reports(session.config, pipe))
    try:
        while True:
            here, after = pipe.recv()
            session.config.hook.pytest_runtest_protocol(
                item=session.items[here], nextitem=None if after is None else session.items[after]
            )
            pipe.send(None)
    except EOFError:  # the worker needs no more
        os._exit(0)


class Reports:
    """The plugin of the copy."""

    def __init__(self, config, pipe):
        self.config, self.pipe = config, pipe

    def pytest_runtest_logreport(self, report):
        """Send a report to the worker."""
        self.pipe.send(self.config.hook.pytest_report_to_serializable(config=self.config, report=report))
