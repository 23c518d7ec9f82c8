"""H5MD 1.1 (de Buyl, Colberg and Hofling, Comput. Phys. Commun. 185, 1546 (2014)): lossless trajectories.

Layout: ``docs/layouts.md``. For MDAnalysis the group is ``trajectory``, units are "Angstrom" and "ps", and 1
or 2 dimensions are padded to 3 along axes with boundary "none". It refuses more than three.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom.bridges.embedding import about_axes, cell_of, edges, embed, joined, parted, periodic, spins_of
from carom.configuration import MOST_DIMENSIONS
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io.formats import Reader, Writer
from carom.io.hdf5 import Input, Output
from carom.io.inspection import fill_value, growing, names, put
from carom.io.locks import WriteLock, patiently, under_way
from carom.paths import reading, reason, writing
from carom.version import __version__

if TYPE_CHECKING:
    import h5py

_KIND = "H5MD"
_REBUILD = "carom.io.rebuild(source, target, keep) makes it anew from the .extxyz of the same run"
_LAYOUT = 2  # layout 1 had neither species nor changing diameters
_GROUP = "particles/trajectory"
_LENGTH, _TIME, _VELOCITY = "Angstrom", "ps", "Angstrom ps-1"


class _Column(NamedTuple):
    """A data set that grows: where it lies in the group, type and shape of a row, rows of a chunk, unit."""

    at: str
    kind: str
    shape: tuple[int, ...]
    rows: int = 1
    unit: str | None = None


def _layout(n: int, dimension: int, *, sheared: bool) -> dict[str, _Column]:
    """Return the data sets of ``docs/layouts.md`` by name, in the order in which a frame is written."""
    width = max(3, dimension)
    return {
        "step": _Column("position/step", "i8", (), 512),
        "time": _Column("position/time", "f8", (), 512, _TIME),
        "edges": _Column("box/edges/value", "f8", (width, width) if sheared else (width,), 512, _LENGTH),
        "velocity": _Column("velocity/value", "f8", (n, width), unit=_VELOCITY),
        "image": _Column("image/value", "i4", (n, width)),
        "angular_velocity": _Column("angular_velocity/value", "f8", (n, 3), unit="ps-1"),
        "box/tilt": _Column("box/tilt/value", "f8", (), 512),
        "diameter": _Column("diameter/value", "f8", (n,), unit=_LENGTH),
        # Last: MDAnalysis counts positions, which must never be longer than the other data sets.
        "position": _Column("position/value", "f8", (n, width), unit=_LENGTH),
    }


class _Store:
    """The data sets of an open file, in the order in which a frame is written."""

    def __init__(self, file: h5py.File):
        group, notes = file[_GROUP], file["parameters/carom"].attrs
        self.dimension = int(notes["dimension"])
        self.n = int(group["position/value"].shape[1])
        if not 1 <= self.dimension <= MOST_DIMENSIONS:
            raise ValueError(f"its dimension is {self.dimension}; expected 1 to {MOST_DIMENSIONS}")
        # Not `"value" in ...`: on a data set, this compares every element, each in its own call.
        fixed = file.get(f"{_GROUP}/diameter", getclass=True) is not type(file[_GROUP])
        absent = {name for name in ("image", "angular_velocity", "box/tilt") if name not in group}
        absent |= {"diameter"} if fixed else set()
        self.columns: dict[str, h5py.Dataset] = {}
        for name, column in _layout(self.n, self.dimension, sheared="box/tilt" in group).items():
            if name in absent:
                continue
            data = self.columns[name] = _growing(group, column.at)
            if data.shape[1:] != column.shape or not data.shape or not _is(data.dtype, column.kind):
                raise ValueError(f"its {name} is of the shape {data.shape} and the type {data.dtype}")
            if data.chunks is None:
                raise ValueError(f"its {name} cannot grow")
        lengths = {name: len(data) for name, data in self.columns.items()}
        if min(lengths.values()) < lengths["position"]:
            raise ValueError(f"its data sets differ in length: {lengths}")
        self.masses = _fixed(group, "mass", "f8", self.n)
        self.diameters = _fixed(group, "diameter", "f8", self.n) if fixed else None
        self.species = _fixed(group, "species", "i4", self.n).astype(np.int64) if "species" in group else None
        self.names = parted(notes["species_names"].decode()) if "species_names" in notes else ()
        self.boundary = tuple(bool(kind == b"periodic") for kind in group["box"].attrs["boundary"])

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
            spins=spins_of(columns["angular_velocity"][k], d) if "angular_velocity" in columns else None,
            tilt=float(columns["box/tilt"][k]) if "box/tilt" in columns else None,
        )

    def _edges(self, k: int) -> np.ndarray:
        edges = self.columns["edges"][k]
        return np.diag(edges) if edges.ndim == 2 else edges

    def _images(self, k: int) -> np.ndarray | None:
        if "image" not in self.columns:
            return None
        images = self.columns["image"][k][:, : self.dimension]
        if images.min() == fill_value(np.int32):
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
    file["parameters/carom"].attrs["dimension"] = np.int64(frame.dimension)
    group = file.create_group(_GROUP)
    layout = _layout(frame.n, frame.dimension, sheared=frame.tilt is not None)
    extras = {"box/tilt": frame.tilt, "image": frame.images, "angular_velocity": frame.spins}
    linked = ["velocity", "box/edges", *(name for name, values in extras.items() if values is not None)]
    for name in ("step", "time", "position", "velocity", "edges", *linked[2:]):
        if name == "edges":
            box = group.create_group("box")
            box.attrs["dimension"] = np.int32(max(3, frame.dimension))
            box.attrs["boundary"] = np.array(
                [b"periodic" if flag else b"none" for flag in periodic(frame.periodic)], dtype="S8"
            )
        _made(group, layout[name])
    for name in linked:  # hard links: one step and one time for all
        group[name]["step"], group[name]["time"] = group["position/step"], group["position/time"]
    for name, values, unit in (("mass", frame.masses, None), ("diameter", frame.diameters, _LENGTH)):
        data = put(group, name, np.asarray(values, dtype=np.float64))
        if unit is not None:
            data.attrs["unit"] = unit
    if frame.species is not None:
        put(group, "species", np.asarray(frame.species, dtype=np.int32))
        if frame.species_names:
            file["parameters/carom"].attrs["species_names"] = np.bytes_(joined(frame.species_names))
    return _Store(file)


def _made(group: h5py.Group, column: _Column, count: int = 0) -> h5py.Dataset:
    """Make an empty data set, or one of ``count`` rows."""
    data = growing(group, column.at, column.shape, np.dtype(column.kind), column.rows, count)
    if column.unit is not None:
        # A str of variable length, because MDAnalysis compares it with a str.
        data.attrs["unit"] = column.unit
    return data


def _in_time(file: h5py.File, count: int) -> _Store:
    """Replace fixed diameters by a data set that grows; its first `count` rows hold the fixed ones."""
    group = file[_GROUP]
    fixed = group["diameter"][:]
    del group["diameter"]
    layout = _layout(len(fixed), 1, sheared=False)
    data = _made(group, layout["diameter"], count)
    data[:] = fixed
    for clock in ("step", "time"):
        group[f"diameter/{clock}"] = group[f"position/{clock}"]
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
    with Input(path, whole=False) as file:
        known = names(file)
        ours = "parameters" in known and "carom" in file["parameters"].keys()  # noqa: SIM118  (follow no link)
        return "particles" in known and not ours


class H5mdReader(Reader):
    """Reader of the H5MD files that Carom writes."""

    def __init__(self, path: Path, *, torn: bool = False):
        # A frame that a kill cut off is never counted (see _Store), so `torn` changes nothing here.
        super().__init__(path)
        self._input, self._store = patiently(path, self._opened)

    def _opened(self) -> tuple[Input, _Store | None]:
        with reading(self.path, _KIND, _REBUILD):
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
                with reading(self.path, _KIND, _REBUILD):
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
            WriteLock(self.path).close()
        try:
            with H5mdReader(self.path) as reader:
                keep = self._retain(reader, keep)
            with reading(self.path, _KIND, _REBUILD):
                self._output = Output(self.path, "r+")
        except FileError as error:
            raise FileError(
                f"{self.path} cannot be opened for appending ({reason(error.__cause__ or error)}); "
                f"if a kill destroyed it, {_REBUILD}."
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


READER, WRITER = H5mdReader, H5mdWriter
