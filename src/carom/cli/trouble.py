"""Errors of commands: one sentence on standard error, and an exit code."""

from __future__ import annotations

import contextlib
import functools
import io
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any

from carom.cli.heartbeat import say, starting
from carom.errors import CaromError, CaromWarning

BAD_INPUT = 2
"""Exit code for input that cannot be used and files that cannot be written; also for unknown options."""

PARTLY = 3
"""Exit code of what is finished with points missing or flagged, or a target missed: all of it is kept."""

INTERRUPTED = 130
"""Exit code after Ctrl-C or SIGTERM: 128 plus the number of SIGINT, as in shells."""


def friendly(command: Callable[..., None]) -> Callable[..., None]:
    """Print errors of a command as sentences, warnings as lines; a bug keeps its traceback."""

    @functools.wraps(command)
    def wrapped(*arguments: Any, **options: Any) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("always", CaromWarning)
            warnings.showwarning = _shows_warnings()
            with told(), starting():
                command(*arguments, **options)

    return wrapped


@contextlib.contextmanager
def told() -> Iterator[None]:
    """Turn what the body raises, if no bug, into a sentence on standard error and an exit code."""
    code = 0
    try:
        yield
    except CaromError as error:
        say(f"Error: {error}")
        code = BAD_INPUT
    except MemoryError:
        say("Error: there is not enough memory for this; choose fewer particles or frames.")
        code = BAD_INPUT
    except BrokenPipeError:
        # The reader of the output has ended, as in `carom ... | head`: nothing more can be printed.
        _close_output()
        code = 1
    except OSError as error:
        _close_output()
        where = f"{error.filename} cannot be used" if error.filename else "The output cannot be written"
        say(f"Error: {where}: {error.strerror or error}; free some space, or give another place.")
        code = BAD_INPUT
    except UnicodeError as error:
        say(f"Error: The name of a file or folder is no text ({error}); give it another name.")
        code = BAD_INPUT
    except KeyboardInterrupt as stopped:
        say(str(stopped) or "Stopped.")
        code = INTERRUPTED
    if code:
        import typer

        raise typer.Exit(code)


def started(command: Any) -> None:
    """Run a command to the end of the process, with its exit code."""
    import typer

    from carom.figures.style import nobody_reads_docstrings

    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    whole_streams()
    nobody_reads_docstrings()
    try:
        with told():
            try:
                command()
            finally:
                # Here, because a full device may refuse nothing before.
                sys.stdout.flush()
    except typer.Exit as ended:
        sys.exit(ended.exit_code)
    finally:
        try:
            sys.stderr.flush()
        except OSError:  # Python would end with a code of its own
            _lead_nowhere(sys.stderr)


def _close_output() -> None:
    """Let all further output go nowhere: what is in the buffer would fail again at the end of the process."""
    _lead_nowhere(sys.stdout)


def _lead_nowhere(stream: Any) -> None:
    with contextlib.suppress(OSError, ValueError):  # no descriptor, as in a test
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def whole_streams() -> None:
    """Make standard streams that are closed lead nowhere: else the next file to be opened would be one.

    A terminal that cannot show a character gets a replacement instead of a traceback.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
        if getattr(sys, name) is None:
            mode = "r" if number == 0 else "w"
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _shows_warnings() -> Callable[..., None]:
    """Return what shows warnings, each sentence once: two quantities may have the same doubt."""
    shown = set[str]()

    def show(message: Warning | str, category: type[Warning], *_: Any) -> None:
        # Warnings of libraries are for programmers; only those of Carom are for users of a command.
        if issubclass(category, CaromWarning) and str(message) not in shown:
            shown.add(str(message))
            say(f"Note: {message}")

    return show
