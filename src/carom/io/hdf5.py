"""HDF5 files that lose only what was not yet flushed, if the disk is full or the process is killed.

A failed write crashes HDF5 and may lose data. So it writes into memory, and a flush has two steps: the new
end is appended with a journal of bytes that will overwrite older ones (undone on a full disk); then these are
overwritten and the journal is cut off. After a kill it completes the file at the next opening.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import struct
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.io.inspection import FORMAT, opened
from carom.io.locks import WriteLock, patiently
from carom.paths import existing, reading, reason

if TYPE_CHECKING:
    import h5py


#: Ends a file in which overwriting may be incomplete; the bytes to write once more are before it.
_JOURNAL = b"carom-journal-01"
_ENTRY = struct.Struct("<QQ")  # offset and number of the bytes that follow
_TRAILER = struct.Struct("<32sQ16s")  # SHA-256 and length of the entries, _JOURNAL


class _Staged(io.RawIOBase):
    """A file as HDF5 sees it: the file on the disk, overlaid with all writes since the last commit."""

    def __init__(self, path: Path, mode: str, write_lock: WriteLock | None = None):
        super().__init__()
        self._write_lock = write_lock
        self._disk = io.FileIO(path, "w+" if mode == "w" else mode)
        self._size = self._disk_size = self._disk.seek(0, os.SEEK_END)
        self._at = 0
        self._pending: list[tuple[int, bytes]] = []
        self._failure: OSError | None = None
        if self._size > _TRAILER.size:
            try:
                self._recover()
            except BaseException:
                self._disk.close()
                raise

    def _recover(self) -> None:
        """Complete a commit that a kill interrupted: on the disk, or in memory if the file is only read."""
        end = self._disk_size - _TRAILER.size
        self._disk.seek(end)
        digest, length, name = _TRAILER.unpack(self._disk.read(_TRAILER.size))
        if name != _JOURNAL or length > end:
            return
        self._disk.seek(end - length)
        entries = self._disk.read(length)
        if hashlib.sha256(entries).digest() != digest:
            return
        self._size = end - length
        at = 0
        while at + _ENTRY.size <= length:
            offset, count = _ENTRY.unpack_from(entries, at)
            at += _ENTRY.size
            data = entries[at : at + count]
            at += count
            if offset + len(data) <= self._size:
                self._pending.append((offset, data))
        if self._write_lock is not None:
            with self._write_lock.changing():
                for offset, data in self._pending:
                    self._put(offset, memoryview(data))
                self._disk.truncate(self._size)
            self._pending, self._disk_size = [], self._size

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def readinto(self, buffer: Any) -> int:
        view = memoryview(buffer).cast("B")
        start, stop = self._at, min(self._at + len(view), self._size)
        count = max(0, stop - start)
        there = max(0, min(stop, self._disk_size) - start)
        if there:
            self._disk.seek(start)
            there = _fill(self._disk, view[:there])
        view[there:count] = bytes(count - there)
        for offset, data in self._pending:
            low, high = max(start, offset), min(stop, offset + len(data))
            if low < high:
                view[low - start : high - start] = data[low - offset : high - offset]
        self._at += count
        return count

    def write(self, data: Any) -> int:
        content = bytes(data)
        self._pending.append((self._at, content))
        self._at += len(content)
        self._size = max(self._size, self._at)
        return len(content)

    def truncate(self, size: int | None = None) -> int:
        size = self._at if size is None else size
        self._pending = [(offset, data[: size - offset]) for offset, data in self._pending if offset < size]
        self._size = size
        return size

    def commit(self) -> None:
        """Write all that is pending: a kill leaves the file as it was, or a journal that completes it."""
        assert self._write_lock is not None
        if self._failure is not None:
            raise OSError(f"an earlier write to it failed ({reason(self._failure)})")
        with self._write_lock.changing():
            self._commit()

    def _commit(self) -> None:
        old = self._disk_size
        inside: list[tuple[int, memoryview]] = []
        try:
            for offset, data in self._pending:
                view = memoryview(data)
                cut = max(0, old - offset)
                if view[:cut]:
                    inside.append((offset, view[:cut]))
                if view[cut:]:
                    self._put(max(offset, old), view[cut:])
            if self._size > old:
                self._disk.truncate(self._size)
            if inside:
                self._put(max(self._size, old), memoryview(_journal(inside)))
        except OSError as error:
            self._failure = error
            with contextlib.suppress(OSError):
                self._disk.truncate(old)
            raise
        try:
            for offset, view in inside:
                self._put(offset, view)
            self._disk.truncate(self._size)
        except OSError as error:
            self._failure = error
            raise
        self._pending = []
        self._disk_size = self._size

    def _put(self, offset: int, rest: memoryview) -> None:
        """Write bytes to the disk at an offset."""
        self._disk.seek(offset)
        while rest:
            rest = rest[self._disk.write(rest) :]

    @property
    def failed(self) -> bool:
        return self._failure is not None

    def close(self) -> None:
        self._disk.close()
        super().close()


class _Patient(io.FileIO):
    """A file of which HDF5 does not hear that a write failed: ``failure`` is the first error, or None."""

    failure: OSError | None = None

    def write(self, data: Any) -> int:
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while rest and self.failure is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failure = error
        return size

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return self.tell() if size is None else size


@contextlib.contextmanager
def made(path: Path, **settings: Any) -> Iterator[h5py.File]:
    """Make an HDF5 file on the disk at once, not in memory; after a failed write it is of no use."""
    import h5py

    with _Patient(path, "w+") as disk:
        try:
            with h5py.File(disk, "w", **settings) as file:
                yield file
        except (OSError, RuntimeError):  # HDF5 may read back what was not written.
            if disk.failure is None:
                raise
        if disk.failure is not None:
            raise disk.failure


class Output:
    """An HDF5 file (``file``) that one process writes, and others can read as it grows."""

    def __init__(self, path: Path, mode: str):
        import h5py

        write_lock = WriteLock(path)
        try:
            self._staged = _Staged(path, mode, write_lock)
            try:
                self.file = (
                    h5py.File(self._staged, "w", libver=FORMAT) if mode == "w" else opened(self._staged, mode)
                )
            except BaseException:
                self._staged.close()
                raise
        except BaseException:
            write_lock.close()
            raise
        # HDF5 must not find the file open after the interpreter has ended.
        self._finalizer = weakref.finalize(self, _close, self.file, self._staged, write_lock)

    def flush(self) -> None:
        """Bring everything to the disk."""
        self.file.flush()
        self._staged.commit()

    def close(self) -> None:
        """Flush, unless a flush has failed already, and close; a second time does nothing."""
        self._finalizer()


class Input:
    """An HDF5 file open for reading: ``file`` is its ``h5py.File``, over a file object of Python.

    HDF5 opens a path once per process: later readers would see what the first one saw. Of a file that is not
    used as a ``whole``, :func:`carom.io.inspection.part` inspects what is.
    """

    def __init__(self, path: Path, *, whole: bool = True):
        disk = _Staged(path, "r")
        try:
            self.file = opened(disk, whole=whole)
        except BaseException:
            disk.close()
            raise
        self._finalizer = weakref.finalize(self, _close_input, self.file, disk)

    def close(self) -> None:
        """Close the file; a second time does nothing."""
        self._finalizer()

    def __enter__(self) -> h5py.File:
        return self.file

    def __exit__(self, *_: object) -> None:
        self.close()


def inspect(path: str | os.PathLike[str]) -> None:
    """Refuse an HDF5 file that is damaged, or refers to content outside of itself."""
    path = existing(path)

    def read() -> None:
        with reading(path, "HDF5"):
            Input(path).close()

    patiently(path, read)


def _fill(file: io.FileIO, view: memoryview) -> int:
    """Read into all of `view`, or up to the end of the file; return the number of bytes."""
    done = 0
    while done < len(view) and (count := file.readinto(view[done:])):
        done += count
    return done


def _journal(inside: list[tuple[int, memoryview]]) -> bytes:
    """Return the journal of overwritten bytes, with a digest that tells whether it is complete."""
    entries = b"".join(_ENTRY.pack(offset, len(view)) + view for offset, view in inside)
    return entries + _TRAILER.pack(hashlib.sha256(entries).digest(), len(entries), _JOURNAL)


def _close_input(file: Any, disk: _Staged) -> None:
    try:
        file.close()
    finally:
        disk.close()


def _close(file: Any, staged: _Staged, write_lock: WriteLock) -> None:
    try:
        file.close()
        if not staged.failed:
            staged.commit()
    finally:
        staged.close()
        write_lock.close()
