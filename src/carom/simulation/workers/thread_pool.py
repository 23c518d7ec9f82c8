"""Threads that take one step after another, all at once, and the cores that there are for them."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any


class ThreadPool:
    """A fixed number of threads."""

    def __init__(self, workers: int):
        self.workers = workers
        self._pool = None if workers == 1 else ThreadPoolExecutor(workers)
        self._process = os.getpid()
        self._seen = {"<lambda>"}

    def each(
        self, step: Callable[..., Any], *arguments: Any, halt: Callable[[], None] | None = None
    ) -> list[Any]:
        """Call ``step(k, *arguments)`` for every worker k, each in its thread, and return what they return.

        The first time they go one after the other in this thread, which compiles the step; not where they
        need each other: such a step is compiled before, and comes with ``halt``, which makes all end soon
        where one fails.
        """
        if self._pool is None or (halt is None and step.__name__ not in self._seen):
            self._seen.add(step.__name__)
            return [step(k, *arguments) for k in range(self.workers)]
        if self._process != os.getpid():  # a fork has no threads but the one that forked
            self._pool, self._process = ThreadPoolExecutor(self.workers), os.getpid()
        futures: list[Future[Any]] = [self._pool.submit(step, k, *arguments) for k in range(self.workers)]
        try:
            return [future.result() for future in futures]
        except BaseException:
            if halt is not None:
                halt()
            wait(futures)
            raise

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None and self._process == os.getpid():
            self._pool.shutdown()
        self._pool = None


SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Note signals that come while the body runs, and raise them afterwards."""
    found = {number: signal.getsignal(number) for number in SIGNALS}
    handlers = {number: handler for number, handler in found.items() if handler is not signal.SIG_IGN}
    # Only the main thread receives signals, and only what Python installed can be put back.
    if threading.current_thread() is not threading.main_thread() or None in handlers.values():
        yield
        return
    came: list[int] = []
    for number in SIGNALS:
        signal.signal(number, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for one, handler in handlers.items():
            signal.signal(one, handler)
        for each in dict.fromkeys(came):
            signal.raise_signal(each)
