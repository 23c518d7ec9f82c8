"""Files of tests in copies of the worker, which end when they have grown large.

Compiled code cannot be given back: after all files a worker held gigabytes. A worker forks, the copy runs the
tests of one file after the other, as many as its memory allows, and the worker passes on what the copy
reports. What one file has compiled the next need not compile again.
"""

import gc
import os
import sys
from multiprocessing import Pipe
from pathlib import Path

import pytest

POSSIBLE = sys.platform == "linux"
"""Elsewhere a copy of a process in which threads run is not safe."""


LARGE = 1.25 * 2**30
"""Memory [bytes] of a copy that takes no further file."""


MANY = 20
"""Files of tests that are worth kernels compiled beforehand."""


def compile_common_kinds():
    """Compile the most common kernels: what they inline, nearly all kernels inline.

    A copy has it in its memory, and compiles only what is new in a kind of its own. The cache on disk keeps
    whole kernels, of which no other kernel can use a part.
    """
    import carom

    for dimension in (2, 3):
        scene = carom.Scene.crystal(dimension=dimension, cells=8, packing_fraction=0.3)
        carom.Simulation(scene, seed=1).run(collisions=1)


class Apart:
    """The plugin of a worker."""

    def __init__(self, config):
        self.config = config
        self.pid, self.pipe = 0, None
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
            while (data := self.pipe.recv()) is not None:
                self.log(
                    item, self.config.hook.pytest_report_from_serializable(config=self.config, data=data)
                )
        except (EOFError, OSError):
            status = self.end()
            what = f"the process of {item.path.name} ended: status {status}"
            self.log(item, pytest.TestReport(item.nodeid, item.location, {}, "failed", what, "call"))
        else:
            if not goes_on:
                self.end()
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_sessionfinish(self):
        """Leave no copy behind."""
        if self.pid and not self.inside:
            self.end()

    def log(self, item, report):
        item.ihook.pytest_runtest_logreport(report=report)

    def size(self):
        """Return the memory [bytes] of the copy."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")

    def fork(self, session):
        """Start the copy."""
        self.pipe, other = Pipe()
        self.pid = os.fork()
        if self.pid:
            other.close()
            return
        try:
            self.pipe.close()
            self.inside = True
            run(session, other)
        finally:
            os._exit(1)

    def end(self):
        """Wait until the copy has ended; return its status."""
        self.pipe.close()
        _, status = os.waitpid(self.pid, 0)
        self.pid, self.pipe = 0, None
        return status


def run(session, pipe):
    """Run tests as they are asked for, and send the reports, each time with None at the end."""
    plugins = session.config.pluginmanager
    for plugin in plugins.get_plugins():
        if type(plugin).__name__ in ("WorkerInteractor", "TerminalReporter"):
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
