"""One at a time: a simulation is used by one thread, and does not run while it is already running.

Compiled code runs at the same time as other threads and rewrites arrays in place. A second thread could read
half of an event, or an invalid index, and crash the program.
"""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Callable, Iterator
from typing import Any, Concatenate, ParamSpec, TypeVar

from carom.errors import BusyError

P = ParamSpec("P")
S = TypeVar("S", bound=Any)
T = TypeVar("T")


class RunGuard:
    """Who is using a simulation: ``moving`` while it is running or being changed."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self.moving = False

    @contextlib.contextmanager
    def reading(self) -> Iterator[None]:
        """Keep other threads out while the body looks."""
        if not self._lock.acquire(blocking=False):
            raise BusyError(
                "This simulation is in use by another thread; use one Simulation a thread, or look at this "
                "one from its own: run(progress=...) calls back."
            )
        try:
            yield
        finally:
            self._lock.release()

    @contextlib.contextmanager
    def changing(self) -> Iterator[None]:
        """Keep everybody out while the body runs on, or changes what runs."""
        with self.reading():
            if self.moving:
                raise BusyError(
                    "This simulation is running: a callback may look at it and save() it, but not "
                    "run, rescale or close it; do so when run() has returned."
                )
            self.moving = True
            try:
                yield
            finally:
                self.moving = False


def exclusive(method: Callable[Concatenate[S, P], T]) -> Callable[Concatenate[S, P], T]:
    """Make a method of a simulation one that another thread's run refuses."""

    @functools.wraps(method)
    def looking(self: S, *arguments: P.args, **options: P.kwargs) -> T:
        with self._state.alone.reading():
            return method(self, *arguments, **options)

    return looking
