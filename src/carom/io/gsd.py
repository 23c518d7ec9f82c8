"""GSD (the format of HOOMD-blue): compact, float32, understood by OVITO, freud and MDAnalysis.

Positions are in ``-edge / 2 <= x < edge / 2``. float32 cannot continue a run: contacts overlap by 1e-7 of the
box. All axes are periodic, but Carom reads ``carom/periodic`` in the log.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from carom import checks
from carom.bridges.embedding import edges, embed, names_of, plain, require_at_most_three
from carom.errors import warn
from carom.frame import Frame
from carom.io.formats import Reader, Writer
from carom.io.locks import WriteLock, patiently
from carom.io.validation import narrowed
from carom.paths import reading, replacing, writing

if TYPE_CHECKING:
    import gsd.hoomd

_KIND = "GSD"


def hoomd_for(path: Path) -> Any:
    """Return ``gsd.hoomd``; InputError if it is missing."""
    return checks.needed("gsd.hoomd", str(path), "'carom[gsd]'")


def refuse_more_than_there_is(trajectory: gsd.hoomd.HOOMDTrajectory, path: Path, k: int) -> None:
    """Raise ValueError if frame k announces more particles than the file has bytes, as gsd makes room."""
    for frame in (0, k):
        if trajectory.file.chunk_exists(frame=frame, name="particles/N"):
            count = int(trajectory.file.read_chunk(frame=frame, name="particles/N")[0])
            if count > path.stat().st_size:
                raise ValueError(f"frame {frame} announces {count} particles, which the file does not hold")


def _open(path: Path, mode: str) -> gsd.hoomd.HOOMDTrajectory:
    return hoomd_for(path).open(str(path), mode)


def _append(trajectory: gsd.hoomd.HOOMDTrajectory, stored: gsd.hoomd.Frame) -> None:
    """Append a frame; of the first one also defaults, without which OVITO draws spheres with its own."""
    if len(trajectory) == 0:
        for name in ("diameter", "mass"):
            values = getattr(stored.particles, name)
            if (values == 1.0).all():
                trajectory.file.write_chunk(f"particles/{name}", values)
    trajectory.append(stored)


def _to_gsd(frame: Frame) -> gsd.hoomd.Frame:
    import gsd.hoomd

    result = gsd.hoomd.Frame()
    result.configuration.step = int(frame.step)
    result.configuration.box = np.array([*edges(frame.box), frame.tilt or 0.0, 0.0, 0.0], dtype=np.float32)
    # GSD knows two and three dimensions; a line is drawn in the plane.
    result.configuration.dimensions = max(2, frame.dimension)
    particles = result.particles
    particles.N = frame.n
    particles.types = [plain(name) for name in names_of(frame)]
    particles.typeid = (np.zeros(frame.n) if frame.species is None else frame.species).astype(np.uint32)
    particles.position = embed((frame.positions - _middle(frame.box, frame.tilt)).astype(np.float32))
    particles.velocity = embed(frame.velocities.astype(np.float32))
    particles.mass = frame.masses.astype(np.float32)
    particles.diameter = frame.diameters.astype(np.float32)
    if frame.images is not None:
        particles.image = embed(frame.images)
    result.log["carom/time"] = np.array([frame.time], dtype=np.float64)
    result.log["carom/dimension"] = np.array([frame.dimension], dtype=np.int64)
    result.log["carom/images"] = np.array([frame.images is not None], dtype=np.uint8)
    result.log["carom/periodic"] = np.array(frame.periodic, dtype=np.uint8)
    if frame.tilt is not None:
        result.log["carom/tilt"] = np.array([frame.tilt])
    if frame.species is not None:
        result.log["carom/species"] = np.array([bool(frame.species_names)], dtype=np.uint8)
    return result


def _to_frame(stored: gsd.hoomd.Frame) -> Frame:
    if "carom/time" not in stored.log:
        raise ValueError("it has no log/carom/time")
    d = int(stored.log["carom/dimension"][0])
    box = np.asarray(stored.configuration.box[:d], dtype=np.float64)
    particles = stored.particles
    tilt = float(stored.log["carom/tilt"][0]) if "carom/tilt" in stored.log else None
    positions = particles.position[:, :d].astype(np.float64) + _middle(box, tilt)
    if tilt:  # along the axes of the cell
        positions[:, 0] -= tilt * positions[:, 1]
    periodic = np.array(stored.log.get("carom/periodic", np.ones(d)), dtype=bool)
    # Rounding to float32 can carry a component onto, or just past, a face: that of the next image, or a wall.
    beyond = (positions >= box) & periodic
    positions = np.where(beyond, 0.0, np.clip(positions, 0.0, box))
    if tilt:
        positions[:, 0] += tilt * positions[:, 1]
    images = bool(stored.log["carom/images"][0])
    mixture = "carom/species" in stored.log
    if particles.typeid.dtype.kind not in "iu":
        raise ValueError("its typeid are no integers")
    named = mixture and bool(stored.log["carom/species"][0])
    return Frame(
        time=float(stored.log["carom/time"][0]),
        step=int(stored.configuration.step),
        positions=positions,
        velocities=np.ascontiguousarray(particles.velocity[:, :d], dtype=np.float64),
        box=tuple(float(edge) for edge in box),
        diameters=particles.diameter.astype(np.float64),
        masses=particles.mass.astype(np.float64),
        images=narrowed(particles.image[:, :d] + beyond) if images else None,
        species=particles.typeid.astype(np.int64) if mixture else None,
        species_names=tuple(unquote(name) for name in particles.types) if named else (),
        periodic=tuple(periodic.tolist()),
        tilt=tilt,
    )


def _middle(box: np.ndarray, tilt: float | None) -> np.ndarray:
    """Return the middle of a cell, on which GSD centers positions [length]."""
    middle = 0.5 * np.array(box, dtype=np.float64)
    if tilt:
        middle[0] += 0.5 * tilt * box[1]
    return middle


def as_held(frame: Frame) -> Frame:
    """Return a frame with the rounded values that a GSD file stores."""
    return _to_frame(_to_gsd(frame))


def is_foreign(path: Path) -> bool:
    """Tell whether a file holds frames, and the first one is not of Carom."""
    with _open(path, "r") as trajectory:
        return len(trajectory) > 0 and not trajectory.file.chunk_exists(frame=0, name="log/carom/time")


class GsdReader(Reader):
    """Reader of the GSD files that Carom writes."""

    def __init__(self, path: Path, *, torn: bool = False):
        # GSD lists a frame when it is complete, so `torn` changes nothing here.
        super().__init__(path)
        self._file = patiently(path, self._opened)

    def _opened(self) -> gsd.hoomd.HOOMDTrajectory:
        with reading(self.path, _KIND):
            return _open(self.path, "r")

    def __len__(self) -> int:
        return len(self._file)

    def _read(self, k: int) -> Frame:
        def read() -> Frame:
            with reading(self.path, _KIND):
                refuse_more_than_there_is(self._file, self.path, k)
                return _to_frame(self._file[k])

        return patiently(self.path, read)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class GsdWriter(Writer):
    """Writer of GSD, flushed after each frame (otherwise only the first survives a kill)."""

    def __init__(self, path: Path, scene: Any = None, *, append: bool = False, keep: int | None = None):
        super().__init__(path, scene)
        hoomd_for(path)
        self._file: gsd.hoomd.HOOMDTrajectory | None = None
        with writing(path):
            self._write_lock = WriteLock(path)
        try:
            if append and self._keep(keep):
                self._write_lock.close()
                self._write_lock = WriteLock(path)
            with writing(path):
                self._file = _open(path, "r+" if append else "w")
        except BaseException:
            self._write_lock.close()
            raise

    def _keep(self, keep: int | None) -> bool:
        """Drop all but the first `keep` frames; return whether a new file took the place of the old one."""
        with GsdReader(self.path) as reader:
            keep = self._retain(reader, keep)
            # GSD cannot drop single frames: those to keep are copied unchanged into a new file.
            if keep == len(reader):
                return False
            with replacing(self.path) as temporary:
                temporary.touch()  # gsd would make it unreadable for others
                with writing(self.path), _open(temporary, "w") as kept:
                    for k in range(keep):
                        _append(kept, reader._file[k])
            return True

    def _append(self, frame: Frame) -> None:
        require_at_most_three(frame.dimension, "GSD")
        if self._count == 0 and not all(frame.periodic):
            warn(
                f"{self.path}: GSD knows no walls, so that OVITO, freud and MDAnalysis take every axis for "
                "periodic. For OVITO and ASE write .extxyz; for freud use frame.to_freud()."
            )
        assert self._file is not None
        with self._write_lock.changing():
            _append(self._file, _to_gsd(frame))
            self._file.flush()

    def _close(self) -> None:
        try:
            if self._file is not None:
                self._file.close()
                self._file = None
        finally:
            self._write_lock.close()


READER, WRITER = GsdReader, GsdWriter
