"""Frames from the files of other programs: what a file lacks is assumed, and one sentence says so."""

from __future__ import annotations

import importlib
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.configuration import MOST_SPECIES
from carom.errors import CaromError, FileError, InputError, warn
from carom.frame import Frame
from carom.io.ase import wrapped
from carom.io.foreign_source import thin
from carom.io.formats import FORMATS, Reader
from carom.io.validation import narrowed
from carom.paths import reason
from carom.texts import counted

if TYPE_CHECKING:
    from carom.io.foreign_source import RawFrame, Source

_SAID = {
    r"could not convert string (?:to float: )?(.*?)(?: to float64.*)?$": r"\1 where a number was expected",
    r".*inhomogeneous.*": "its lines differ in their number of words",
}
"""What NumPy says of text, and what it means."""

Diameter = float | Mapping[str, float]


class ForeignReader(Reader):
    """Reader of another program's file: one CaromWarning says what was assumed, and what else it holds.

    ``form`` is one of ``FORMATS``. ``diameter``, of all or by species [length], replaces that of the file;
    ``box`` has periodic edges for files without. With ``torn`` a last frame that cannot be read is left out.
    """

    foreign = True
    _sheared = False
    _stranger = "cannot be used"

    def __init__(
        self,
        path: Path,
        form: str,
        diameter: Diameter | None = None,
        box: float | Sequence[float] | None = None,
        torn: bool = False,
    ):
        super().__init__(path)
        self._form, self._given, self._torn = form, (diameter, box), torn
        self._cube = isinstance(box, int | float)
        edges = [box] * 3 if self._cube else box
        self._box = None if edges is None else checks.array(edges, "box", "(d,)", ndim=1)
        if self._box is not None and not (1 <= len(self._box) <= 3 and (self._box > 0.0).all()):
            raise InputError(f"box is {self._box.tolist()}; expected one to three edges > 0.")
        if diameter is not None and not isinstance(diameter, Mapping):
            checks.number(diameter, "diameter", low=0.0)
        self._diameter = diameter
        with self._understood():
            module, name = FORMATS[form].reader.split(".")
            self._source: Source = getattr(importlib.import_module(f"carom.io.{module}"), name)(path)
        try:
            with self._understood():
                self._count = len(self._source)
                if not self._count:
                    raise ValueError(self._source.cut or "it holds no frames")
                first = self._source.read(0)
                self._names = _names(first)
                self._ids = first.ids
                said = self._begin(first)
        except BaseException:
            self._source.close()
            raise
        if said:
            warn(f"{path} ({form}): {'; '.join(said)}.")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.path, self._form, *self._given, self._torn)

    def __len__(self) -> int:
        return self._count

    def _way_out(self, k: int) -> str:
        if not k:
            return ""
        given = {"diameter": self._diameter, "box": None if self._box is None else self._box.tolist()}
        words = "".join(f", {name}={value!r}" for name, value in given.items() if value is not None)
        return (
            f"; carom.io.rebuild({str(self.path)!r}, 'whole.h5md', keep={k}{words}) copies the "
            f"{counted(k, 'frame')} before"
        )

    @contextmanager
    def _understood(self, k: int = 0) -> Iterator[None]:
        """Turn whatever a library raises about frame k into one FileError."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                yield
        except FileError as error:
            raise FileError(f"{str(error).removesuffix('.')}{self._way_out(k)}.") from error
        except (CaromError, MemoryError):
            raise
        except Exception as error:  # of four libraries
            why = reason(error)
            for theirs, ours in _SAID.items():
                why = re.sub(theirs, ours, why)
            raise FileError(
                f"{self.path} cannot be read as {self._form} ({why}): it is cut off, damaged, or "
                f"of another format{self._way_out(k)}."
            ) from error

    def _begin(self, first: RawFrame) -> list[str]:
        """Decide on dimension, diameters and box by the first frame; return what was assumed."""
        assumed: list[str] = []
        if isinstance(self._diameter, Mapping):
            if missing := {*self._names} - {*self._diameter}:
                missed = ", ".join(sorted(missing))
                raise InputError(f"diameter names no {missed}, of which there are particles.")
        elif self._diameter is None and first.diameters is None:
            assumed.append("a diameter of 1, or 0 to measure (diameter= or --diameter gives another)")
        if first.masses is None:
            assumed.append("a mass of 1")
        boxed = first.cell is not None and np.abs(first.cell).sum(axis=1).all()
        self._dimension = first.dimension or first.positions.shape[1]
        if self._box is not None and boxed:
            raise InputError(f"{self.path} holds a box, and one is given too; leave it out.")
        if self._box is not None and not self._cube:
            self._dimension = min(len(self._box), self._dimension)
        else:
            while (
                first.dimension is None and self._dimension > 1 and self._is_flat(first, self._dimension - 1)
            ):
                self._dimension -= 1
        if first.dimension is None and self._dimension < first.positions.shape[1]:
            assumed.append(f"{self._dimension} dimensions, as the other coordinates are all equal")
        if self._box is None and first.periodic is None:
            assumed.append("every axis periodic")
        self._check_box(first)
        if first.time is None and len(self) > 1:
            assumed.append("times 0, 1, 2 and so on" if first.step is None else "time steps for times")
        last = self._last()
        self._sheared = any(self._check_box(each)[1] for each in (first, last))  # a shear may begin at 0
        #: Whether particles leave the box and are not put back: at the end they fill more than it.
        self._unwrapped = last.unwrapped or (first.images is None and self._strays(last))
        if self._unwrapped and not last.unwrapped:
            assumed.append("unwrapped positions, as they fill more than the box")
        said = [f"assumed {', '.join(assumed)}"] if assumed else []
        moving = [self._moves(each) is not None for each in (first, last)]
        said += [] if all(moving) else ["no velocities in some frames" if any(moving) else "no velocities"]
        said += [f"left out {', '.join(first.dropped)}"] if first.dropped else []
        said += [f"lengths in {self._source.units}"] if self._source.units else []
        return said

    def _last(self) -> RawFrame:
        """Return the last frame; of a torn file the last one that can be read."""
        while True:
            k = self._count - 1
            try:
                if self._source.cut and not self._torn:
                    with self._understood(self._count):
                        raise ValueError(self._source.cut)
                with self._understood(k):
                    last = self._source.read(k)
                    self._check_box(last)
                    return last
            except FileError:
                if not self._torn or k == 0:
                    raise
                self._count = k

    def _is_flat(self, raw: RawFrame, axis: int) -> bool:
        """Tell whether there is one layer along the last axis, and the box has no room for another one."""
        if len(raw.positions) < 2 or not thin(raw.positions[:, : axis + 1], axis):
            return False
        if raw.cell is None or (raw.periodic is not None and not raw.periodic[axis]):
            return True
        return bool(raw.cell[axis, axis] <= self._diameters(raw).max())

    def _diameters(self, raw: RawFrame) -> np.ndarray:
        """Return the diameters (n,): those of the file, those that are given, or 1."""
        n = len(raw.positions)
        if raw.diameters is not None and self._diameter is None:
            return np.array(raw.diameters, dtype=np.float64).reshape(n)
        if isinstance(self._diameter, Mapping):
            kinds = ["X"] * n if raw.kinds is None else np.asarray(raw.kinds).astype(str).tolist()
            return np.array([self._diameter[kind] for kind in kinds], dtype=np.float64)
        return np.full(n, 1.0 if self._diameter is None else self._diameter)

    def _check_box(self, raw: RawFrame) -> tuple[np.ndarray, float | None]:
        """Return edges (d,) and tilt of the box; raise FileError if there is none, or one that is skew."""
        d = self._dimension
        if self._box is not None:
            return self._box[:d], None
        cell = np.zeros((3, 3)) if raw.cell is None else np.array(raw.cell, dtype=np.float64)
        # Libraries compute cells from angles, in single precision.
        cell[np.abs(cell) <= np.finfo(np.float32).eps * np.abs(cell).max()] = 0.0
        edges = np.diag(cell)[:d]
        if not cell[:d].any(axis=1).all():
            raise FileError(
                f"{self.path} holds no box; give its edges, as box={(10,) * d} or --box "
                f"{','.join(['10'] * d)} of `carom measure` and `carom export`, where one number is a cube."
            )
        skew = cell[:d, :d] - np.diag(edges)
        shift = float(skew[1, 0]) if d > 1 else 0.0
        if d > 1:
            skew[1, 0] = 0.0
        if skew.any() or cell[:d, d:].any() or cell[d:, :d].any() or not (edges > 0.0).all():
            raise FileError(
                f"{self.path} has a box with the edges {cell.tolist()}; expected right angles along x, y and "
                "z, or a tilt of y along x alone."
            )
        return edges, shift / float(edges[1]) if shift or self._sheared else None

    def _strays(self, raw: RawFrame) -> bool:
        """Tell whether particles fill more than 1.5 boxes; wrapped ones fill one, molecules a little more."""
        edges, tilt = self._check_box(raw)
        coordinates = self._from_corner(raw)
        coordinates[:, 0] -= (tilt * coordinates[:, 1]) if tilt else 0.0
        spread = np.ptp(coordinates, axis=0) / edges if len(coordinates) else np.zeros(len(edges))
        return bool((spread[self._periodic(raw)] > 1.5).any())

    def _moves(self, raw: RawFrame) -> np.ndarray | None:
        """Return the velocities (n, d), or None where some components are unknown."""
        if raw.velocities is None or np.shape(raw.velocities)[1] < self._dimension:
            return None
        return np.asarray(raw.velocities, dtype=np.float64)[:, : self._dimension]

    def _periodic(self, raw: RawFrame) -> np.ndarray:
        flags = (True,) * 3 if self._box is not None or raw.periodic is None else raw.periodic
        return np.array(flags[: self._dimension])

    def _from_corner(self, raw: RawFrame) -> np.ndarray:
        """Return positions (n, d) from the corner of the box."""
        d = self._dimension
        coordinates = np.asarray(raw.positions, dtype=np.float64)
        if not thin(coordinates, d):
            raise ValueError(f"coordinates beyond the {d} dimensions of the first frame differ")
        if coordinates.shape[1] < d:
            raise ValueError(f"it has {coordinates.shape[1]} coordinates, and the first frame had {d}")
        return coordinates[:, :d] - (0.0 if raw.origin is None else raw.origin[:d])

    def _read(self, k: int) -> Frame:
        with self._understood(k):
            return self._frame(self._source.read(k), k)

    def _frame(self, found: RawFrame, k: int) -> Frame:
        """Return a raw frame as a frame, in the order of its ids."""
        n, d = len(found.positions), self._dimension
        if n == 0:
            raise ValueError(f"frame {k} holds no particles")
        order: Any = slice(None)
        if found.ids is not None:
            order = np.argsort(found.ids)
            if len(np.unique(found.ids)) != n:
                raise ValueError(f"two particles of frame {k} have the same id")
        elif self._ids is not None:
            raise ValueError(f"frame {k} has no column 'id', and the first frame has one")
        edges, tilt = self._check_box(found)
        periodic = self._periodic(found)
        coordinates = self._from_corner(found)
        if not np.isfinite(coordinates).all():  # which no image count can follow
            raise FileError(
                f"{self.path} {self._stranger}: in frame {k} the positions hold NaN or infinite values."
            )
        if tilt:
            coordinates[:, 0] -= tilt * coordinates[:, 1]
        counts = np.zeros((n, d), np.int64)
        if found.images is not None and not self._unwrapped:
            counts += np.asarray(found.images).reshape(n, -1)[:, :d].astype(np.int64)
        positions, images = wrapped(coordinates, np.where(periodic, edges, np.inf), counts)
        walled = np.clip(positions, 0.0, edges)  # single precision rounds what touches a wall
        touches = ~periodic & (np.abs(positions - walled) <= 4.0 * np.finfo(np.float32).eps * edges)
        positions = np.where(touches, walled, positions)
        if tilt:
            positions[:, 0] += tilt * positions[:, 1]
        assert images is not None
        moves = self._moves(found)
        kinds, names = self._species(found)
        return Frame(
            time=float(next(time for time in (found.time, found.step, k) if time is not None)),
            step=0,
            positions=np.ascontiguousarray(positions[order]),
            velocities=np.zeros((n, d)) if moves is None else moves[order],
            box=edges,
            diameters=self._diameters(found)[order],
            masses=np.ones(n)
            if found.masses is None
            else np.array(found.masses, np.float64).reshape(n)[order],
            images=narrowed(images[order]) if self._followed(found) else None,
            species=None if kinds is None else kinds[order],
            species_names=names,
            periodic=tuple(periodic.tolist()),
            tilt=tilt,
            lacks=frozenset(
                name
                for name, known in (
                    ("time", found.time),
                    ("velocities", moves),
                    ("masses", found.masses),
                    ("diameters", found.diameters if self._diameter is None else self._diameter),
                )
                if known is None
            ),
        )

    def _followed(self, found: RawFrame) -> bool:
        """Tell whether the file says how often a particle crossed the box, and which particle that was."""
        known = self._unwrapped or found.images is not None
        if found.ids is None or self._ids is None:
            return known and self._source.ordered
        return known and np.array_equal(np.sort(found.ids), np.sort(self._ids))

    def _species(self, found: RawFrame) -> tuple[np.ndarray | None, tuple[str, ...]]:
        """Return the species of all particles and their names: those of the first frame, then new ones."""
        names = [*self._names, *(name for name in _names(found) if name not in self._names)]
        if not 1 < len(names) <= MOST_SPECIES:
            return None, ()
        number = {name: k for k, name in enumerate(names)}
        return np.array([number[kind] for kind in np.asarray(found.kinds).astype(str).tolist()]), tuple(names)

    def close(self) -> None:
        """Close the file."""
        self._source.close()


def _names(raw: RawFrame) -> list[str]:
    """Return the names of the species that a frame holds, numbers in order of their value."""
    kinds = [] if raw.kinds is None else sorted({*np.asarray(raw.kinds).astype(str).tolist()})
    return sorted(kinds, key=int) if all(kind.isdecimal() for kind in kinds) else kinds
