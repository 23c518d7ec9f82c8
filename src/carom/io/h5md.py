"""H5MD 1.1 (de Buyl, Colberg and Hofling, Comput. Phys. Commun. 185, 1546 (2014)): lossless trajectories.

Layout: ``docs/layouts.md``. For MDAnalysis the group is ``trajectory``, units are "Angstrom" and "ps", and 1
or 2 dimensions are padded to 3 along axes with boundary "none". It refuses more than three.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.bridges.embedding import about_axes, cell_of, edges, embed, joined, parted, periodic
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.formats import Reader, Writer
from carom.io.hdf5 import Input, Output
from carom.io.inspection import missing, put
from carom.io.locks import Claim, patiently, under_way
from carom.paths import reading, reason, writing
from carom.scene.lattices import MOST_DIMENSIONS
from carom.version import __version__

if TYPE_CHECKING:
    import h5py

_KIND = "H5MD"
_LAYOUT = 2  # layout 1 had neither species nor changing diameters
_GROUP = "particles/trajectory"
_LENGTH, _TIME, _VELOCITY = "Angstrom", "ps", "Angstrom ps-1"


class _Store:
    """The data sets of an open file, in the order in which a frame is written."""

    def __init__(self, file: h5py.File):
        group, notes = file[_GROUP], file["parameters/carom"].attrs
        self.columns = {
            "step": _growing(group, "position/step"),
            "time": _growing(group, "position/time"),
            "edges": _growing(group, "box/edges/value"),
            "velocity": _growing(group, "velocity/value"),
        }
        for name in ("image", "angular_velocity", "box/tilt"):
            if name in group:
                self.columns[name] = _growing(group, f"{name}/value")
        # Not `"value" in ...`: on a data set, this compares every element, each in its own call.
        fixed = file.get(f"{_GROUP}/diameter", getclass=True) is not type(file[_GROUP])
        if not fixed:
            self.columns["diameter"] = _growing(group, "diameter/value")
        # Last: MDAnalysis counts positions, which must never be longer than the other data sets.
        self.columns["position"] = _growing(group, "position/value")
        self.dimension = int(notes["dimension"])
        self.n = int(self.columns["position"].shape[1])
        self._check_shapes()
        self.masses = _fixed(group, "mass", "f8", self.n)
        self.diameters = _fixed(group, "diameter", "f8", self.n) if fixed else None
        self.species = _fixed(group, "species", "i4", self.n).astype(np.int64) if "species" in group else None
        self.names = parted(notes["species_names"].decode()) if "species_names" in notes else ()
        self.boundary = tuple(bool(kind == b"periodic") for kind in group["box"].attrs["boundary"])

    def _check_shapes(self) -> None:
        """Raise ValueError unless the data sets are those of the table in ``docs/layouts.md``."""
        if not 1 <= self.dimension <= MOST_DIMENSIONS:
            raise ValueError(f"its dimension is {self.dimension}; expected 1 to {MOST_DIMENSIONS}")
        width = max(3, self.dimension)
        rows = {
            "step": ("i8", ()),
            "time": ("f8", ()),
            "edges": ("f8", (width, width) if "box/tilt" in self.columns else (width,)),
            "box/tilt": ("f8", ()),
            "velocity": ("f8", (self.n, width)),
            "image": ("i4", (self.n, width)),
            "angular_velocity": ("f8", (self.n, 3)),
            "diameter": ("f8", (self.n,)),
            "position": ("f8", (self.n, width)),
        }
        for name, data in self.columns.items():
            kind, shape = rows[name]
            if data.ndim != 1 + len(shape) or data.shape[1:] != shape or not _is(data.dtype, kind):
                raise ValueError(f"its {name} is of the shape {data.shape} and the type {data.dtype}")
            if data.chunks is None:
                raise ValueError(f"its {name} cannot grow")
        lengths = {name: len(data) for name, data in self.columns.items()}
        if min(lengths.values()) < lengths["position"]:
            raise ValueError(f"its data sets differ in length: {lengths}")

    def __len__(self) -> int:
        return len(self.columns["position"])

    def resize(self, count: int) -> None:
        for data in self.columns.values():
            data.resize(count, axis=0)

    def read(self, k: int) -> Frame:
        d, columns = self.dimension, self.columns
        return Frame(
            time=float(columns["time"][k]),
            step=int(columns["step"][k]),
            positions=np.ascontiguousarray(columns["position"][k][:, :d], dtype=np.float64),
            velocities=np.ascontiguousarray(columns["velocity"][k][:, :d], dtype=np.float64),
            box=tuple(float(edge) for edge in self._edges(k)[:d]),
            diameters=np.array(columns["diameter"][k] if self.diameters is None else self.diameters, float),
            masses=self.masses.copy(),
            images=self._images(k),
            species=self.species,
            species_names=self.names,
            periodic=self.boundary[:d],
            spins=self._spins(k),
            tilt=float(columns["box/tilt"][k]) if "box/tilt" in columns else None,
        )

    def _edges(self, k: int) -> np.ndarray:
        edges = self.columns["edges"][k]
        return np.diag(edges) if edges.ndim == 2 else edges

    def _spins(self, k: int) -> np.ndarray | None:
        """Return the spins of frame k: in the plane they turn about the third axis."""
        if "angular_velocity" not in self.columns:
            return None
        about = self.columns["angular_velocity"][k]
        return np.ascontiguousarray(about[:, 2:] if self.dimension == 2 else about, dtype=np.float64)

    def _images(self, k: int) -> np.ndarray | None:
        if "image" not in self.columns:
            return None
        images = self.columns["image"][k][:, : self.dimension]
        if images.min() == missing(np.int32):
            raise ValueError(f"the image counts of frame {k} are lost")
        return np.ascontiguousarray(images, dtype=np.int32)


def _is(dtype: np.dtype, kind: str) -> bool:
    """Tell whether a type is `kind`, in any order of bytes."""
    return bool(dtype.newbyteorder("=") == np.dtype(kind))


def _growing(group: h5py.Group, name: str) -> h5py.Dataset:
    """Return a data set that grows, of which HDF5 keeps one chunk in memory, not 8 MiB that nobody reads."""
    import h5py

    data = group[name]
    chunk = math.prod(data.chunks or ()) * data.dtype.itemsize
    access = h5py.h5p.create(h5py.h5p.DATASET_ACCESS)
    slots, most, preference = access.get_chunk_cache()
    access.set_chunk_cache(slots, min(chunk, most), preference)
    del data  # HDF5 takes the size of the cache when a data set is opened for the first time
    return h5py.Dataset(h5py.h5d.open(group.id, name.encode(), access))


def _fixed(group: h5py.Group, name: str, kind: str, n: int) -> np.ndarray:
    """Return the n values of a data set that is fixed in time."""
    data = group[name]
    if data.shape != (n,) or not _is(data.dtype, kind):
        raise ValueError(f"its {name} is of the shape {data.shape} and the type {data.dtype}")
    return data[:].astype(kind, copy=False)


def _header(file: h5py.File) -> None:
    h5md = file.create_group("h5md")
    h5md.attrs["version"] = np.array([1, 1], dtype=np.int32)
    h5md.create_group("author").attrs["name"] = np.bytes_("unknown")
    creator = h5md.create_group("creator")
    creator.attrs["name"] = np.bytes_("carom")
    creator.attrs["version"] = np.bytes_(__version__)
    h5md.create_group("modules/units").attrs["version"] = np.array([1, 0], dtype=np.int32)
    file.create_group("parameters/carom").attrs["layout"] = np.int64(_LAYOUT)


def _create(file: h5py.File, frame: Frame) -> _Store:
    """Lay out the empty data sets for frames like `frame`."""
    n, width = frame.n, max(3, frame.dimension)
    file["parameters/carom"].attrs["dimension"] = np.int64(frame.dimension)
    group = file.create_group(_GROUP)

    def grow(
        parent: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, unit: str | None, rows: int
    ) -> None:
        data = parent.create_dataset(
            name,
            shape=(0, *shape),
            maxshape=(None, *shape),
            chunks=(rows, *shape),
            dtype=dtype,
            fletcher32=True,
            fillvalue=missing(dtype),
        )
        if unit is not None:
            # A str of variable length, because MDAnalysis compares it with a str.
            data.attrs["unit"] = unit

    position = group.create_group("position")
    grow(position, "step", (), np.int64, None, 512)
    grow(position, "time", (), np.float64, _TIME, 512)
    grow(position, "value", (n, width), np.float64, _LENGTH, 1)
    grow(group.create_group("velocity"), "value", (n, width), np.float64, _VELOCITY, 1)
    box = group.create_group("box")
    box.attrs["dimension"] = np.int32(width)
    box.attrs["boundary"] = np.array(
        [b"periodic" if flag else b"none" for flag in periodic(frame.periodic)], dtype="S8"
    )
    sheared = frame.tilt is not None
    grow(
        box.create_group("edges"), "value", (width, width) if sheared else (width,), np.float64, _LENGTH, 512
    )
    names = ["velocity", "box/edges"]
    if sheared:
        grow(box.create_group("tilt"), "value", (), np.float64, None, 512)
        names.append("box/tilt")
    if frame.images is not None:
        grow(group.create_group("image"), "value", (n, width), np.int32, None, 1)
        names.append("image")
    if frame.spins is not None:
        grow(group.create_group("angular_velocity"), "value", (n, 3), np.float64, "ps-1", 1)
        names.append("angular_velocity")
    for name in names:  # hard links: one step and one time for all
        group[name]["step"], group[name]["time"] = position["step"], position["time"]
    for name, values, unit in (("mass", frame.masses, None), ("diameter", frame.diameters, _LENGTH)):
        data = put(group, name, np.asarray(values, dtype=np.float64))
        if unit is not None:
            data.attrs["unit"] = unit
    if frame.species is not None:
        put(group, "species", np.asarray(frame.species, dtype=np.int32))
        if frame.species_names:
            file["parameters/carom"].attrs["species_names"] = np.bytes_(joined(frame.species_names))
    return _Store(file)


def _in_time(file: h5py.File, count: int) -> _Store:
    """Replace fixed diameters by a data set that grows; its first `count` rows hold the fixed ones."""
    group = file[_GROUP]
    fixed = group["diameter"][:]
    del group["diameter"]
    moving = group.create_group("diameter")
    shape = (count, len(fixed))
    data = moving.create_dataset(
        "value",
        shape=shape,
        maxshape=(None, shape[1]),
        chunks=(1, shape[1]),
        dtype=np.float64,
        fletcher32=True,
        fillvalue=missing(np.float64),
    )
    data.attrs["unit"] = _LENGTH
    data[:] = fixed
    moving["step"], moving["time"] = group["position/step"], group["position/time"]
    return _Store(file)


def _find_store(file: h5py.File) -> _Store | None:
    """Return the data sets of a file that Carom wrote, or None if no frame was ever written to it."""
    if "h5md" not in file or "parameters/carom" not in file:
        raise ValueError("it has no parameters/carom")
    layout = int(file["parameters/carom"].attrs["layout"])
    if layout > _LAYOUT:
        raise ValueError(f"its layout is {layout}, newer than the {_LAYOUT} that carom {__version__} knows")
    return _Store(file) if _GROUP in file else None


def is_foreign(path: Path) -> bool:
    """Tell whether a file holds particles, and nothing of Carom."""
    with Input(path) as file:
        return "particles" in file and "parameters/carom" not in file


class H5mdReader(Reader):
    """Reader of the H5MD files that Carom writes."""

    def __init__(self, path: Path, *, torn: bool = False):
        # A frame that a kill cut off is never counted (see _Store), so `torn` changes nothing here.
        super().__init__(path)
        self._input, self._store = patiently(path, self._opened)

    def _opened(self) -> tuple[Input, _Store | None]:
        with reading(self.path, _KIND):
            source = Input(self.path)
            try:
                return source, _find_store(source.file)
            except BaseException:
                source.close()
                raise

    def __len__(self) -> int:
        return 0 if self._store is None else len(self._store)

    def _read(self, k: int) -> Frame:
        def read() -> Frame:
            assert self._store is not None
            try:
                with reading(self.path, _KIND):
                    return self._store.read(k)
            except FileError:
                if under_way(self.path):  # Where its parts lie may have changed.
                    self._input.close()
                    self._input, self._store = self._opened()
                raise

        return patiently(self.path, read)

    def close(self) -> None:
        """Close the file."""
        self._input.close()


class H5mdWriter(Writer):
    """Writer of H5MD, flushed after each frame so that a kill leaves a file that opens."""

    def __init__(self, path: Path, scene: Any = None, *, append: bool = False, keep: int | None = None):
        super().__init__(path, scene)
        self._store: _Store | None = None
        if append:
            self._reopen(keep)
            return
        with writing(path):
            self._output = Output(path, "w")
            _header(self._output.file)
            self._output.flush()

    def _reopen(self, keep: int | None) -> None:
        """Open the file for appending, and drop all but the first `keep` frames."""
        with writing(self.path):
            Claim(self.path).close()
        try:
            with H5mdReader(self.path) as reader:
                keep = self._retain(reader, keep)
            with reading(self.path, _KIND):
                self._output = Output(self.path, "r+")
        except FileError as error:
            raise FileError(
                f"{self.path} cannot be opened for appending ({reason(error.__cause__ or error)}); "
                "if a kill destroyed it, carom.io.rebuild(source, target, keep) makes it anew from the "
                ".extxyz beside it."
            ) from error
        try:
            with writing(self.path):
                if keep:
                    self._store = _Store(self._output.file)
                    self._store.resize(keep)
                elif _GROUP in self._output.file:
                    del self._output.file[_GROUP]
                self._output.flush()
        except BaseException:
            self._output.close()
            raise

    def _append(self, frame: Frame) -> None:
        if self._store is None:
            self._store = _create(self._output.file, frame)
        k = self._count
        facts: tuple[tuple[str, Any, Any], ...] = (
            ("masses", self._store.masses, frame.masses),
            ("species", self._store.species, frame.species),
            ("species_names", self._store.names, frame.species_names),
            ("periodic axes", self._store.boundary[: frame.dimension], frame.periodic),
        )
        for name, kept, found in facts:
            if not np.array_equal(kept, found):
                raise InputError(
                    f"The frame's {name} differ from those of {self.path}, where they are fixed in time; "
                    "write .extxyz, which holds them for each frame."
                )
        fixed = self._store.diameters
        if fixed is not None and not np.array_equal(fixed, frame.diameters):
            self._store = _in_time(self._output.file, k)
        store = self._store
        padded = embed if frame.dimension < 3 else np.asarray
        row: dict[str, Any] = {
            "step": frame.step,
            "time": frame.time,
            "edges": edges(frame.box) if frame.tilt is None else cell_of(frame),
            "velocity": padded(frame.velocities),
            "position": padded(frame.positions),
        }
        if frame.images is not None:
            row["image"] = padded(frame.images)
        if frame.tilt is not None:
            row["box/tilt"] = frame.tilt
        if frame.spins is not None:
            row["angular_velocity"] = about_axes(frame.spins)
        row["diameter"] = frame.diameters
        for name, data in store.columns.items():
            data.resize(k + 1, axis=0)
            data[k] = row[name]
        self._output.flush()

    def _close(self) -> None:
        self._output.close()
