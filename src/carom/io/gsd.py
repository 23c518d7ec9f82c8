"""GSD (the format of HOOMD-blue): compact, float32, understood by OVITO, freud and MDAnalysis.

Positions are float32 and centred, as GSD has them: ``-edge / 2 <= x < edge / 2``. That is enough for a
picture or a structure function, and too little to continue a run: spheres in contact overlap by about 1e-7 of
the box.

GSD cannot describe walls: for other programs all axes are periodic. Carom reads its own ``carom/periodic`` in
the log.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote
from warnings import warn

import numpy as np

from carom.bridges.embedding import edges, embed, names_of, plain, require_at_most_three
from carom.errors import CaromWarning, InputError
from carom.frame import Frame
from carom.io.formats import Reader, Writer
from carom.io.paths import reading, replacing, writing
from carom.io.validation import narrowed

if TYPE_CHECKING:
    import gsd.hoomd

_KIND = "GSD"


def _open(path: Path, mode: str) -> gsd.hoomd.HOOMDTrajectory:
    try:
        import gsd.hoomd
    except ImportError:
        raise InputError(
            f"{path} needs the package gsd, which is not installed: pip install 'carom[gsd]'."
        ) from None
    return gsd.hoomd.open(str(path), mode)


def _to_gsd(frame: Frame) -> gsd.hoomd.Frame:
    import gsd.hoomd

    result = gsd.hoomd.Frame()
    result.configuration.step = int(frame.step)
    result.configuration.box = np.array([*edges(frame.box), 0.0, 0.0, 0.0], dtype=np.float32)
    # GSD knows two and three dimensions; a line is drawn in the plane.
    result.configuration.dimensions = max(2, frame.dimension)
    particles = result.particles
    particles.N = frame.n
    particles.types = [plain(name) for name in names_of(frame)]
    particles.typeid = (np.zeros(frame.n) if frame.species is None else frame.species).astype(np.uint32)
    particles.position = embed((frame.positions - 0.5 * np.asarray(frame.box)).astype(np.float32))
    particles.velocity = embed(frame.velocities.astype(np.float32))
    particles.mass = frame.masses.astype(np.float32)
    particles.diameter = frame.diameters.astype(np.float32)
    if frame.images is not None:
        particles.image = embed(frame.images)
    result.log["carom/time"] = np.array([frame.time], dtype=np.float64)
    result.log["carom/dimension"] = np.array([frame.dimension], dtype=np.int64)
    result.log["carom/images"] = np.array([frame.images is not None], dtype=np.uint8)
    result.log["carom/periodic"] = np.array(frame.periodic, dtype=np.uint8)
    if frame.species is not None:
        result.log["carom/species"] = np.array([bool(frame.species_names)], dtype=np.uint8)
    return result


def _to_frame(stored: gsd.hoomd.Frame) -> Frame:
    if "carom/time" not in stored.log:
        raise ValueError("it has no log/carom/time")
    d = int(stored.log["carom/dimension"][0])
    box = np.asarray(stored.configuration.box[:d], dtype=np.float64)
    particles = stored.particles
    positions = particles.position[:, :d].astype(np.float64) + 0.5 * box
    # Rounding to float32 can carry a component onto, or just past, a face.
    positions = np.where(positions < 0.0, 0.0, np.where(positions >= box, 0.0, positions))
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
        images=narrowed(particles.image[:, :d]) if images else None,
        species=particles.typeid.astype(np.int64) if mixture else None,
        species_names=tuple(unquote(name) for name in particles.types) if named else (),
        periodic=tuple(bool(flag) for flag in stored.log.get("carom/periodic", np.ones(d))),
    )


def as_held(frame: Frame) -> Frame:
    """Return a frame with the rounded values that a GSD file stores."""
    return _to_frame(_to_gsd(frame))


class GsdReader(Reader):
    """Reader of the GSD files that Carom writes."""

    def __init__(self, path: Path, *, torn: bool = False):
        # GSD lists a frame when it is complete, so `torn` changes nothing here.
        super().__init__(path)
        with reading(path, _KIND):
            self._file = _open(path, "r")

    def __len__(self) -> int:
        return len(self._file)

    def _read(self, k: int) -> Frame:
        with reading(self.path, _KIND):
            return _to_frame(self._file[k])

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class GsdWriter(Writer):
    """Writer of GSD, flushed after each frame (otherwise only the first survives a kill)."""

    def __init__(self, path: Path, scene: Any = None, *, append: bool = False, keep: int | None = None):
        super().__init__(path, scene)
        if append:
            self._keep(keep)
        with writing(path):
            self._file = _open(path, "r+" if append else "w")

    def _keep(self, keep: int | None) -> None:
        """Drop all but the first `keep` frames."""
        with GsdReader(self.path) as reader:
            keep = self._retain(reader, keep)
            # GSD cannot drop single frames: those to keep are copied unchanged into a new file.
            if keep < len(reader):
                with replacing(self.path) as temporary, writing(temporary), _open(temporary, "w") as kept:
                    kept.extend(reader._file[:keep])

    def _append(self, frame: Frame) -> None:
        require_at_most_three(frame.dimension, "GSD")
        if self._count == 0 and not all(frame.periodic):
            warn(
                f"{self.path}: GSD knows no walls, so that OVITO, freud and MDAnalysis take every axis for "
                "periodic. For OVITO and ASE write .extxyz; for freud use frame.to_freud().",
                CaromWarning,
                stacklevel=4,
            )
        self._file.append(_to_gsd(frame))
        self._file.flush()

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
