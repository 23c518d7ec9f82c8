"""Ctrl-C while something is compiled: kept until that is done, or the end of the process at once.

An exception raised where the compiler calls back into Python is lost, and it would fail later on. A command
may end the process instead: it loses no more than one that is killed.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from typing import NoReturn

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_leave: Callable[[], NoReturn] | None = None


@contextlib.contextmanager
def leaving(leave: Callable[[], NoReturn]) -> Iterator[None]:
    """Call a function that ends the process, in a thread, as soon as a signal comes while it compiles."""
    global _leave
    _leave, before = leave, _leave
    try:
        yield
    finally:
        _leave = before


@contextlib.contextmanager
def _watched(leave: Callable[[], NoReturn]) -> Iterator[None]:
    """Watch for signals in a thread: LLVM works for seconds in which the main thread runs no handler."""
    readable, writable = os.pipe()
    os.set_blocking(writable, False)

    def watch() -> None:
        while came := os.read(readable, 1):
            if came[0] in SIGNALS:
                leave()

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    before = signal.set_wakeup_fd(writable)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writable)  # ends the thread
        watcher.join()
        os.close(readable)


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Note signals that come while the body runs, and raise them afterwards."""
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    # Only the main thread receives signals, and only what Python installed can be put back.
    if threading.current_thread() is not threading.main_thread() or None in handlers.values():
        yield
        return
    came: list[int] = []
    for number in SIGNALS:
        signal.signal(number, lambda number, frame: came.append(number))
    try:
        with contextlib.nullcontext() if _leave is None else _watched(_leave):
            yield
    finally:
        for one, handler in handlers.items():
            signal.signal(one, handler)
        for each in dict.fromkeys(came):
            signal.raise_signal(each)
