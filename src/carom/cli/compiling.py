"""A line on the screen when something is compiled, so that the first seconds do not look like a hang.

Ctrl-C then ends the process at once.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import NoReturn

from carom.cli.heartbeat import quiet, say
from carom.cli.trouble import INTERRUPTED

TEXT = "Compiling for this kind of scene: ten seconds or more, the first time only."
STOPPED = "Stopped while compiling: type the same command again, or carom resume with its folder."


def _leave() -> NoReturn:
    """End the process."""
    if sys.stderr.isatty():
        print("\x1b[?25h", file=sys.stderr)  # a progress bar hides the cursor
    say(STOPPED)
    os._exit(INTERRUPTED)


@contextlib.contextmanager
def compiling_told() -> Iterator[None]:
    """Print one line on standard error if the body compiles something, here or in a worker process."""
    from carom.compiling.compile_listeners import listening
    from carom.compiling.deferred_signals import leaving

    said = False

    def tell() -> None:
        nonlocal said
        if not said and not quiet():
            said = True
            say(TEXT)

    with listening(tell), leaving(_leave):
        yield
