"""A limit on the time of every test, wherever it hangs.

pytest-timeout sends a signal, which Python hears between two lines and while it waits: the test fails, and
the next ones run. Compiled code hears none. There a thread without Python writes where all threads are and
ends the process, half a limit later, and with it the run.
"""

import faulthandler
import os

import pytest

SLOW_LIMIT = 3600.0
"""Limit [s] of a test marked slow; pyproject.toml has that of all others."""

LATER = 1.5
"""Limits after which the process ends."""


class Limits:
    """The plugin; ``file`` is where stacks are written."""

    def __init__(self):
        self.file = os.dup(2)  # pytest captures what follows
        self.seconds = None

    @pytest.hookimpl(wrapper=True, optionalhook=True)
    def pytest_timeout_set_timer(self, settings):
        """Begin with a test."""
        self.seconds = settings.timeout
        self.start()
        return (yield)

    @pytest.hookimpl(wrapper=True, optionalhook=True)
    def pytest_timeout_cancel_timer(self):
        """End with a test, or where one has failed."""
        faulthandler.cancel_dump_traceback_later()
        return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_teardown(self):
        """Begin again: what clears up after a test that hung may hang as well."""
        if self.seconds:
            self.start()
        return (yield)

    def pytest_runtest_logfinish(self):
        """Forget the limit: the next test may have none."""
        self.seconds = None

    def start(self):
        faulthandler.dump_traceback_later(LATER * self.seconds, exit=True, file=self.file)
