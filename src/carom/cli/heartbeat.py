"""A line on standard error every ten seconds, so that a long run without a bar does not look like a hang."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterator

from carom.notebook import LEAST
from carom.texts import visible

EVERY = 10.0
"""Seconds between two lines."""


_present: Heartbeat | None = None
"""The heartbeat that prints, if any."""

_quiet = False


def hush(wanted: bool) -> None:
    """Show progress from here on, or do not: the option --quiet of a command."""
    global _quiet
    _quiet = wanted


def quiet() -> bool:
    """Return whether no progress is to be shown."""
    return _quiet


def say(text: str) -> None:
    """Print a line on standard error; no command fails because that cannot be written."""
    with contextlib.suppress(OSError):
        print(visible(text), file=sys.stderr, flush=True)


def starting() -> contextlib.AbstractContextManager[object]:
    """Print from the start of a command to its end: imports and pictures take long on a busy machine, too."""
    silent = _quiet or sys.stderr.isatty()
    return contextlib.nullcontext() if silent else Heartbeat("Starting").beating()


class Heartbeat:
    """Lines about the ``state`` of some work, printed by a thread of its own."""

    def __init__(self, state: str):
        self.state = state
        self._began = time.monotonic()
        self._end = threading.Event()

    def tell(self, stage: str, fraction: float | None = None) -> None:
        """Set the state: a stage, and the fraction of it that is done if that is known and not too small."""
        self.state = stage if fraction is None or fraction < LEAST else f"{stage}, {100.0 * fraction:.0f} %"

    def _beat(self) -> None:
        while not self._end.wait(EVERY):
            passed = time.monotonic() - self._began
            say(f"{passed:.0f} s: {self.state}")

    @contextlib.contextmanager
    def beating(self) -> Iterator[Heartbeat]:
        """Print while the body runs. If another heartbeat prints already, it prints this state instead."""
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
