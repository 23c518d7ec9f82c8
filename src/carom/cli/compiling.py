"""A line on the screen when something is compiled, so that nobody takes the first seconds for a hang."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import Any

TEXT = "Compiling for this kind of scene: ten seconds or more, the first time only; Ctrl-C is heard after it."


@contextlib.contextmanager
def compiling_told() -> Iterator[None]:
    """Say once on standard error when something is compiled in the body, in this process.

    What is found in the cache is not compiled, and Numba's listeners are not told of it.
    """
    from numba.core import event

    class Teller(event.Listener):
        """Says it at the first event."""

        said = False

        def on_start(self, event: Any) -> None:
            """Say it, once."""
            if not self.said:
                self.said = True
                print(TEXT, file=sys.stderr, flush=True)

        def on_end(self, event: Any) -> None:
            """Say nothing."""

    teller = Teller()
    event.register("numba:compile", teller)
    try:
        yield
    finally:
        event.unregister("numba:compile", teller)
