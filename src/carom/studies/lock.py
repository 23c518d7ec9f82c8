"""A folder of results has one process at a time, which begins with what is whole there."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import filelock

from carom.errors import FileError
from carom.paths import remnants, writing

LOCK = ".lock"
"""Name of the empty file that is locked."""


@contextlib.contextmanager
def owned(path: Path, ours: Callable[[str], object]) -> Iterator[None]:
    """Make a folder, lock it against other processes, and remove what a killed one left incomplete there.

    The files of results are those whose names are ``ours``; the lock ends with the process.
    """
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
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
            for remnant in remnants(path, ours):
                remnant.unlink(missing_ok=True)
        yield
    finally:
        lock.release()
