"""Files of other programs than LAMMPS: XYZ and GRO as text, GSD and H5MD by their libraries.

MDAnalysis reads GRO, too, but stops after the first frame.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.io.extxyz import Index, parse
from carom.io.extxyz_header import ids_of, lattice_of, number_of, periodic_axes, words_of
from carom.io.foreign_source import UNENDED, RawFrame, Source, is_number, text_of, tilted_cell
from carom.io.gsd import hoomd_for, refuse_more_than_there_is
from carom.io.hdf5 import Input
from carom.io.inspection import names, part

if TYPE_CHECKING:
    import h5py

_VELOCITIES = ("velo", "vel", "velocities", "velocity")
_KINDS = ("species", "type", "element")  # columns that tell species apart
_CLOCKS = ("step", "time")
_ELEMENTS = ("position", "velocity", "image", "mass", "species", "id", "diameter", "radius", "box")
_SOMETIMES = ("velocity", "image")  # elements of H5MD that a frame may do without
_ROUNDING = 4.0 * float(np.finfo(np.float32).eps)


class Xyz(Source):
    """XYZ, plain or extended. Lines of plain XYZ may have more than four words."""

    ordered = True

    def __init__(self, path: Path):
        super().__init__(path)
        self._index = Index(path, partly=True)
        self.cut = self._index.wrong
        if self._index.torn:
            self.cut = UNENDED if self._index.unended else f"it ends inside frame {len(self)}"

    def __len__(self) -> int:
        return len(self._index)

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        info, columns = parse(self.path, self._index.offsets[k], self._index.offsets[k + 1])
        columns = {name.lower(): values for name, values in columns.items()}
        if "pos" not in columns:
            raise ValueError("it has no column 'pos'")
        extended = "Properties" in info or "Lattice" in info
        if not extended:  # a sentence, in which a comma or a unit may follow a number
            info = {key: value.rstrip(",;") for key, value in info.items()}
        time = None
        if "time" in info and (extended or is_number(info["time"])):
            time = number_of(info, "time")
        coordinates = columns["pos"].reshape(len(columns["pos"]), -1)
        cell = lattice_of(info)
        origin = [float(word) for word in words_of(info.get("Origin", ""))]
        width = coordinates.shape[1]
        flags = periodic_axes(info, width) if cell is not None or "pbc" in info else None
        radii = next((columns[name] for name in ("radius", "radii") if name in columns), None)
        masses = next((columns[name] for name in ("masses", "mass") if name in columns), None)
        velocities = next((columns[name] for name in _VELOCITIES if name in columns), None)
        used = {"pos", "radius", "radii", "diameter", "masses", "mass", *_VELOCITIES}
        used |= {"momenta", *_KINDS, "id", "images", "kind", "color", "z"}
        numbers = columns.get("z")  # of elements
        if numbers is not None and numbers.dtype.kind != "i":
            numbers = None
        if velocities is None and "momenta" in columns:
            if masses is None:
                masses = _of_elements(numbers, columns.get("species", ["X"] * len(coordinates)))
            velocities = columns["momenta"] / masses[:, None]
        return RawFrame(
            coordinates, cell, np.array(origin) if len(origin) == 3 else None,
            None if flags is None else (*flags, *(False,) * (3 - len(flags))),
            velocities=None if velocities is None else velocities.reshape(len(coordinates), -1),
            diameters=2.0 * radii if radii is not None else columns.get("diameter"),
            masses=masses, images=columns.get("images"), kinds=_kinds(columns, numbers),
            ids=ids_of(columns), time=time, dimension=_said_dimension(info, width) if extended else None,
            dropped=tuple(name for name in columns if name not in used),
        )  # fmt: skip


def _kinds(columns: dict[str, np.ndarray], numbers: np.ndarray | None) -> np.ndarray | None:
    """Return the column that tells most species apart, the first of them in the order of ``_KINDS``."""
    found = [columns[name] for name in _KINDS if name in columns and columns[name].ndim == 1]
    return max(found, key=lambda column: len(np.unique(column)), default=numbers)


def _said_dimension(info: dict[str, str], width: int) -> int | None:
    """Return the dimension that a frame says, or that of fewer than three coordinates."""
    return number_of(info, "dimension", int, width) if "dimension" in info or width < 3 else None


def _of_elements(numbers: np.ndarray | None, symbols: Any) -> np.ndarray:
    """Return the masses that ASE gives to chemical elements, by number or by symbol; others have 1."""
    from ase.data import atomic_masses, atomic_numbers

    if numbers is None:
        numbers = np.array([atomic_numbers.get(str(name), 0) for name in symbols])
    return np.asarray(atomic_masses[numbers])


class _Blocks(Source):
    """Text of frames: line ``count_line`` has the number of particles, and ``around`` lines are of none."""

    ordered = True
    count_line = around = 0
    comment = "\n"

    def __init__(self, path: Path):
        super().__init__(path)
        lines, rest = text_of(path)
        self._lines = [line for line in lines if not line.startswith(self.comment)]
        while self._lines and not self._lines[-1].strip():
            self._lines.pop()
        self._bounds = [0]
        while not self.cut and (at := self._bounds[-1]) < len(self._lines):
            number = "".join(self._lines[at + self.count_line : at + self.count_line + 1]).strip()
            end = at + self.around + (int(number) if number.isdecimal() else 0)
            if at + self.count_line < len(self._lines) and end <= at + self.around:
                self.cut = f"frame {len(self)} has {number!r} for its number of particles"
            elif end > len(self._lines):
                self.cut = (
                    UNENDED if rest and end == len(self._lines) + 1 else f"it ends inside frame {len(self)}"
                )
            else:
                self._bounds.append(end)
        if rest and not rest.startswith(self.comment) and not self.cut:
            self.cut = f"it ends inside frame {len(self)}"

    def __len__(self) -> int:
        return len(self._bounds) - 1

    def _of(self, k: int) -> list[str]:
        """Return the lines of frame k."""
        return self._lines[self._bounds[k] : self._bounds[k + 1]]


class Gro(_Blocks):
    """GRO of GROMACS, also of several frames."""

    units = "nm"
    count_line, around = 1, 3

    def read(self, k: int) -> RawFrame:
        """Return frame k; velocities that only some lines have are none."""
        title, _, *rows, last = self._of(k)
        points = [m for m, letter in enumerate(rows[0]) if letter == "." and m >= 20]
        width = points[1] - points[0]  # as many digits as the writer likes; velocities have one more
        end = 20 + 3 * width
        moving = all(row[end:].strip() for row in rows)
        box = _numbers(last)
        if len(box) not in (3, 9):
            raise ValueError(f"the box of frame {k} is {last.strip()!r}; expected three numbers, or nine")
        cell = np.diag(box[:3])
        if len(box) == 9:
            (cell[0, 1], cell[0, 2], cell[1, 0], cell[1, 2], cell[2, 0], cell[2, 1]) = box[3:]
        time = re.search(r"\bt\s*=\s*(\S+)", title)
        return RawFrame(
            _columns(rows, 20, width, k), cell,
            velocities=_columns(rows, end, points[4] - points[3], k) if moving else None,
            kinds=np.array([row[10:15].strip() for row in rows]),
            time=float(time[1]) if time and is_number(time[1]) else None,
        )  # fmt: skip


def _numbers(line: str) -> list[float]:
    """Return the numbers of a line; those without a blank between have as many decimals as the last one."""
    words = line.split()
    if any(word.count(".") > 1 for word in words):
        words = re.findall(rf"[-+]?\d*\.\d{{{len(words[-1]) - words[-1].rfind('.') - 1}}}", line)
    return [float(word) for word in words]


def _columns(rows: list[str], start: int, width: int, k: int) -> np.ndarray:
    """Return three numbers of a fixed width of each row of frame k."""
    words = [row[m : m + width] for row in rows for m in range(start, start + 3 * width, width)]
    try:
        return np.array(words, dtype=np.float64).reshape(-1, 3)
    except ValueError:
        at = next(at for at, word in enumerate(words) if not is_number(word))
        raise ValueError(f"frame {k} has {words[at]!r} where particle {at // 3 + 1} has a number") from None


class Sph(_Blocks):
    """The format of Smallenburg's EDMD programs: number, box, then letter, position and radius of each.

    Particles that left the box stay where they are (Eur. Phys. J. E 45, 22 (2022)), and so fill more than it.
    Lines that begin with # are comments.
    """

    count_line, around = 0, 2
    comment = "#"

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        _, edges, *rows = self._of(k)
        words = [row.split() for row in rows]
        if {len(row) for row in words} != {5} or len(edges.split()) != 3:
            raise ValueError(f"frame {k} does not have three edges, and five words for each particle")
        box = np.array(edges.split(), dtype=np.float64)
        table = np.array([row[1:] for row in words], dtype=np.float64)
        coordinates = table[:, :3]
        return RawFrame(
            coordinates, np.diag(box), np.zeros(3), (True,) * 3, diameters=2.0 * table[:, 3],
            kinds=np.array([row[0] for row in words]),
            unwrapped=bool((np.ptp(coordinates, axis=0) > (1.0 + _ROUNDING) * box).any()),
        )  # fmt: skip


class Gsd(Source):
    """GSD as HOOMD-blue writes it."""

    ordered = True

    def __init__(self, path: Path):
        super().__init__(path)
        self._file = hoomd_for(path).open(str(path), "r")
        self._held = {*self._file.file.find_matching_chunk_names("particles/")}

    def __len__(self) -> int:
        return len(self._file)

    def _of(self, particles: Any, name: str) -> Any:
        """Return a property, or None if no frame holds it: HOOMD-blue leaves out what has its default."""
        return getattr(particles, name) if f"particles/{name}" in self._held else None

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        refuse_more_than_there_is(self._file, self.path, k)
        stored = self._file[k]
        particles, (lx, ly, lz, xy, xz, yz) = stored.particles, map(float, stored.configuration.box)
        cell = tilted_cell((lx, ly, lz), xy * ly, xz * lz, yz * lz)
        d = int(stored.configuration.dimensions)
        names = np.array(particles.types)
        shapes = [shape.get("diameter") for shape in particles.type_shapes or ()]
        diameters = self._of(particles, "diameter")
        if diameters is None and len(shapes) == len(names) and None not in shapes:
            diameters = np.array(shapes, dtype=np.float64)[particles.typeid]
        return RawFrame(
            particles.position, cell, -0.5 * cell.sum(axis=0), (True,) * 3,
            velocities=self._of(particles, "velocity"), diameters=diameters,
            masses=self._of(particles, "mass"), images=self._of(particles, "image"),
            kinds=names[particles.typeid], step=float(stored.configuration.step), dimension=d,
        )  # fmt: skip

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class H5md(Source):
    """H5MD of other programs: groups of any name, boxes that are fixed or not, what is missing left out."""

    ordered = True

    def __init__(self, path: Path):
        super().__init__(path)
        self._clocks: dict[Any, np.ndarray] = {}
        self._input = Input(path, whole=False)  # others hold what nobody needs
        try:
            groups = self._positions(self._input.file["particles"])
            name = max(groups, key=lambda name: _values(groups[name]).shape[-2])
            self._left = tuple(f"group {other}" for other in groups if other != name)
            self._group, self._coordinates = self._input.file["particles"][name], groups[name]
            self._elements = {each: part(self._group, each, text=each == "species") for each in _ELEMENTS}
            self.units = str(_values(self._coordinates).attrs.get("unit", ""))
        except BaseException:
            self._input.close()
            raise

    def _positions(self, particles: h5py.Group) -> dict[str, Any]:
        """Return the positions of each group that has sound ones."""
        found, wrong = {}, "its group 'particles' has no positions"
        for name in names(particles):
            try:
                group = particles[name]
                if not _is_fixed(group) and (position := part(group, "position")) is not None:
                    found[name] = position
            except ValueError as error:
                wrong = str(error)
        if not found:
            raise ValueError(wrong)
        return found

    def __len__(self) -> int:
        return 1 if _is_fixed(self._coordinates) else len(_values(self._coordinates))

    def _element(self, name: str, k: int, parent: Any = None) -> Any:
        """Return an element at the step of position k, or None; it may be stored at steps of its own."""
        node = (self._elements if parent is None else parent).get(name)
        if node is None or _is_fixed(node):
            return None if node is None else node[()]
        values, own = _values(node), [self._moments(self._coordinates, clock) for clock in _CLOCKS]
        at = [k] if len(values) == len(self) else [0] if len(values) == 1 else []
        for ours, its in zip(own, (self._moments(node, clock) for clock in _CLOCKS), strict=True):
            if ours is not None and its is not None:
                at = np.flatnonzero(np.isclose(its, ours[k], rtol=1e-9, atol=0.0)).tolist()
                at = [k] if k in at else at
                break
        if at or name in _SOMETIMES:
            return values[at[0]] if at else None
        if not len(values) or (values[()] != values[0]).any():  # what is always the same is so between
            raise ValueError(f"it has no {name} at the step of frame {k}")
        return values[0]

    def _moments(self, node: Any, clock: str) -> np.ndarray | None:
        """Return the steps or times (k,) of the frames of an element, which may say an interval, or None."""
        at = None if _is_fixed(node) else node.get(clock)
        if at is None:
            return None
        count = len(_values(node))
        if (at, count) not in self._clocks:
            start = at.attrs.get("offset", 0)
            self._clocks[at, count] = at[()] if at.shape else start + at[()] * np.arange(count)
        return self._clocks[at, count]

    def _clock(self, clock: str, k: int) -> float | None:
        moments = self._moments(self._coordinates, clock)
        return None if moments is None else float(moments[k])

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        coordinates = np.asarray(self._element("position", k), dtype=np.float64)
        width = coordinates.shape[1]
        box, cell, flags, origin = self._elements.get("box"), None, None, None
        if box is not None:
            edges = self._element("edges", k, box)
            if edges is not None:
                cell = _square(np.diag(edges) if np.ndim(edges) == 1 else np.asarray(edges))
            if (boundary := box.attrs.get("boundary")) is not None:
                words = [str(w.decode() if isinstance(w, bytes) else w) for w in np.atleast_1d(boundary)]
                flags = tuple(word == "periodic" for word in words)
            offset = self._element("offset", k, box)
            origin = None if offset is None else np.append(offset, np.zeros(3 - width))
        radii, kinds = self._element("radius", k), self._element("species", k)
        if kinds is not None and kinds.dtype.kind in "SO":
            kinds = np.array(
                [w.decode("utf-8", "replace") if isinstance(w, bytes) else str(w) for w in kinds]
            )
        return RawFrame(
            coordinates, cell, origin, None if flags is None else (*flags, *(False,) * (3 - len(flags))),
            velocities=self._element("velocity", k),
            diameters=2.0 * radii if radii is not None else self._element("diameter", k),
            masses=self._element("mass", k), images=self._element("image", k),
            kinds=kinds, ids=self._element("id", k),
            time=self._clock("time", k), step=self._clock("step", k),
            dimension=width if width < 3 else None,
            dropped=(*self._left, *(name for name in names(self._group) if name not in _ELEMENTS)),
        )  # fmt: skip

    def close(self) -> None:
        """Close the file."""
        self._input.close()


def _is_fixed(node: Any) -> bool:
    """Tell whether an element of H5MD is a data set that is fixed in time, and no group."""
    return hasattr(node, "shape")


def _values(node: Any) -> h5py.Dataset:
    return node if _is_fixed(node) else node["value"]


def _square(cell: np.ndarray) -> np.ndarray:
    """Return a (d, d) cell as (3, 3), with missing edges of 0."""
    result = np.zeros((3, 3))
    result[: len(cell), : len(cell)] = cell
    return result
