"""A line on the screen for each thing that is compiled, so that these seconds do not look like a hang.

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

TEXT = "Compiling."
STOPPED = "Stopped while compiling: type the same command again, or carom resume with its folder."


def _leave() -> NoReturn:
    """End the process."""
    if sys.stderr.isatty():
        print("\x1b[?25h", file=sys.stderr)  # a progress bar hides the cursor
    say(STOPPED)
    os._exit(INTERRUPTED)


@contextlib.contextmanager
def compiling_told() -> Iterator[None]:
    """Print on standard error, each line once, what the body compiles, here or in a worker process."""
    from carom.compiling.compile_listeners import listening
    from carom.compiling.deferred_signals import leaving

    said: set[str] = set()

    def tell(news: str) -> None:
        text = news or ("" if said else TEXT)
        if text and text not in said and not quiet():
            said.add(text)
            say(text)

    with listening(tell), leaving(_leave):
        yield
