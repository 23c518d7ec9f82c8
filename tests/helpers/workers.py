"""Tasks of tests for workers, spawned processes that import them from here."""

import os
import signal
import time
from pathlib import Path


def die(value):
    """Kill the worker: always, or the first time only."""
    mark = Path(value["mark"])
    if value["always"] or not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return value["number"]


def number_of(value):
    """The number of the process."""
    return os.getpid()


def rest(value):
    time.sleep(value)
    return os.getpid()


class Odd(Exception):
    """An error that takes two arguments and gives one to its base, so that it cannot be unpickled."""

    def __init__(self, value, what):
        super().__init__(f"{value} is {what}")


def odd(value):
    """Return a number that is even."""
    if value % 2:
        raise Odd(value, "odd")
    return value


def run_all(function, values, where, stop=lambda done: False):
    """Run a function of each value; return whether all were run, (value, result) and (value, reason)."""
    from carom.studies import executors

    done, failed = [], []
    ended = executors.run(
        function, values, where, stop=lambda: stop(done),
        done=lambda *each: done.append(each), failed=lambda *each: failed.append(each),
    )  # fmt: skip
    return ended, done, failed
