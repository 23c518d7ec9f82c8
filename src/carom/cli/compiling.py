"""A line on the screen when something is compiled, so that nobody takes the first seconds for a hang."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager

TEXT = "Compiling for this kind of scene: ten seconds or more, the first time only; Ctrl-C is heard after it."


def compiling_told() -> AbstractContextManager[None]:
    """Say once on standard error when something is compiled in the body, in this process."""
    from carom.compiling.telling import compiling_heard

    return compiling_heard(lambda: print(TEXT, file=sys.stderr, flush=True))
