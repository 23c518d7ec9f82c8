"""Base classes of readers and writers of trajectories, and the format that a file name asks for."""

from __future__ import annotations

import contextlib
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self, overload

from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.foreign_source import PACKED, opened
from carom.io.validation import flaw, step_back
from carom.paths import existing, reading, uninterrupted, writing
from carom.table import in_html
from carom.texts import counted, typed

if TYPE_CHECKING:
    import xarray

#: Suffix -> format.
SUFFIXES = {".h5md": "h5md", ".h5": "h5md", ".extxyz": "extxyz", ".xyz": "extxyz", ".gsd": "gsd"}


class Foreign(NamedTuple):
    """A format of other programs."""

    reader: str
    """Its class below ``carom.io``, imported when a file of it is opened."""
    names: tuple[str, ...]
    """Suffixes, or starts of names, of its files."""
    text: bool = True


FORMATS = {
    "LAMMPS dump": Foreign("lammps.Dump", (".lammpstrj", ".dump", "dump.")),
    "LAMMPS data": Foreign("lammps.Data", (".data", ".lmp", "data.")),
    "EDMD": Foreign("foreign_formats.Sph", (".sph",)),
    "XYZ": Foreign("foreign_formats.Xyz", (".xyz", ".extxyz")),
    "GSD": Foreign("foreign_formats.Gsd", (".gsd",), text=False),
    "H5MD": Foreign("foreign_formats.H5md", (".h5md", ".h5"), text=False),
    "PDB": Foreign("libraries.Pdb", (".pdb",)),
    "GRO": Foreign("foreign_formats.Gro", (".gro",)),
    "XTC": Foreign("libraries.Xtc", (".xtc",), text=False),
    "TRR": Foreign("libraries.Xtc", (".trr",), text=False),
    "DCD": Foreign("libraries.Dcd", (".dcd",), text=False),
    "ASE trajectory": Foreign("libraries.Traj", (".traj",), text=False),
    "CIF": Foreign("libraries.OfAse", (".cif",)),
    "POSCAR": Foreign("libraries.OfAse", (".vasp", "POSCAR", "CONTCAR")),
    "XDATCAR": Foreign("libraries.OfAse", ("XDATCAR",)),
}
"""What is read from other programs: all that a new format needs besides its class."""

#: Suffix, or start of a name -> format that is read from other programs.
FOREIGN = {name: form for form, known in FORMATS.items() for name in known.names}

#: Suffix -> format of another program that is written by :func:`carom.io.convert`.
EXPORTED = {suffix: FOREIGN[suffix] for suffix in (".lammpstrj", ".dump", ".data", ".dcd", ".pdb")}


class Closing:
    """Base of what is open: a context manager, of whose errors the first one is reported."""

    def close(self) -> None:
        """Close the file; a second time does nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        # After a failed write, closing fails as well.
        with contextlib.nullcontext() if error is None else contextlib.suppress(FileError):
            self.close()


class Reader(Closing, ABC):
    """A trajectory file as a sequence of Frames, as :func:`carom.open` returns it for a ``path``.

    A frame is read when it is accessed. ``len(reader)``, ``reader[-1]``, ``reader[::2]`` (a list) and ``for
    frame in reader`` work as for a list.
    """

    foreign = False
    """Whether another program wrote the file."""

    _stranger = "is damaged or was not written by Carom"

    def __init__(self, path: Path):
        self.path = path
        self._instants: dict[int, tuple[float, int]] = {}

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def _read(self, k: int) -> Frame:
        """Return frame ``0 <= k < len(self)`` as it stands in the file."""

    def _way_out(self, k: int) -> str:
        """Return how to get the frames before frame k, which cannot be read, as the end of a sentence."""
        return ""

    def _checked(self, k: int) -> Frame:
        """Return frame ``0 <= k < len(self)``; raise FileError if Carom would not write such a frame."""
        frame = self._read(k)
        wrong = flaw(frame)
        self._instants[k] = frame.time, frame.step
        if wrong is None and k - 1 in self._instants:
            wrong = step_back(frame, *self._instants[k - 1])
        if wrong is not None:
            raise FileError(f"{self.path} {self._stranger}: in frame {k} the {wrong}{self._way_out(k)}.")
        return frame

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self._checked(k) for k in range(*index.indices(len(self)))]
        k = index + len(self) if index < 0 else index
        if not 0 <= k < len(self):
            raise IndexError(f"{self.path} holds {counted(len(self), 'frame')}; there is no frame {index}.")
        return self._checked(k)

    def frame(self, index: int) -> Frame:
        """Return ``reader[index]``.

        Raises
        ------
        FileError
            If there is no such frame, instead of the IndexError of a list.
        """
        try:
            return self[index]
        except IndexError as error:
            raise FileError(str(error)) from None

    def __iter__(self) -> Iterator[Frame]:
        return (self._checked(k) for k in range(len(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        # MDAnalysis sends readers to its workers; each worker opens the file itself.
        return type(self), (self.path,)

    def __repr__(self) -> str:
        try:
            count = len(self)
            holds = counted(count, "frame")
        except (FileError, OSError, RuntimeError, ValueError):
            holds = "closed"
        return f"<{self.path}: {holds}>"

    def _repr_html_(self) -> str:
        from carom.drawing.page import embedded

        return embedded(self) or in_html(str(self.path), [("frames", str(len(self)))])

    def to_xarray(self) -> xarray.Dataset:
        """Return all frames as an ``xarray.Dataset``, in memory.

        Positions, velocities and, where there are image counts, ``unwrapped`` positions have the dimensions
        time, particle and axis; species' names are a coordinate of the particles.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        from carom.bridges.converters import to_xarray

        return to_xarray(list(self))


class Writer(Closing, ABC):
    """A trajectory file open for writing, as :func:`carom.open` returns it for a ``path`` and a ``scene``.

    A frame is complete when ``write`` returns. All frames of a file have the same numbers of particles and
    dimensions. Either all or none of them have image counts, and spins. ``len(writer)`` is the number of
    frames in the file.
    """

    def __init__(self, path: Path, scene: Any = None):
        self.path = path
        self._count = 0
        self._shape: tuple[int, int] | None = None if scene is None else (scene.n, scene.dimension)
        self._extras: tuple[bool, ...] | None = None
        self._last: tuple[float, int] | None = None

    def __len__(self) -> int:
        return self._count

    def write(self, frame: Frame) -> None:
        """Append `frame` and pass it to the operating system, so that it survives if this process is killed.

        A Ctrl-C takes effect when the frame is complete.

        Raises
        ------
        InputError
            If the frame does not fit the file, is earlier than the last one, or has invalid values: NaN,
            infinite values, masses or edges that are not positive, negative diameters.
        FileError
            If it cannot be written, e.g. because the disk is full.
        """
        self._check(frame)
        with uninterrupted():
            with writing(self.path):
                self._append(frame)
            self._follow(frame)
            self._count += 1

    @abstractmethod
    def _append(self, frame: Frame) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...

    def close(self) -> None:
        """Close the file; a second time does nothing.

        Raises
        ------
        FileError
            If buffered data cannot be written.
        """
        with uninterrupted(), writing(self.path):
            self._close()

    def _follow(self, frame: Frame) -> None:
        """Expect more frames like this one."""
        self._shape = (frame.n, frame.dimension)
        self._extras = tuple(each is not None for each in (frame.images, frame.spins, frame.tilt))
        self._last = frame.time, frame.step

    def _retain(self, reader: Reader, keep: int | None) -> int:
        """Continue after the first `keep` frames, by default all; each is read, which detects damage."""
        count = len(reader)
        keep = count if keep is None else keep
        if keep > count:
            raise FileError(f"{self.path} holds {count} complete frames, and {keep} were to be kept.")
        for k in range(keep):
            frame = reader[k]
            self._check_alike(frame)
            self._follow(frame)
        self._count = keep
        return keep

    def _check(self, frame: Frame) -> None:
        """Raise InputError if a frame is invalid or does not fit the file."""
        wrong = flaw(frame)
        if wrong is None and self._last is not None:
            wrong = step_back(frame, *self._last)
        if wrong is not None:
            raise InputError(f"The frame's {wrong}; nothing was written.")
        self._check_alike(frame)

    def _check_alike(self, frame: Frame) -> None:
        """Raise InputError if a frame differs in kind from those of the file."""
        n, dimension = frame.positions.shape
        if self._shape is not None and self._shape != (n, dimension):
            raise InputError(
                f"{self.path} holds {self._shape[0]} components in {self._shape[1]} dimensions, and this "
                f"frame has {n} in {dimension}; write it to another file."
            )
        for k, (what, found) in enumerate(
            (("image counts", frame.images), ("spins", frame.spins), ("tilts", frame.tilt))
        ):
            if self._extras is not None and self._extras[k] != (found is not None):
                has, lacks = (
                    ("hold", "this one does not") if self._extras[k] else ("hold no", "this one does")
                )
                raise InputError(
                    f"The frames of {self.path} {has} {what} and {lacks}; write it to another file."
                )


_CELL = rb"[^\n]*\n[-+.\d \t]+\r?\n([ \t]*[-+]?\d*\.?\d+){3}"
_BEGINS = {
    "data.": rb"(?s).*\n[ \t]*\d+[ \t]+atoms\b",
    "POSCAR": _CELL,
    "CONTCAR": _CELL,
    "XDATCAR": _CELL,
    "": b"ITEM:",
}
"""Start of a name -> how such a file begins: anything may be called data.csv, and a dump anything at all."""


def foreign_format_of(path: str | os.PathLike[str]) -> str | None:
    """Return the format of a file that another program may have written, by name and beginning, or None."""
    path = Path(path)
    name = path.stem if path.suffix.lower() in PACKED else path.name
    found = FOREIGN.get(Path(name).suffix.lower()) or (FOREIGN.get(name) if name in _BEGINS else None)
    if found is not None:
        return found
    with reading(existing(path), "compressed"), opened(path) as file:
        begin = file.read(4096)
    starts = (start for start, look in _BEGINS.items() if name.startswith(start) and re.match(look, begin))
    start = next(starts, None)
    return None if start is None else FOREIGN[start or "dump."]


def nameless(path: Path) -> str:
    """Return what to do about a file whose name tells no format, as the end of a sentence."""
    named = typed("ln", path, f"{path}.xyz")
    return f"give it a name that tells what it is, such as by `{named}`"


def format_of(path: str | os.PathLike[str], exported: Iterable[str] = ()) -> str:
    """Return the format of a file name: "h5md", "extxyz" or "gsd"; the error names ``exported``, too."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path} has the suffix '{suffix}', which chooses the format; "
            f"expected one of {', '.join([*SUFFIXES, *exported])}."
            + (" Such a file is written by carom export." if suffix in EXPORTED else "")
        )
    return SUFFIXES[suffix]
