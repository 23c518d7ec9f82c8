"""Ctrl-C and SIGTERM: they act at once where nothing would be lost, otherwise at the next safe moment."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """A run, a packing, a search or a study was stopped by Ctrl-C or SIGTERM; its text says how to go on.

    Attributes
    ----------
    so_far : Packing, SphericalCode, Study or None
        What is known until then; None of runs, and of searches that have no code yet.
    """

    def __init__(self, text: str = "Stopped.", so_far: Any = None):
        super().__init__(text)
        self.so_far = so_far


class Stop:
    """Whether a signal to stop was received, ``asked``.

    While ``deferred``, the first signal only sets ``asked``, and the second one raises KeyboardInterrupt;
    else the first one does.
    """

    def __init__(self) -> None:
        self.deferred = False
        self.asked = False

    def _receive(self, number: int, frame: FrameType | None) -> None:
        impatient = self.asked
        self.asked = True
        if impatient or not self.deferred:
            raise KeyboardInterrupt


@contextlib.contextmanager
def stoppable() -> Iterator[Stop]:
    """Receive Ctrl-C and SIGTERM in the body of a ``with``; only the main thread can.

    What the process ignores stays ignored: a shell so starts ``carom run ... &`` of a script.
    """
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    handlers = {number: signal.getsignal(number) for number in _SIGNALS}
    before = {number: handler for number, handler in handlers.items() if handler is not signal.SIG_IGN}
    for number in before:
        signal.signal(number, stop._receive)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            # None stands for a handler that Python did not install and cannot restore.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
