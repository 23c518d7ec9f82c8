"""For all files of Carom: clear errors about paths, and files that are written completely or not at all."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

from carom.errors import CaromError, FileError

#: Errors that parsers raise on unexpected bytes (h5py and gsd raise all of these).
PARSE_ERRORS = (
    OSError,
    EOFError,
    LookupError,
    ValueError,
    TypeError,
    AttributeError,
    ArithmeticError,
    RuntimeError,
    MemoryError,
)


def reason(error: BaseException) -> str:
    """Return the first line of an exception's text, fit for the middle of a sentence."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    return text.strip().splitlines()[0].rstrip(".")


def existing(path: str | os.PathLike[str]) -> Path:
    """Return `path` if it is a file."""
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path} is a folder, where a file was expected; name a file inside it.")
    if not path.exists():
        raise FileError(f"{path} does not exist; check the name and the folder.")
    if not path.is_file():
        raise FileError(f"{path} is no regular file; copy its content into one.")
    return path


def writable(path: str | os.PathLike[str]) -> Path:
    """Return `path` if a file can stand there: no folder, and inside a folder that exists."""
    path = Path(path)
    if path.is_dir():
        raise FileError(f"{path} is a folder, where a file was to be written; name a file inside it.")
    if not path.parent.is_dir():
        refuse_dangling(path.parent)
        raise FileError(
            f"{path} cannot be written: its folder {path.parent} does not exist; create it first."
        )
    return path


def refuse_dangling(path: Path) -> None:
    """Raise FileError if a folder is, or lies behind, a link to what does not exist: it cannot be made."""
    link = next((each for each in (path, *path.parents) if each.is_symlink() and not each.exists()), None)
    if link is not None:
        raise FileError(
            f"{path} cannot be written: {link} is a link to {os.readlink(link)}, which does not exist; "
            "create that, or choose another place."
        )


@contextlib.contextmanager
def reading(path: Path, kind: str, mend: str = "") -> Iterator[None]:
    """Turn whatever a parser raises about the content of `path` into a FileError that ends with `mend`."""
    try:
        yield
    except CaromError:
        raise
    except PARSE_ERRORS as error:
        raise FileError(
            f"{path} is not a readable {kind} file ({reason(error)}): "
            f"it is truncated, damaged or was not written by Carom{mend and f'; {mend}'}."
        ) from error


@contextlib.contextmanager
def writing(path: Path, kinds: tuple[type[Exception], ...] = (OSError, RuntimeError)) -> Iterator[None]:
    """Turn a failed write into one FileError; h5py reports some failed flushes as RuntimeError."""
    try:
        yield
    except CaromError:
        raise
    except kinds as error:
        refuse_dangling(path)
        raise FileError(
            f"{path} cannot be written: {reason(error)}; free some space or choose another folder."
        ) from error


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait until the body is done, so that they cut no frame in two."""
    # Only the main thread receives signals, and only a handler that Python installed can be restored.
    main = threading.current_thread() is threading.main_thread()
    known = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM) if main}
    handlers = {number: handler for number, handler in known.items() if callable(handler)}
    received: list[tuple[int, FrameType | None]] = []
    for number in handlers:
        signal.signal(number, lambda *arguments: received.append(arguments))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for first, frame in received[:1]:
            handlers[signal.Signals(first)](first, frame)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, which takes the place of ``path`` once it is complete."""
    with replacing(path) as temporary, writing(path):
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`, which it replaces only once complete and on the disk.

    Carom's errors about the temporary file name `path`.
    """
    path = writable(path)
    # The suffix stays last, because it chooses the format.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        with writing(path, (OSError,)):  # any other error of the body is its own
            yield temporary
        with writing(path):
            _synchronize(temporary)
            os.replace(temporary, path)
            _synchronize(path.parent)
    except CaromError as error:
        error.args = tuple(str(part).replace(str(temporary), str(path)) for part in error.args)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def sweep(folder: Path, ours: Callable[[str], object]) -> None:
    """Remove the files that :func:`replacing` left in a folder when its process was killed.

    Those are removed that were to replace files whose names are ``ours``.
    """
    for path in folder.iterdir():
        if (found := _REMNANT.fullmatch(path.name)) and ours(found["stem"] + (found["suffix"] or "")):
            path.unlink(missing_ok=True)


_REMNANT = re.compile(r"\.(?P<stem>.+)\.\d+\.tmp(?P<suffix>\.[^.]+)?")


def _synchronize(path: Path) -> None:
    """Ask the system to put a file, or a folder's list of names, on the disk."""
    if os.name == "nt" and path.is_dir():  # Windows opens no folders.
        return
    descriptor = os.open(path, os.O_RDWR if path.is_file() else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
