"""Frames, extended XYZ and H5MD for MDAnalysis, with which an import of this module registers two formats.

MDAnalysis stores float32. The doubles are in ``ts.data["positions"]`` and ``ts.data["velocities"]``, (n, d)
arrays. With ``unwrapped=True`` positions do not jump at the faces of the box, as ``EinsteinMSD`` needs them.
MDAnalysis treats every axis as periodic; ``ts.data["periodic"]`` says which axes are.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, ClassVar

import h5py
import numpy as np
from MDAnalysis import Universe
from MDAnalysis.coordinates.base import ReaderBase
from MDAnalysis.coordinates.H5MD import H5MDReader
from MDAnalysis.core.topology import Topology
from MDAnalysis.core.topologyattrs import (
    Atomids,
    Atomnames,
    Atomtypes,
    Masses,
    Radii,
    Resids,
    Resnames,
    Resnums,
    Segids,
)
from MDAnalysis.lib.mdamath import triclinic_box, triclinic_vectors
from MDAnalysis.lib.util import store_init_arguments
from MDAnalysis.topology.base import TopologyReaderBase

from carom.bridges.embedding import cell_of, embed, names_of, parted, require_at_most_three
from carom.errors import InputError
from carom.frame import Frame
from carom.io.extxyz import Index, parse
from carom.io.extxyz_header import dimension_of, in_order, lattice_of, number_of, periodic_axes, vectors
from carom.io.foreign_source import UNENDED
from carom.io.formats import Reader
from carom.io.locks import steady, under_way
from carom.io.trajectory import open_reader
from carom.paths import existing, reading

_NO_IMAGES = (
    "These frames hold no image counts, so that positions cannot be unwrapped; sample with "
    "carom.Tuning(images=True)."
)


_MOVING = ("pos", "velo", "images", "id")
_FIXED = ("pos", "species", "kind", "radius", "masses", "id")
"""Columns of extended XYZ that are read of each frame, and of the first one."""


class _Held:
    """Frames for a reader: MDAnalysis would take a bare list for a list of files."""

    def __init__(self, frames: Reader | Sequence[Frame]):
        self.frames = frames


class _SequenceReader(ReaderBase):
    """Base class of the two readers below: random access to frames."""

    units: ClassVar = {"time": "ps", "length": "Angstrom", "velocity": "Angstrom/ps"}

    @store_init_arguments
    def __init__(self, filename: Any, unwrapped: bool = False, **kwargs: Any):
        super().__init__(filename, **kwargs)
        self._source = filename  # MDAnalysis itself keeps str(filename) only
        self._unwrapped = unwrapped
        self._load()
        self.ts = self._Timestep(self.n_atoms, **self._ts_kwargs)
        self._read_frame(self.n_frames - 1)
        end = self.ts.data.get("time")
        self._read_frame(0)
        if end is not None and self.n_frames > 1:
            # The mean, so that `totaltime` is right where frames are not evenly spaced.
            self.ts.data.setdefault("dt", (end - self.ts.data["time"]) / (self.n_frames - 1))

    def _load(self) -> None:
        """Set ``n_atoms`` and ``n_frames``."""
        raise NotImplementedError

    def _fill(self, frame: int) -> None:
        """Fill the Timestep with frame ``0 <= frame < n_frames``."""
        raise NotImplementedError

    def _place(self, positions: np.ndarray, images: np.ndarray | None, cell: np.ndarray) -> None:
        """Set the positions (n, d) of the Timestep in a cell (d, d), and keep them in double precision."""
        if self._unwrapped:
            if images is None:
                raise InputError(_NO_IMAGES)
            positions = positions + images @ cell
        self.ts.positions = embed(positions)
        self.ts.data["positions"] = positions
        if images is not None:
            self.ts.data["images"] = images

    def _read_frame(self, frame: int) -> Any:
        if not 0 <= frame < self.n_frames:
            raise OSError(f"there is no frame {frame}; this trajectory has {self.n_frames}")
        self._fill(frame)
        self.ts.frame = frame
        return self.ts

    def _read_next_timestep(self, ts: Any = None) -> Any:
        return self._read_frame(self.ts.frame + 1)

    def _reopen(self) -> None:
        self.ts.frame = -1

    def close(self) -> None:
        """Nothing is held open."""


class FramesReader(_SequenceReader):
    """MDAnalysis reader over Frames, in memory or read from a file of Carom as they are asked for."""

    format = "CAROMFRAMES"

    def _load(self) -> None:
        self._frames = self._source.frames
        self.n_frames = len(self._frames)
        self.n_atoms = self._frames[0].n

    def _fill(self, frame: int) -> None:
        source, ts = self._frames[frame], self.ts
        if source.n != self.n_atoms:
            raise InputError(f"Frame {frame} has {source.n} components and frame 0 has {self.n_atoms}.")
        d, cell = source.dimension, cell_of(source)
        self._place(source.positions, source.images, cell[:d, :d])
        ts.velocities = embed(source.velocities)
        ts.dimensions = triclinic_box(*cell) if source.tilt else [*np.diag(cell), 90.0, 90.0, 90.0]
        ts.time = source.time
        ts.data["step"] = source.step
        ts.data["velocities"] = source.velocities
        ts.data["periodic"] = source.periodic


class ExtxyzReader(_SequenceReader):
    """MDAnalysis reader of extended XYZ."""

    format = "EXTXYZ"

    def _load(self) -> None:
        self._path = existing(self.filename)
        with reading(self._path, "extended XYZ"):
            growing = under_way(self._path)
            self._index = Index(self._path)
            # Of a frame that is being written the rest is to come.
            if (self._index.torn and not growing) or not len(self._index):
                raise ValueError(
                    f"it ends inside frame {len(self._index)}" + f": {UNENDED}" * self._index.unended
                )
            _, columns = parse(self._path, 0, self._index.offsets[1], ("id",))
            _, self._ids = in_order(columns, None)
        self.n_frames = len(self._index)
        self.n_atoms = self.parse_n_atoms(self.filename)

    @staticmethod
    def parse_n_atoms(filename: str, **kwargs: Any) -> int:
        """Return the number of components in the first frame."""
        path = existing(filename)
        with reading(path, "extended XYZ"), path.open("rb") as file:
            return int(file.readline())

    def _fill(self, frame: int) -> None:
        ts = self.ts
        with reading(self._path, "extended XYZ"):
            info, columns = parse(
                self._path, self._index.offsets[frame], self._index.offsets[frame + 1], _MOVING
            )
            columns, _ = in_order(columns, self._ids)
            d = dimension_of(info, columns)
            if len(columns["pos"]) != self.n_atoms:
                raise ValueError(
                    f"frame {frame} has {len(columns['pos'])} components and frame 0 has {self.n_atoms}"
                )
            periodic, cell = periodic_axes(info, d), lattice_of(info)
            ts.dimensions = None if cell is None else triclinic_box(*cell)
            images = vectors(columns, "images", d) if "images" in columns else None
            edges_of = np.zeros((d, d)) if cell is None else cell[:d, :d]
            self._place(vectors(columns, "pos", d), images, edges_of)
            ts.data["periodic"] = periodic
            if "velo" in columns:
                ts.data["velocities"] = vectors(columns, "velo", d)
                ts.velocities = embed(ts.data["velocities"])
            if "time" in info:
                ts.time = number_of(info, "time")
            if "step" in info:
                ts.data["step"] = number_of(info, "step", int)


class ExtxyzParser(TopologyReaderBase):
    """MDAnalysis parser of the first frame of extended XYZ: names, and radii and masses where it has them."""

    format = "EXTXYZ"

    def parse(self, **kwargs: Any) -> Topology:
        """Return the Topology."""
        path = existing(self.filename)
        with reading(path, "extended XYZ"):
            index = Index(path, limit=1)
            if not len(index):
                raise ValueError("it holds no whole frame")
            info, columns = parse(path, index.offsets[0], index.offsets[1], _FIXED)
            columns, ids = in_order(columns, None)
            dimension_of(info, columns)
            names = columns.get("species", np.full(len(columns["pos"]), "X"))
            if "kind" in columns and "species_names" in info:
                names = np.array(parted(info["species_names"]))[columns["kind"]]
            radii, masses = (
                vectors(columns, name, 1)[:, 0] if name in columns else None for name in ("radius", "masses")
            )
            return _topology(names, radii, masses, ids)


class H5mdReader(H5MDReader):
    """MDAnalysis's H5MD reader, with the spacing of frames, unwrapped positions, and doubles of Carom."""

    format = "H5MD"
    _same_frames = False

    @store_init_arguments
    def __init__(self, filename: Any, unwrapped: bool = False, **kwargs: Any):
        self._unwrapped = unwrapped
        super().__init__(filename, **kwargs)
        times = self._particle_group.get("position/time")
        if isinstance(times, h5py.Dataset) and len(times.shape) == 1 and len(times) > 1:
            spacing = float(times[-1] - times[0]) / (len(times) - 1)
            if self.convert_units:
                spacing = self.convert_time_from_native(spacing)
            self.ts.data.setdefault("dt", spacing)

    def open_trajectory(self) -> None:
        """Open the file, at a moment at which no run is changing it."""
        with steady(Path(self.filename)) if isinstance(self.filename, str) else nullcontext():
            super().open_trajectory()

    def _read_frame(self, frame: int) -> Any:
        with steady(Path(self.filename)) if isinstance(self.filename, str) else nullcontext():
            return self._read_whole(frame)

    def _read_whole(self, frame: int) -> Any:
        ts = super()._read_frame(frame)
        images = self._images[frame] if self._unwrapped else None
        if images is not None:
            if ts.dimensions is None:
                raise InputError("These frames have no box, so that positions cannot be unwrapped.")
            ts.positions = ts.positions + images @ triclinic_vectors(ts.dimensions).astype(np.float64)
        if "parameters/carom" in self._file:
            self._keep(ts, frame, images)
        return ts

    @property
    def _images(self) -> h5py.Dataset:
        """Image counts (frames, n, 3), which must be those of the positions."""
        group = self._particle_group
        if "image" not in group:
            raise InputError(_NO_IMAGES)
        images, places = group["image"], group["position"]
        if not self._same_frames:
            self._same_frames = len(images["value"]) == len(places["value"]) and all(
                np.array_equal(images[clock], places[clock])
                for clock in {"step", "time"} & {*images} & {*places}
            )
            if not self._same_frames:
                raise InputError(
                    "Image counts have steps of their own; take carom.io.universe(path) instead."
                )
        return images["value"]

    def _keep(self, ts: Any, frame: int, images: np.ndarray | None) -> None:
        """Keep what float32 and MDAnalysis lose of a frame of Carom."""
        group, d = self._particle_group, int(self._file["parameters/carom"].attrs["dimension"])
        positions = group["position/value"][frame]
        if images is not None:
            edges = group["box/edges/value"][frame]
            positions = positions + images @ (np.diag(edges) if edges.ndim == 1 else edges)
        ts.data["positions"] = positions[:, :d]
        ts.data["velocities"] = group["velocity/value"][frame][:, :d]
        ts.data["periodic"] = tuple(bool(kind == b"periodic") for kind in group["box"].attrs["boundary"][:d])


class H5mdParser(TopologyReaderBase):
    """MDAnalysis parser of H5MD: types, radii and masses from files of Carom, numbers from others."""

    format = "H5MD"

    def parse(self, **kwargs: Any) -> Topology:
        """Return the Topology."""
        with h5py.File(self.filename, "r") as file:
            ours = "parameters/carom" in file
        if not ours:
            return Topology(H5mdReader.parse_n_atoms(self.filename), 1, 1)
        with open_reader(Path(self.filename)) as reader:
            return _topology_of(reader[0])


def _topology_of(frame: Frame) -> Topology:
    """Return the Topology of a frame."""
    kinds = np.zeros(frame.n, dtype=np.int64) if frame.species is None else frame.species
    return _topology(np.array(names_of(frame))[kinds], frame.diameters / 2.0, frame.masses)


def _topology(
    names: np.ndarray, radii: np.ndarray | None, masses: np.ndarray | None, ids: np.ndarray | None = None
) -> Topology:
    n = len(names)
    attributes = [
        Atomnames(names.astype(object)),
        Atomtypes(names.astype(object)),
        Atomids(np.arange(1, n + 1) if ids is None else ids),
        Resids(np.array([1])),
        Resnums(np.array([1])),
        Resnames(np.array(["X"], dtype=object)),
        Segids(np.array(["SYSTEM"], dtype=object)),
    ]
    if radii is not None:
        attributes.append(Radii(np.asarray(radii, dtype=np.float64)))
    if masses is not None:
        attributes.append(Masses(np.asarray(masses, dtype=np.float64)))
    return Topology(n, 1, 1, attrs=attributes)


def universe(
    source: str | os.PathLike[str] | Reader | Sequence[Frame] | Frame, *, unwrapped: bool = False
) -> Universe:
    """Return the Universe of :func:`carom.io.universe`."""
    frames: Reader | Sequence[Frame]
    if isinstance(source, Frame):
        frames = [source]
    elif isinstance(source, str | os.PathLike):
        frames = open_reader(Path(source))
    else:
        frames = source
    if len(frames) == 0:
        raise InputError("There are no frames to make a Universe of; expected at least one.")
    first = frames[0]
    require_at_most_three(first.dimension, "MDAnalysis")
    return Universe(
        _topology_of(first),
        _Held(frames),
        format=FramesReader,
        unwrapped=unwrapped,
    )
