"""A line on the screen when something is compiled, so that the first seconds do not look like a hang."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from carom.cli.heartbeat import quiet, say

TEXT = "Compiling for this kind of scene: ten seconds or more, the first time only; Ctrl-C acts afterwards."


@contextlib.contextmanager
def compiling_told() -> Iterator[None]:
    """Print one line on standard error if the body compiles something, here or in a worker process."""
    from carom.compiling.compile_listeners import listening

    said = False

    def tell() -> None:
        nonlocal said
        if not said and not quiet():
            said = True
            say(TEXT)

    with listening(tell):
        yield
