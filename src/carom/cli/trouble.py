"""What goes wrong, as one sentence on standard error and an exit code."""

from __future__ import annotations

import functools
import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

from carom.cli.heartbeat import starting
from carom.errors import CaromError, CaromWarning

BAD_INPUT = 2
"""Exit code for what cannot be used or written; that of unknown options, too."""

INTERRUPTED = 130
"""Exit code after Ctrl-C or SIGTERM: 128 and the number of SIGINT, as shells have it."""


def friendly(command: Callable[..., None]) -> Callable[..., None]:
    """Make errors of a command one sentence, and its warnings a line each.

    Anything that is no error of Carom is a bug, and keeps its traceback.
    """

    @functools.wraps(command)
    def wrapped(*arguments: Any, **options: Any) -> None:
        code = 0
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", CaromWarning)
                warnings.showwarning = _show_warning  # type: ignore[assignment]
                with starting():
                    command(*arguments, **options)
        except CaromError as error:
            _say(f"Error: {error}")
            code = BAD_INPUT
        except MemoryError:
            _say("Error: there is not enough memory for this; choose fewer particles or frames.")
            code = BAD_INPUT
        except BrokenPipeError:
            # The reader of our output has gone, e.g. `carom ... | head`: nobody is left to tell.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            code = 1
        except KeyboardInterrupt as stopped:
            _say(str(stopped) or "Stopped.")
            code = INTERRUPTED
        if code:
            import typer

            raise typer.Exit(code)

    return wrapped


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _show_warning(message: Warning | str, category: type[Warning], *_: Any) -> None:
    # Libraries warn programmers; only ours are for who runs a command.
    if issubclass(category, CaromWarning):
        _say(f"Note: {message}")
