"""Which process writes a file, and when it changes it: marks that others see and that end with the process.

They are locks (``F_OFD_SETLK`` of Linux) on two bytes far behind the content: while it is open to write, and
while what others may read changes. Without such locks what has just changed counts as being written.
"""

from __future__ import annotations

import contextlib
import os
import struct
import sys
import time
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from carom.errors import FileError

T = TypeVar("T")

_WRITTEN, _CHANGING = 1 << 61, (1 << 61) + 1  # offsets of the two bytes

_JUST = 1.0  # seconds for which a file counts as being written after a change, where there are no locks

_WAIT = 0.2
"""Seconds for which a reader and a writer wait for each other, at most: either may have been stopped."""

_TRIES = 5  # how often a file that is being written is read before that is given up

_OURS: dict[tuple[int, int], int] = {}
"""Device and number of each file that this process writes, and by how many writers."""


class WriteLock:
    """A mark that this process writes a file, which is made if it is missing; its content stays."""

    def __init__(self, path: Path):
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        found = os.fstat(self._descriptor)
        file = found.st_dev, found.st_ino
        if not _lock(self._descriptor, "F_WRLCK", _WRITTEN) and file not in _OURS:
            os.close(self._descriptor)
            raise FileError(
                f"{path} is being written by another process; wait for its end, or choose another file."
            )
        _lock(self._descriptor, "F_RDLCK", _WRITTEN)
        _OURS[file] = _OURS.get(file, 0) + 1
        self._finalizer = weakref.finalize(self, _release, self._descriptor, file)

    @contextlib.contextmanager
    def changing(self) -> Iterator[None]:
        """Let readers wait until the body is done, and wait for those that read now."""
        _await(self._descriptor, "F_WRLCK")
        try:
            yield
        finally:
            _lock(self._descriptor, "F_UNLCK", _CHANGING)

    def close(self) -> None:
        """Take the mark away; a second time does nothing."""
        self._finalizer()


def _release(descriptor: int, file: tuple[int, int]) -> None:
    os.close(descriptor)
    _OURS[file] -= 1
    if not _OURS[file]:
        del _OURS[file]


def under_way(path: Path) -> bool:
    """Return whether a process, this one included, writes a file."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        return _asked(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def steady(path: Path) -> Iterator[None]:
    """Let a writer of a file wait until the body is done."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:  # The body will say so.
        yield
        return
    try:
        _await(descriptor, "F_RDLCK")
        yield
    finally:
        os.close(descriptor)


def patiently(path: Path, read: Callable[[], T]) -> T:
    """Return what ``read`` returns; where it fails while the file is being written, it is called again."""
    for _ in range(_TRIES):
        with steady(path):
            try:
                return read()
            except FileError as error:
                if not under_way(path):
                    raise
                last = error
        time.sleep(_WAIT / _TRIES)
    raise FileError(
        f"{path} is being written, and cannot be read yet ({str(last.__cause__ or last).rstrip('.')}); "
        "try again later."
    ) from last


def _await(descriptor: int, kind: str) -> None:
    """Lock the second byte, or give up after a while."""
    until, wait = time.monotonic() + _WAIT, 1e-4
    while not _lock(descriptor, kind, _CHANGING) and time.monotonic() < until:
        time.sleep(wait)
        wait *= 2.0


def _record(kind: str, byte: int) -> bytes:
    """Return the ``struct flock`` of a lock of one byte."""
    import fcntl

    return struct.pack("hhqqi4x", getattr(fcntl, kind), os.SEEK_SET, byte, 1, 0)


def _control(descriptor: int, command: str, kind: str, byte: int) -> Any:
    """Call fcntl for one byte; raise OSError where there are no locks of open files, laid out as here."""
    if sys.platform != "linux" or struct.calcsize("P") != 8:
        raise OSError("no locks of open files")
    import fcntl

    return fcntl.fcntl(descriptor, getattr(fcntl, command), _record(kind, byte))


def _lock(descriptor: int, kind: str, byte: int) -> bool:
    """Lock or unlock a byte, and return False if others have it; True where there are no such locks."""
    try:
        _control(descriptor, "F_OFD_SETLK", kind, byte)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return True
    return True


def _asked(descriptor: int) -> bool:
    """Return whether a process holds the first byte of an open file."""
    try:
        answer = _control(descriptor, "F_OFD_GETLK", "F_WRLCK", _WRITTEN)
    except OSError:
        return time.time() - os.fstat(descriptor).st_mtime < _JUST
    import fcntl

    return bool(struct.unpack_from("h", answer)[0] != fcntl.F_UNLCK)
