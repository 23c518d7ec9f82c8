"""Opening trajectories for reading and writing, and reading frames; the suffix chooses the format."""

from __future__ import annotations

import contextlib
import importlib
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

from carom import checks
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io import checkpoint, events
from carom.io.foreign_source import PACKED
from carom.io.formats import (
    FOREIGN,
    FORMATS,
    SUFFIXES,
    Reader,
    Writer,
    foreign_format_of,
    format_of,
    nameless,
)
from carom.io.locks import under_way
from carom.layout import FRAMES, STATES
from carom.paths import PARSE_ERRORS, existing, writable
from carom.texts import typed


def trajectory_of(path: str | os.PathLike[str]) -> Path:
    """Return the trajectory in a folder of a run or of a packing; a path to a file as it is."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(
            f"A trajectory is named by the path of a file or folder, found {checks.describe(path)}."
        )
    path = Path(path)
    if not path.is_dir():
        return path
    found = next((path / name for name in FRAMES if (path / name).is_file()), None)
    if found is None:
        raise FileError(
            f"{path} is a folder without a trajectory; expected a file, or the folder of a run or packing "
            f"with one of {', '.join(FRAMES)}."
        )
    return found


def _module(path: str | os.PathLike[str]) -> Any:
    """Return the module of the format that a file name asks for, such as :mod:`carom.io.h5md`."""
    return importlib.import_module(f"carom.io.{format_of(path)}")


def open_reader(
    path: str | os.PathLike[str], *, torn: bool = False, diameter: Any = None, box: Any = None
) -> Reader:
    """Open a trajectory, or that of a folder (:func:`carom.open`); ``torn`` leaves a cut last frame out."""
    path = trajectory_of(path)
    form = foreign_format_of(path)
    if form is None:
        raise InputError(
            f"{path} has a name that tells no format; expected one of {', '.join(FOREIGN)}: {nameless(path)}."
        )
    existing(path)
    if path.suffix.lower() in PACKED and not FORMATS[form].text:
        raise FileError(f"{path} is compressed, and {form} is not text; unpack the file first.")
    _refuse_states(path)
    if path.suffix.lower() not in SUFFIXES or _is_foreign(path):
        from carom.io.foreign import ForeignReader

        return ForeignReader(path, form, diameter, box, torn)
    frames: Reader = _module(path).READER(path, torn=torn)  # first of all a file must be whole
    for name, given in (("diameter", diameter), ("box", box)):
        if given is not None:
            frames.close()
            raise InputError(f"{path} was written by Carom and holds its {name}; leave {name} out.")
    return frames


def _refuse_states(path: Path) -> None:
    """Raise FileError for a checkpoint or an event log: their names end as a trajectory's may."""
    if path.suffix.lower() not in (".h5", ".h5md"):
        return
    if checkpoint.is_one(path):
        kind, after = "a checkpoint, the state of a simulation", f"carom.load({str(path)!r}) in Python"
        if path.name in STATES:
            after = f"`{typed('carom resume', path.parent)}`"
        raise FileError(f"{path} is {kind}, and holds no frames; {after} continues it.")
    if events.is_log(path):
        raise FileError(
            f"{path} is an event log, and holds no frames; `{typed('carom view', path)}` replays it."
        )


def _is_foreign(path: Path) -> bool:
    """Tell whether a file of a format that Carom writes is of another program; a damaged one is none."""
    if under_way(path):
        return False
    with contextlib.suppress(InputError, *PARSE_ERRORS):
        return bool(_module(path).is_foreign(path))
    return False


def open_writer(
    path: str | os.PathLike[str], mode: str = "w", scene: Any = None, *, keep: int | None = None
) -> Writer:
    """Open a trajectory for writing; see :func:`carom.open`."""
    writer: Callable[..., Writer] = _module(path).WRITER
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
    path: str | os.PathLike[str],
    mode: str = "r",
    scene: Any = None,
    *,
    keep: int | None = None,
    diameter: float | Mapping[str, float] | None = None,
    box: float | Sequence[float] | None = None,
) -> Reader | Writer:
    """Open the frames of a file, or of the folder of a run or packing; the name chooses the format.

    Parameters
    ----------
    path : str or path
        ``.h5md`` or ``.h5`` (H5MD), ``.extxyz`` or ``.xyz`` (extended XYZ), ``.gsd`` (GSD, float32). To read,
        also the folder of a run or of a packing, and files of other programs: LAMMPS, HOOMD-blue, GROMACS,
        ASE and more (docs/files).
    mode : {"r", "w", "x", "a"}
        Read; write and replace an existing file; write but refuse to replace a file; append.
    scene : Scene, optional
        Scene of the frames. Each frame must have its numbers of particles and dimensions.
    keep : int, optional
        With mode ``"a"``, keep the first `keep` frames and drop later ones. By default all complete frames
        are kept, and an incomplete last frame is dropped; a file without a complete frame is refused, and
        one of which only the last newline is missing.
    diameter : float or mapping of str to float, optional
        Diameter of all particles, or of each species by its name [length], in a file of another program,
        instead of those that it holds. Where it holds none, 1 is the default; 0 stands for points.
    box : float or sequence of float, optional
        Edges of a periodic box [length], for files that hold none; one number is that of a cube.

    Returns
    -------
    Reader or Writer
        Both are context managers.

    Raises
    ------
    FileError
        If the file is missing, truncated, without a box, a folder without a trajectory, holds fewer than
        `keep` frames, cannot be written, or is being written by another process.
    InputError
        If the suffix or the mode is unknown, or the file holds a box and one is given.

    Warns
    -----
    CaromWarning
        For a file of another program: what was assumed, and what was left out.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2))
    >>> sim.write("disks.h5md", every=0.5, count=3)
    3
    >>> with carom.open("disks.h5md") as frames:
    ...     len(frames), frames[-1].time
    (3, 1.5)
    """
    if mode == "r":
        if keep is not None:
            raise InputError(f"keep={keep} goes with mode 'a' alone, and the mode is 'r'.")
        return open_reader(path, diameter=diameter, box=box)
    if diameter is not None or box is not None:
        raise InputError(f"diameter= and box= go with mode 'r' alone, and the mode is {mode!r}.")
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


Diameter = float | Mapping[str, float] | None
Box = float | Sequence[float] | None


@overload
def read(
    path: str | os.PathLike[str], index: int = -1, *, diameter: Diameter = None, box: Box = None
) -> Frame: ...
@overload
def read(
    path: str | os.PathLike[str], index: slice, *, diameter: Diameter = None, box: Box = None
) -> list[Frame]: ...
@overload
def read(
    path: str | os.PathLike[str], index: str, *, diameter: Diameter = None, box: Box = None
) -> Frame | list[Frame]: ...
def read(
    path: str | os.PathLike[str],
    index: int | slice | str = -1,
    *,
    diameter: Diameter = None,
    box: Box = None,
) -> Frame | list[Frame]:
    """Read one frame, by default the last, or a list of them.

    Parameters
    ----------
    path : str or path
        A trajectory, or a folder with one, that :func:`carom.open` reads.
    index : int, slice or str
        A number gives a Frame, a slice (or its text, such as ``":"`` or ``"-10:"``) a list.
    diameter, box : optional
        As for :func:`carom.open`.

    Returns
    -------
    Frame or list of Frame

    Raises
    ------
    FileError
        If the file is missing, truncated or foreign, the folder has no trajectory, or there is no such frame.
    """
    selection = _as_index(index)
    with open_reader(path, diameter=diameter, box=box) as reader:
        return reader[selection] if isinstance(selection, slice) else reader.frame(selection)
