"""A line on standard error every ten seconds where no bar can be shown, so that a long run is no hang."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterator

from carom.notebook import LEAST

EVERY = 10.0
"""Seconds between two lines."""


_present: Heartbeat | None = None
"""The one that prints, if any."""


def starting() -> contextlib.AbstractContextManager[object]:
    """Print from the start of a command to its end: imports and pictures take long on a busy machine, too."""
    return contextlib.nullcontext() if sys.stderr.isatty() else Heartbeat("Starting").beating()


class Heartbeat:
    """The state of some work in words, printed now and then by a thread of its own.

    Attributes
    ----------
    state : str
        What is going on; the next line says so.
    """

    def __init__(self, state: str):
        self.state = state
        self._began = time.monotonic()
        self._end = threading.Event()

    def tell(self, stage: str, fraction: float | None = None) -> None:
        """Note what is going on, and which part of it is done, if that is known and more than nothing."""
        self.state = stage if fraction is None or fraction < LEAST else f"{stage}, {100.0 * fraction:.0f} %"

    def _beat(self) -> None:
        while not self._end.wait(EVERY):
            passed = time.monotonic() - self._began
            print(f"{passed:.0f} s: {self.state}", file=sys.stderr, flush=True)

    @contextlib.contextmanager
    def beating(self) -> Iterator[Heartbeat]:
        """Print while the body runs; where another one prints already, it says what this one would say."""
        global _present
        if _present is not None:
            _present.state = self.state
            yield _present
            _present.state = "Finishing"
            return
        _present = self
        thread = threading.Thread(target=self._beat, name="carom-heartbeat", daemon=True)
        thread.start()
        try:
            yield self
        finally:
            _present = None
            self._end.set()
            thread.join()
