"""Trajectories from one format into another, one frame at a time."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from carom import checks
from carom.errors import FileError, InputError, warn
from carom.io import exports
from carom.io.formats import EXPORTED, Reader, format_of
from carom.io.trajectory import open_reader, open_writer, trajectory_of
from carom.notebook import by_count, watchable
from carom.paths import replacing, writable, writing


@watchable("Converting", by_count)
def convert(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    progress: Callable[[int, int], object] | None = None,
    diameter: float | Mapping[str, float] | None = None,
    box: Sequence[float] | None = None,
) -> int:
    """Copy a trajectory into another format, one frame at a time; return the number of frames.

    Parameters
    ----------
    source, target : str or path
        Files whose suffixes choose the formats; the source may be the folder of a run or packing. The target
        is written completely or not at all. It may also be for other programs: ``.lammpstrj``, ``.dump`` and
        ``.data`` (LAMMPS; ``.data`` holds the last frame), ``.dcd`` or ``.pdb``.
    overwrite : bool
        Whether an existing target may be replaced.
    progress : callable, optional
        Called as ``progress(done, total)`` after each frame; True shows a bar.
    diameter, box : optional
        Of a source that holds none, as for :func:`carom.open`.

    Raises
    ------
    FileError
        If the source cannot be read, or the target exists, cannot be written or is the source.
    InputError
        If the target's format cannot hold the frames.

    Warns
    -----
    CaromWarning
        If the target does not hold the times of the frames: PDB has none, DCD one interval.
    """
    source = trajectory_of(source)
    suffix = Path(target).suffix.lower()
    exported = suffix in EXPORTED
    if not exported:
        format_of(target, EXPORTED)
    destination = writable(target)
    if not overwrite and (destination.exists() or destination.is_symlink()):
        raise FileError(
            f"{target} exists already and was left as it is; choose another name or allow overwriting."
        )
    if destination.exists() and source.exists() and destination.samefile(source):
        raise FileError(
            f"{target} is the source itself, and cannot be replaced by its copy; choose another name."
        )
    with open_reader(source, diameter=diameter, box=box) as reader:
        if not exported:
            return _copy(reader, destination, len(reader), progress)
        if len(reader) == 0:
            raise InputError(f"{source} holds no frames; expected at least one.")
        with replacing(destination) as temporary, writing(temporary):
            said = exports.export(reader, temporary, suffix, progress)
        if said:
            warn(f"{target}: {said}.")
        return 1 if suffix == ".data" else len(reader)


def rebuild(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    keep: int,
    *,
    diameter: float | Mapping[str, float] | None = None,
    box: Sequence[float] | None = None,
) -> int:
    """Write `target` from the first `keep` frames of `source`, after a kill for example, and return `keep`.

    The frames equal those of `source` bit for bit (except in GSD, which stores float32). An incomplete last
    frame of `source` is ignored. `diameter` and `box` are those of :func:`carom.open`.

    Raises
    ------
    FileError
        If `source` holds fewer than `keep` complete frames, or `target` cannot be written.
    InputError
        If `keep` is no count.
    """
    format_of(target)
    checks.integer(keep, "keep", low=0)
    with open_reader(source, torn=True, diameter=diameter, box=box) as reader:
        if len(reader) < keep:
            raise FileError(f"{source} holds {len(reader)} complete frames, and {keep} were to be kept.")
        return _copy(reader, Path(target), keep, None)


def _copy(reader: Reader, target: Path, count: int, progress: Callable[[int, int], object] | None) -> int:
    with replacing(target) as temporary, open_writer(temporary) as writer:
        writer.path = target  # which errors name
        for k in range(count):
            writer.write(reader[k])
            if progress is not None:
                progress(k + 1, count)
    return count
