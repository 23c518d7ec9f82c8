"""Telling when something is compiled."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any


@contextlib.contextmanager
def compiling_heard(say: Callable[[], None]) -> Iterator[None]:
    """Call ``say`` once when something is compiled in the body, in this process.

    What is found in the cache is not compiled. Numba promises its events to nobody: where they are missing,
    nothing is said.
    """
    try:
        from numba.core import event

        teller = _teller(event.Listener, say)
        event.register("numba:compile", teller)
    except (ImportError, AttributeError):
        yield
        return
    try:
        yield
    finally:
        event.unregister("numba:compile", teller)


def _teller(base: type, say: Callable[[], None]) -> Any:
    class Teller(base):
        """Calls ``say`` at the first event."""

        said = False

        def on_start(self, event: Any) -> None:
            """Say it, once."""
            if not self.said:
                self.said = True
                say()

        def on_end(self, event: Any) -> None:
            """Say nothing."""

    return Teller()
