"""Folders of results: each has one kind of them and one process at a time, and files of the user stay."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import filelock

from carom.errors import FileError
from carom.layout import KINDS, SUMMARY, marks_in
from carom.paths import sweep, writing
from carom.texts import typed
from carom.version import __version__

LOCK = ".lock"
"""Name of the empty file that is locked."""

TABLES = {
    "rdf": "r_lo",
    "structure": "k,S",
    "msd": "time,mean_square",
    "order": "r_lo,r_hi,correlation",
    "profile": "x_lo",
    "crystal": "time,solid",
}
"""Tables of quantities of frames, NAME.csv, and by what the first of their columns begin."""

MARK = "# Written by Carom"
"""Beginning of the first line of a TOML file that Carom wrote."""

_LONGEST_HEAD = 1 << 16
"""Bytes within which the table in a file begins."""

_TEXT = re.compile(rb'"(?:\\.|[^"\\])*"')


class ResultFolder:
    """A folder of results, which need not exist yet."""

    kind: ClassVar[str]
    """What it holds, a name in KINDS."""
    files: ClassVar[tuple[str, ...]]
    """Names of its files, in the order in which old ones are removed."""

    def __init__(self, path: Path):
        self.path = path
        self.summary = path / SUMMARY  # the result, written last
        self.checkpoint = path / KINDS[self.kind].marks[0]  # the state to continue from
        self._seen = self._present()

    def _present(self) -> list[tuple[str, int, int]]:
        """Return which state and summary are there, by which one sees that another process wrote them."""
        found = []
        for path in (self.checkpoint, self.summary):
            with contextlib.suppress(OSError, ValueError):  # none, or no name: others say so
                status = path.stat()
                found.append((path.name, status.st_ino, status.st_mtime_ns))
        return found

    def _files(self) -> list[Path]:
        return [self.path / name for name in self.files]

    def finished(self) -> Path:
        """Return the summary, or raise FileError if there is none yet."""
        if not self.summary.is_file():
            raise FileError(
                f"{self.path} holds {self.kind} that is not finished; "
                f"`{typed('carom resume', self.path)}` goes on."
            )
        return self.summary

    def check_free(self, overwrite: bool) -> None:
        """Refuse a folder in which new results cannot begin; no file is changed."""
        there = next((path for path in (self.path, *self.path.absolute().parents) if path.exists()), None)
        with writing(self.path):
            if there is not None and not there.is_dir():
                raise FileError(f"{self.path} cannot be a folder, because {there} is a file; choose another.")
            if there is not None and not os.access(there, os.W_OK | os.X_OK):
                raise FileError(
                    f"{self.path} cannot be written: {there} is not writable; choose another folder."
                )
            found = [path.name for path in self._files() if os.path.lexists(path)]
        refuse_others(self.path, self.kind)
        # A scene file of the user may lie in the folder in which the run is to be.
        scene = KINDS[self.kind].scene
        if (overwrite or found == [scene]) and scene in found and of_the_user(self.path / scene):
            raise FileError(
                f"{self.path / scene} was written or annotated by somebody, and a run there would replace "
                "it; choose another folder with --out, or move the file."
            )
        if found and not overwrite:
            raise FileError(
                f"{self.path} holds {self.kind} already ({found[0]}); go on with "
                f"`{typed('carom resume', self.path)}`, choose another folder with --out, or replace "
                "it with --overwrite."
            )

    def make(self) -> None:
        """Make the folder, unless it is there."""
        with writing(self.path):
            self.path.mkdir(parents=True, exist_ok=True)

    def clear(self, *kept: Path) -> None:
        """Remove older results from the folder, but for absolute paths that are ``kept``."""
        with writing(self.path):
            for path in self._files():
                if path.absolute() not in kept:
                    path.unlink(missing_ok=True)

    @contextlib.contextmanager
    def owned(self, *more: str) -> Iterator[None]:
        """Make the folder, lock it against other processes, and remove what a killed one left incomplete.

        Its files are those of the kind and ``more``; the lock ends with the process.
        """
        self.make()
        # A mark in a file, instead of a lock, would stay after a kill.
        lock = filelock.FileLock(self.path / LOCK, blocking=False, thread_local=False, fallback_to_soft=False)
        try:
            with writing(self.path):
                try:
                    lock.acquire()
                except filelock.Timeout:  # an OSError, which is no fault of the disk
                    raise FileError(
                        f"Another process is running in {self.path}; wait for it or choose another folder."
                    ) from None
                except OSError as error:
                    if error.errno not in (errno.ENOSYS, errno.ENOLCK):  # some network drives have no locks
                        raise
                if self._present() != self._seen:
                    raise FileError(
                        f"Another process was running in {self.path} meanwhile; type the command again, or "
                        "choose another folder."
                    )
                sweep(self.path, {*self.files, *more}.__contains__)
            yield
        finally:
            lock.release()


def refuse_others(folder: Path, kind: str, *beside: str) -> None:
    """Refuse a folder that holds other results than those of a ``kind`` or ``beside``, names in KINDS.

    No file is changed, and the folder need not exist.
    """
    for other, known in KINDS.items():
        if other not in (kind, *beside) and (found := marks_in(folder, known)):
            raise FileError(
                f"{folder} holds {other} already ({found[0]}), and {kind} needs a folder of its own; choose "
                "another one with --out."
            )


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return in words what is asked for now and was not before; nothing where it is the same."""
    names = [name for name in sorted({*before, *now}) if before.get(name) != now.get(name)]
    if "study" in names:  # of which all else is different
        names = ["study"]
    return ", ".join(f"{k} was {_told(before.get(k))} and is {_told(now.get(k))} now" for k in names)


def _told(value: Any) -> str:
    """Return a value as a sentence has it, in at most 60 letters."""
    text = "left out" if value is None else json.dumps(value, sort_keys=True, skipkeys=True, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def check_same(folder: Path, kind: str, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Refuse a folder whose results of a ``kind`` are of other settings than what is asked for now."""
    if found := differences(before, now):
        raise FileError(
            f"{folder} holds the results of another {kind.removeprefix('a ')}: {found}. "
            "Take the old values, or another folder."
        )


def refuse_to_replace(paths: Iterable[Path], kind: str) -> None:
    """Refuse files that are in a new folder of results already, although no results are."""
    for path in paths:
        if os.path.lexists(path):
            raise FileError(
                f"{path} exists already and is not of {kind} there; choose another folder with --out."
            )


def is_table(folder: Path, name: str) -> bool:
    """Return whether the table of a quantity, a name in TABLES, lies in a folder, and Carom wrote it."""
    try:
        with (folder / f"{name}.csv").open("rb") as file:
            lines = file.read(_LONGEST_HEAD).splitlines()
    except OSError:
        return False
    head = next((line for line in lines if not line.startswith(b"#")), b"")
    return head.startswith(TABLES[name].encode())


def title(command: str) -> str:
    """Return the first line of a TOML file that Carom writes, for ``command``."""
    return f"{MARK} {__version__}; `{command}` with this file repeats it."


def of_the_user(path: Path) -> bool:
    """Return whether somebody wrote or annotated a TOML file: Carom writes no comment but the first line."""
    try:
        first, *lines = path.read_bytes().splitlines() or [b""]
    except OSError:
        return os.path.lexists(path)
    return not first.startswith(MARK.encode()) or any(b"#" in _TEXT.sub(b"", line) for line in lines)
