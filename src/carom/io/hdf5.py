"""HDF5 files written so that a full disk or a kill costs what was not yet flushed, and nothing else.

HDF5 cannot cope with a write that fails: closing the file, or ending the program, then crashes the
interpreter, and what was on the disk may be lost. So HDF5 writes into memory here, where nothing fails, and
each flush copies that to the disk: first what lies beyond the end of the file, which is where a full disk
shows and can be undone by cutting it off again; then the few overwritten bytes that make it part of the file.
"""

from __future__ import annotations

import contextlib
import io
import os
import weakref
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import h5py


class _Staged(io.RawIOBase):
    """A file as HDF5 sees it: the file on the disk, under all that was written since the last commit."""

    def __init__(self, path: Path, mode: str):
        super().__init__()
        self._disk = path.open("w+b" if mode == "w" else "r+b", buffering=0)
        self._size = self._disk_size = self._disk.seek(0, os.SEEK_END)
        self._at = 0
        self._pending: list[tuple[int, bytes]] = []
        self._failed = False

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
        view[:count] = bytes(count)
        if start < self._disk_size:
            self._disk.seek(start)
            content = self._disk.read(count)
            view[: len(content)] = content
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
        """Bring all that is pending to the disk.

        Raises
        ------
        OSError
            If that fails; the file on the disk is then as the last commit left it, and stays so.
        """
        if self._failed:
            raise OSError("an earlier write to it failed")
        old = self._disk_size
        inside: list[tuple[int, bytes]] = []
        try:
            for offset, data in self._pending:
                cut = max(0, old - offset)
                if data[:cut]:
                    inside.append((offset, data[:cut]))
                if data[cut:]:
                    self._put(max(offset, old), data[cut:])
            if self._size > old:
                self._disk.truncate(self._size)
        except OSError:
            self._failed = True
            with contextlib.suppress(OSError):
                self._disk.truncate(old)
            raise
        try:
            for offset, data in inside:
                self._put(offset, data)
            if self._size < old:
                self._disk.truncate(self._size)
        except OSError:
            self._failed = True
            raise
        self._pending = []
        self._disk_size = self._size

    def _put(self, offset: int, data: bytes) -> None:
        rest = memoryview(data)
        self._disk.seek(offset)
        while rest:
            rest = rest[self._disk.write(rest) :]

    @property
    def failed(self) -> bool:
        return self._failed

    def close(self) -> None:
        self._disk.close()
        super().close()


class Output:
    """An HDF5 file open for writing: ``file`` is its ``h5py.File``.

    It takes no lock, so that others can read it while it grows.

    Parameters
    ----------
    path : Path
        The file.
    mode : {"w", "r+"}
        As h5py has them.
    """

    def __init__(self, path: Path, mode: str):
        import h5py

        self._staged = _Staged(path, mode)
        try:
            self.file = h5py.File(self._staged, mode)
        except BaseException:
            self._staged.close()
            raise
        # HDF5 must not find the file open when the interpreter has gone.
        self._finalizer = weakref.finalize(self, _close, self.file, self._staged)

    def flush(self) -> None:
        """Bring everything to the disk.

        Raises
        ------
        OSError
            If that fails; everything flushed before is still there.
        """
        self.file.flush()
        self._staged.commit()

    def close(self) -> None:
        """Flush, unless a flush has failed already, and close; a second time does nothing."""
        self._finalizer()


class Input:
    """An HDF5 file open for reading: ``file`` is its ``h5py.File``.

    HDF5 opens a file only once in a process and hands later readers what the first one saw, even if the file
    has grown since. Through a Python file it does not notice, so that a Universe of MDAnalysis that is still
    somewhere in memory hides no frame.
    """

    def __init__(self, path: Path):
        import h5py

        disk = path.open("rb", buffering=0)
        try:
            self.file = h5py.File(disk, "r")
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


def _close_input(file: Any, disk: io.FileIO) -> None:
    try:
        file.close()
    finally:
        disk.close()


def _close(file: Any, staged: _Staged) -> None:
    try:
        file.close()
        if not staged.failed:
            staged.commit()
    finally:
        staged.close()
