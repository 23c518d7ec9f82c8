"""A folder of results has one process at a time."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import filelock

from carom.errors import FileError
from carom.paths import writing

LOCK = ".lock"
"""Name of the empty file that is locked."""


@contextlib.contextmanager
def owned(path: Path) -> Iterator[None]:
    """Lock a folder against other processes; the lock ends with the process."""
    lock = filelock.FileLock(path / LOCK, blocking=False, thread_local=False)
    try:
        with writing(path):
            try:
                lock.acquire()
            except filelock.Timeout:  # an OSError, which is no fault of the disk
                raise FileError(
                    f"Another process is running in {path}; wait for it or choose another folder."
                ) from None
            except NotImplementedError:  # some network drives have no locks
                pass
        yield
    finally:
        lock.release()
