"""Threads that take one step after another, all at once, and the cores that there are for them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Crew:
    """A fixed number of threads.

    Parameters
    ----------
    workers : int
        How many.

    Attributes
    ----------
    stopping : threading.Event
        Set while all are to stop: a long step looks at it now and then.
    """

    def __init__(self, workers: int):
        self.workers = workers
        self.stopping = threading.Event()
        self._pool = None if workers == 1 else ThreadPoolExecutor(workers)
        self._seen = {"<lambda>"}

    def each(self, step: Callable[..., Any], *arguments: Any, together: bool = False) -> list[Any]:
        """Call ``step(k, *arguments)`` for every worker k, each in its thread, and return what they return.

        The first time they go one after the other, in this thread: that is when the step is compiled. They do
        not where they need each other, ``together``: such a step has been compiled before.
        """
        if self._pool is None or not (together or step.__name__ in self._seen):
            self._seen.add(step.__name__)
            return [step(k, *arguments) for k in range(self.workers)]
        self.stopping.clear()
        futures: list[Future[Any]] = [self._pool.submit(step, k, *arguments) for k in range(self.workers)]
        try:
            return [future.result() for future in futures]
        except BaseException:
            self.stopping.set()
            wait(futures)
            self.stopping.clear()
            raise

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
