"""Errors of commands: one sentence on standard error, and an exit code."""

from __future__ import annotations

import functools
import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

from carom.cli.heartbeat import starting
from carom.errors import CaromError, CaromWarning
from carom.texts import visible

BAD_INPUT = 2
"""Exit code for input that cannot be used and files that cannot be written; also for unknown options."""

INTERRUPTED = 130
"""Exit code after Ctrl-C or SIGTERM: 128 plus the number of SIGINT, as in shells."""


def friendly(command: Callable[..., None]) -> Callable[..., None]:
    """Print errors of a command as one sentence each, and its warnings as one line each.

    Unexpected exceptions are bugs and keep their traceback.
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
            # The reader of the output has ended, as in `carom ... | head`: nothing more can be printed.
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
    print(visible(text), file=sys.stderr, flush=True)


def _show_warning(message: Warning | str, category: type[Warning], *_: Any) -> None:
    # Warnings of libraries are for programmers; only those of Carom are for users of a command.
    if issubclass(category, CaromWarning):
        _say(f"Note: {message}")
