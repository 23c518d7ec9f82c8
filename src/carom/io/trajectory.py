"""Readers and writers of trajectories: what they share, and which format a file name asks for."""

from __future__ import annotations

import contextlib
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, overload

from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io import exports
from carom.io.paths import existing, replacing, uninterrupted, writable, writing
from carom.io.validation import flaw, step_back
from carom.notebook import by_count, watchable

if TYPE_CHECKING:
    import xarray

#: Suffix -> format.
SUFFIXES = {".h5md": "h5md", ".h5": "h5md", ".extxyz": "extxyz", ".xyz": "extxyz", ".gsd": "gsd"}


class Reader(ABC):
    """A trajectory file as a sequence of Frames. A frame is read when it is accessed.

    ``len(reader)``, ``reader[-1]``, ``reader[::2]`` (a list) and ``for frame in reader`` work as for a list.
    """

    def __init__(self, path: Path):
        self.path = path
        self._instants: dict[int, tuple[float, int]] = {}

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def _read(self, k: int) -> Frame:
        """Return frame ``0 <= k < len(self)`` as it stands in the file."""

    def _checked(self, k: int) -> Frame:
        """Return frame ``0 <= k < len(self)``, which is none that Carom would not write."""
        frame = self._read(k)
        wrong = flaw(frame)
        self._instants[k] = frame.time, frame.step
        if wrong is None and k - 1 in self._instants:
            wrong = step_back(frame, *self._instants[k - 1])
        if wrong is not None:
            raise FileError(f"{self.path} is damaged or was not written by Carom: in frame {k} the {wrong}.")
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
            raise IndexError(f"{self.path} holds {len(self)} frames; there is no frame {index}.")
        return self._checked(k)

    def __iter__(self) -> Iterator[Frame]:
        return (self._checked(k) for k in range(len(self)))

    def __reduce__(self) -> tuple[Any, ...]:
        # MDAnalysis sends readers to its workers: a worker opens the file itself.
        return type(self), (self.path,)

    def _repr_html_(self) -> str:
        from carom.notebook import embedded, table

        return embedded(self) or table(str(self.path), [("frames", str(len(self)))])

    def to_xarray(self) -> xarray.Dataset:
        """Return all frames as an ``xarray.Dataset``, in memory.

        Positions, velocities and, where there are image counts, ``unwrapped`` positions have the dimensions
        time, component and axis; species' names are a coordinate of the components.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        from carom.io.bridges import to_xarray

        return to_xarray(list(self))

    def close(self) -> None:  # noqa: B027  (extxyz holds nothing open)
        """Close the file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


class Writer(ABC):
    """A trajectory file open for writing. A frame is complete when ``write`` returns.

    All frames of a file have the same numbers of components and dimensions. Either all or none of them have
    image counts. ``len(writer)`` is the number of frames in the file.
    """

    def __init__(self, path: Path, scene: Any = None):
        self.path = path
        self._count = 0
        self._shape: tuple[int, int] | None = None if scene is None else (scene.n, scene.dimension)
        self._images: bool | None = None
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
        self._images = frame.images is not None
        self._last = frame.time, frame.step

    def _retain(self, reader: Reader, keep: int | None) -> int:
        """Go on after the first `keep` frames, by default all; each is read, so that none is damaged."""
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
        wrong = flaw(frame)
        if wrong is None and self._last is not None:
            wrong = step_back(frame, *self._last)
        if wrong is not None:
            raise InputError(f"The frame's {wrong}; nothing was written.")
        self._check_alike(frame)

    def _check_alike(self, frame: Frame) -> None:
        n, dimension = frame.positions.shape
        if self._shape is not None and self._shape != (n, dimension):
            raise InputError(
                f"{self.path} holds {self._shape[0]} components in {self._shape[1]} dimensions, and this "
                f"frame has {n} in {dimension}; write it to another file."
            )
        if self._images is not None and self._images != (frame.images is not None):
            has, lacks = ("hold", "this one does not") if self._images else ("hold no", "this one does")
            raise InputError(
                f"The frames of {self.path} {has} image counts and {lacks}; write it to another file."
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        # After a failed write closing fails as well; the first error is the one to hear of.
        with contextlib.nullcontext() if error is None else contextlib.suppress(FileError):
            self.close()


def format_of(path: str | os.PathLike[str]) -> str:
    """Return the format that a file name asks for: ``"h5md"``, ``"extxyz"`` or ``"gsd"``.

    Raises
    ------
    InputError
        If the suffix is none of the known ones.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path} has the suffix '{suffix}', which chooses the format; "
            f"expected one of {', '.join(SUFFIXES)}."
            + (" It can be written by convert() alone." if suffix in exports.SUFFIXES else "")
        )
    return SUFFIXES[suffix]


def _classes(path: str | os.PathLike[str]) -> tuple[Callable[..., Reader], Callable[..., Writer]]:
    name = format_of(path)
    if name == "h5md":
        from carom.io.h5md import H5mdReader, H5mdWriter

        return H5mdReader, H5mdWriter
    if name == "extxyz":
        from carom.io.extxyz import ExtxyzReader, ExtxyzWriter

        return ExtxyzReader, ExtxyzWriter
    from carom.io.gsd import GsdReader, GsdWriter

    return GsdReader, GsdWriter


def open_reader(path: str | os.PathLike[str], *, torn: bool = False) -> Reader:
    """Open a trajectory for reading; with ``torn=True`` a last frame cut off by a kill is left out."""
    reader, _ = _classes(path)
    return reader(existing(path), torn=torn)


def open_writer(
    path: str | os.PathLike[str], mode: str = "w", scene: Any = None, *, keep: int | None = None
) -> Writer:
    """Open a trajectory for writing; see :func:`carom.io.open`."""
    _, writer = _classes(path)
    if mode not in ("w", "x", "a"):
        raise InputError(f"The mode is {mode!r}; expected 'r', 'w', 'x' or 'a'.")
    if keep is not None:
        if mode != "a":
            raise InputError(f"keep={keep} goes with mode 'a' alone, and the mode is {mode!r}.")
        if keep < 0:
            raise InputError(f"keep is {keep}; expected the number of frames to keep, 0 or more.")
    path = writable(path)
    if mode == "x" and (path.exists() or path.is_symlink()):
        raise FileError(f"{path} exists already and was left as it is; choose another name or mode 'w'.")
    if mode == "a":
        if path.exists():
            return writer(existing(path), scene, append=True, keep=keep)
        if keep:
            raise FileError(
                f"{path} does not exist, and {keep} frames of it were to be kept; rebuild it first."
            )
    return writer(path, scene)


def open(
    path: str | os.PathLike[str], mode: str = "r", scene: Any = None, *, keep: int | None = None
) -> Reader | Writer:
    """Open a trajectory; the suffix chooses the format.

    Parameters
    ----------
    path : str or path
        ``.h5md`` or ``.h5`` (H5MD), ``.extxyz`` or ``.xyz`` (extended XYZ), ``.gsd`` (GSD, float32).
    mode : {"r", "w", "x", "a"}
        Read; write, replacing an existing file; write, but refuse to replace a file; append.
    scene : Scene, optional
        Scene of the frames. Each frame must have its numbers of components and dimensions.
    keep : int, optional
        With mode ``"a"``: keep the first `keep` frames and drop those after them, as if they had never been
        written. By default all complete frames are kept, and one that a kill cut off is dropped.

    Returns
    -------
    Reader or Writer
        Both are context managers.

    Raises
    ------
    FileError
        If the file is missing, truncated, foreign, a folder, holds fewer than `keep` frames, or cannot be
        written.
    InputError
        If the suffix or the mode is unknown.
    """
    if mode == "r":
        if keep is not None:
            raise InputError(f"keep={keep} goes with mode 'a' alone, and the mode is 'r'.")
        return open_reader(path)
    return open_writer(path, mode, scene, keep=keep)


def _as_index(index: int | slice | str) -> int | slice:
    """Return ``":"``, ``"::10"`` or ``"-1"`` as the slice or number it stands for."""
    if not isinstance(index, str):
        return index
    try:
        if ":" not in index:
            return int(index)
        return slice(*(int(part) if part.strip() else None for part in index.split(":")))
    except (ValueError, TypeError):
        raise InputError(
            f"The index is {index!r}; expected a number or a slice such as ':' or '::10'."
        ) from None


@overload
def read(path: str | os.PathLike[str], index: int = -1) -> Frame: ...
@overload
def read(path: str | os.PathLike[str], index: slice) -> list[Frame]: ...
@overload
def read(path: str | os.PathLike[str], index: str) -> Frame | list[Frame]: ...
def read(path: str | os.PathLike[str], index: int | slice | str = -1) -> Frame | list[Frame]:
    """Read one frame, by default the last, or a list of them.

    Parameters
    ----------
    path : str or path
        A trajectory that :func:`carom.io.open` reads.
    index : int, slice or str
        A number gives a Frame, a slice (or its text, such as ``":"`` or ``"-10:"``) a list.

    Raises
    ------
    FileError
        If the file is missing, truncated, foreign or a folder, or has no such frame.
    """
    selection = _as_index(index)
    with open_reader(path) as reader:
        try:
            return reader[selection]
        except IndexError as error:
            raise FileError(str(error)) from None


@watchable("Converting", by_count)
def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> int:
    """Copy a trajectory into another format, one frame at a time; return the number of frames.

    Parameters
    ----------
    source, target : str or path
        Files whose suffixes choose the formats. The target is written completely or not at all. It may
        also be ``.lammpstrj`` or ``.dump``, ``.data`` (LAMMPS, the last frame), ``.dcd`` or ``.pdb``, which
        are for other programs and cannot be read back.
    overwrite : bool
        Whether an existing target may be replaced.
    progress : callable, optional
        Called as ``progress(done, total)`` after each frame; True shows a bar.

    Raises
    ------
    FileError
        If the source cannot be read, or the target exists or cannot be written.
    InputError
        If the target's format cannot hold the frames.
    """
    suffix = Path(target).suffix.lower()
    exported = suffix in exports.SUFFIXES
    if not exported:
        format_of(target)
    destination = writable(target)
    if not overwrite and (destination.exists() or destination.is_symlink()):
        raise FileError(
            f"{target} exists already and was left as it is; choose another name or allow overwriting."
        )
    with open_reader(source) as reader:
        if not exported:
            return _copy(reader, destination, len(reader), progress)
        if len(reader) == 0:
            raise InputError(f"{source} holds no frames; expected at least one.")
        with replacing(destination) as temporary, writing(temporary):
            exports.export(reader, temporary, suffix, progress)
        return 1 if suffix == ".data" else len(reader)


def rebuild(source: str | os.PathLike[str], target: str | os.PathLike[str], keep: int) -> int:
    """Write `target` anew from the first `keep` frames of `source`, e.g. after a kill destroyed an .h5md.

    The frames equal those of `source` bit for bit (except in GSD, which stores float32). An incomplete last
    frame of `source` is ignored. Returns `keep`.

    Raises
    ------
    FileError
        If `source` holds fewer than `keep` complete frames, or `target` cannot be written.
    """
    format_of(target)
    with open_reader(source, torn=True) as reader:
        if len(reader) < keep:
            raise FileError(f"{source} holds {len(reader)} complete frames, and {keep} were to be kept.")
        return _copy(reader, Path(target), keep, None)


def _copy(reader: Reader, target: Path, count: int, progress: Callable[[int, int], object] | None) -> int:
    with replacing(target) as temporary, open_writer(temporary) as writer:
        for k in range(count):
            writer.write(reader[k])
            if progress is not None:
                progress(k + 1, count)
    return count
