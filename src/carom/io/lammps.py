"""Files of LAMMPS: dumps and data files, as its ``dump custom`` (or ``atom``) and ``write_data`` write them.

ASE and MDAnalysis read neither radii nor image counts of a dump, nor dumps whose number of particles
changes. Of a data file they read no diameters.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from carom.io.extxyz_header import integers
from carom.io.foreign_source import (
    UNENDED,
    RawFrame,
    Source,
    is_number,
    line_of,
    opened,
    pass_lines,
    table_of,
    text_of,
    thin,
    tilted_cell,
    vectors,
)
from carom.paths import reason

_WORDS = {"typelabel", "element"}
"""Columns of a dump that hold words; ``type`` may."""
_READ = {
    "id", "type", "typelabel", "element", "x", "y", "z", "xs", "ys", "zs", "xu", "yu", "zu", "xsu", "ysu",
    "zsu", "ix", "iy", "iz", "vx", "vy", "vz", "radius", "diameter", "mass",
}  # fmt: skip


class Dump(Source):
    """A dump: text, perhaps compressed by gzip."""

    def __init__(self, path: Path):
        super().__init__(path)
        self._file = opened(path)
        self._starts: list[int] = []
        try:
            while self._seek_frame():
                at, n = self._at, self._head(len(self))[1]
                k, rest = pass_lines(self._file, n, b"ITEM:")
                if k < n:
                    unended = k == n - 1 and rest.strip()
                    raise ValueError(
                        UNENDED if unended else f"frame {len(self)} ends after {k} of {n} particles"
                    )
                self._starts.append(at)
        except Exception as error:  # of packers, too
            self.cut = reason(error)
        except BaseException:
            self._file.close()
            raise

    def _seek_frame(self) -> bool:
        """Go past empty lines; return whether something follows."""
        while True:
            self._at = self._file.tell()
            line = line_of(self._file)
            if line.strip():
                self._file.seek(self._at)
                return True
            if not line:
                return False

    def _head(self, k: int) -> tuple[dict[str, float], int, tuple[str, np.ndarray] | None, list[str]]:
        """Read the items of frame k up to its table: its clocks, number of particles, box, columns."""

        def line() -> str:
            found = line_of(self._file)
            if not found.endswith(b"\n"):
                raise ValueError(f"it ends inside frame {k}")
            return found.decode("utf-8", "replace").strip()

        def numbers(what: str, *counts: int) -> list[float]:
            words = (text := line()).split()
            if len(words) not in counts or not all(map(is_number, words)):
                raise ValueError(f"frame {k} has {text[:40]!r} for {what}")
            return [float(word) for word in words]

        clocks: dict[str, float] = {}
        n = box = None
        while True:
            head = line()
            item, _, rest = head.removeprefix("ITEM: ").partition(" ")
            if not head.startswith("ITEM: "):
                raise ValueError(f"frame {k} has {head[:40]!r} where an ITEM was expected")
            if item == "ATOMS":
                if n is None:
                    raise ValueError(f"frame {k} has no number of atoms")
                return clocks, n, box, rest.split()
            if item == "BOX":
                flags = rest.removeprefix("BOUNDS").strip()
                rows = [
                    numbers("bounds of its box", *((4,) if flags[:3] == "abc" else (2, 3))) for _ in "xyz"
                ]
                if len({len(row) for row in rows}) > 1:
                    raise ValueError(f"frame {k} has bounds of {[len(row) for row in rows]} numbers")
                box = flags, np.array(rows)
            elif head == "ITEM: NUMBER OF ATOMS":
                if not (text := line()).isdecimal():
                    raise ValueError(f"frame {k} has {text[:40]!r} for its number of particles")
                n = int(text)
            elif item in ("TIME", "TIMESTEP"):
                (clocks[item],) = numbers("its time", 1)
            elif item != "UNITS":
                raise ValueError(f"its frames hold {head[6:46]!r}, no atoms")
            else:
                line()

    def __len__(self) -> int:
        return len(self._starts)

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        self._file.seek(self._starts[k])
        clocks, n, bounds, names = self._head(k)
        rows = [line_of(self._file) for _ in range(n)]
        words = [row.split() for row in rows]
        for row in words:
            if len(row) != len(names):
                raise ValueError(f"frame {k} has {len(row)} columns where {len(names)} were announced")
        table = _table(names, rows, words)
        cell, origin, periodic = (None, None, None) if bounds is None else _box(*bounds)
        positions, unwrapped = _coordinates(table, cell, origin)
        radii = table.get("radius")
        d = positions.shape[1]
        images = None if unwrapped else vectors(table, *("ix", "iy", "iz")[:d])
        if images is not None:
            images = integers(images) if images.shape[1] == d else None
        kinds = next((table[name] for name in ("typelabel", "type", "element") if name in table), None)
        return RawFrame(
            positions, cell, origin, periodic,
            velocities=vectors(table, "vx", "vy", "vz"),
            diameters=2.0 * radii if radii is not None else table.get("diameter"),
            masses=table.get("mass"), images=images, kinds=kinds,
            ids=integers(table["id"]) if "id" in table else None,
            time=clocks.get("TIME"), step=clocks.get("TIMESTEP"), unwrapped=unwrapped,
            dimension=_dimension(positions, cell, origin),
            dropped=tuple(name for name in names if name not in _READ),
        )  # fmt: skip

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _table(names: list[str], rows: list[bytes], words: list[list[bytes]]) -> dict[str, np.ndarray]:
    """Return the columns by name: words as str, all others as float64."""
    texts = {name for name in names if name in _WORDS}
    if "type" in names and not words[0][names.index("type")].lstrip(b"+-").isdigit():
        texts.add("type")
    columns = [k for k, name in enumerate(names) if name in _READ and name not in texts]
    found = table_of(b"".join(rows), columns) if columns else np.empty((len(rows), 0))
    table: dict[str, np.ndarray] = {names[k]: found[:, m] for m, k in enumerate(columns)}
    for name in texts:
        k = names.index(name)
        table[name] = np.array([row[k].decode("utf-8", "replace") for row in words])
    if "type" in table and "type" not in texts:
        table["type"] = integers(table["type"])
    return table


def _box(flags: str, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[bool, ...] | None]:
    """Return cell, corner and periodic axes from BOX BOUNDS: right angles, tilted, or any three edges."""
    words = flags.split()
    axes = [word for word in words if len(word) == 2 and word.strip("pfsm") == ""]
    periodic = tuple("p" in word for word in axes) if len(axes) == 3 else None
    if words[:1] == ["abc"]:
        return rows[:, :3], rows[:, 3], periodic
    xy, xz, yz = rows[:, 2] if rows.shape[1] == 3 else (0.0, 0.0, 0.0)
    low, high = rows[:, 0].copy(), rows[:, 1].copy()
    # These are the ends of the tilted cell, not of its edges.
    low -= [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
    high -= [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
    return tilted_cell(high - low, xy, xz, yz), low, periodic


def _dimension(positions: np.ndarray, cell: Any, origin: Any) -> int | None:
    """Return 2 if all z are 0, in the middle of the box, as LAMMPS has them in two dimensions."""
    d = positions.shape[1]
    if d == 3 and cell is not None and -2.0 * origin[2] == cell[2, 2]:
        middle = positions[:1] * [1.0, 1.0, 0.0]
        return 2 if thin(np.concatenate([positions, middle]), 2) else None
    return d if d < 3 else None


def _coordinates(table: dict[str, Any], cell: Any, origin: Any) -> tuple[np.ndarray, bool]:
    """Return positions, and whether they are unwrapped."""
    for names, unwrapped, scaled in (
        (("xu", "yu", "zu"), True, False), (("x", "y", "z"), False, False),
        (("xsu", "ysu", "zsu"), True, True), (("xs", "ys", "zs"), False, True),
    ):  # fmt: skip
        coordinates = vectors(table, *names)
        if coordinates is not None and scaled:
            if cell is None:
                raise ValueError("its coordinates are scaled, and it has no box")
            d = coordinates.shape[1]
            coordinates = origin[:d] + coordinates @ cell[:d, :d]
        if coordinates is not None:
            return coordinates, unwrapped
    raise ValueError("it has no column x, xs, xu or xsu")


_STYLES = {
    "atomic": "id type", "charge": "id type q", "bond": "id mol type", "angle": "id mol type",
    "molecular": "id mol type", "full": "id mol type q", "sphere": "id type diameter density",
    "bpm/sphere": "id mol type diameter density", "dipole": "id type q", "template": "id type mol index atom",
}  # fmt: skip
"""Columns of the section Atoms before x y z, by atom style."""
_SECTION = re.compile(r"[A-Z][A-Za-z/]*( [A-Z][A-Za-z]*)*")


class Data(Source):
    """A data file: one frame, without a time."""

    def __len__(self) -> int:
        return 1

    def read(self, k: int) -> RawFrame:
        """Return the frame."""
        head, sections, style, time = self._parts()
        atoms = sections.get("Atoms")
        if not atoms:
            raise ValueError("it has no section Atoms")
        n = int(head.get("atoms", ["0"])[0])
        if len(atoms) != n:
            raise ValueError(f"its section Atoms has {len(atoms)} rows, and {n} atoms were announced")
        width = len(atoms[0])
        if not style and width in (5, 8):
            style = "atomic"
        if style not in _STYLES:
            raise ValueError(
                f"its atom style is {style or 'not said'}; expected a line 'Atoms # STYLE' with one of "
                f"{', '.join(_STYLES)}"
            )
        names = [*_STYLES[style].split(), "x", "y", "z"]
        after = len(names) + (2 * (style == "template") + 3 * (style == "dipole"))
        if width == after + 3:
            names += ["mu"] * (after - len(names)) + ["ix", "iy", "iz"]
        elif width < len(names):
            raise ValueError(f"its atoms have {width} columns, and the style {style} has {len(names)}")
        if any(len(row) != width for row in atoms):
            raise ValueError("the rows of its section Atoms differ in length")
        columns = dict(zip(names, zip(*atoms, strict=True), strict=False))
        table: dict[str, Any] = {
            name: np.array(words, dtype=np.float64) for name, words in columns.items() if name != "type"
        }
        labels = {row[0]: row[1] for row in sections.get("Atom Type Labels", [])}
        kinds = [labels.get(word, word) for word in columns["type"]]
        ids = integers(table["id"])
        diameters = table.get("diameter")
        images = vectors(table, "ix", "iy", "iz")
        positions = np.column_stack([table["x"], table["y"], table["z"]])
        cell, origin = self._cell(head, flat=not positions[:, 2].any())
        return RawFrame(
            positions, cell, origin, dimension=_dimension(positions, cell, origin),
            velocities=_velocities(sections.get("Velocities"), ids), diameters=diameters,
            masses=_masses(table, kinds, labels, sections.get("Masses")),
            images=None if images is None else integers(images), kinds=np.array(kinds), ids=ids, time=time,
            dropped=tuple(
                name for name in (*names, *sections) if name in ("q", "mol") or name in ("Bonds", "Angles")
            ),
        )  # fmt: skip

    def _parts(self) -> tuple[dict[str, list[str]], dict[str, list[list[str]]], str, float | None]:
        """Return the header by its words, the rows of each section, the atom style, and Carom's time."""
        head: dict[str, list[str]] = {}
        sections: dict[str, list[list[str]]] = {}
        rows: list[list[str]] | None = None
        style = ""
        lines, rest = text_of(self.path)
        if rest:
            raise ValueError(UNENDED)
        time = re.match(r"Carom, time ([^;]*);", "".join(lines[:1]))
        for line in lines[1:]:  # the first one is a comment
            text, _, comment = (part.strip() for part in line.partition("#"))
            if _SECTION.fullmatch(text):
                rows = sections.setdefault(text, [])
                if text == "Atoms":
                    style = (comment.split() or [""])[0]
            elif rows is not None:
                if text:
                    rows.append(text.split())
            elif text:
                words = text.split()
                count = next((k for k, word in enumerate(words) if word[0].isalpha()), len(words))
                head[" ".join(words[count:])] = words[:count]
        return head, sections, style, float(time[1]) if time else None

    def _cell(self, head: dict[str, list[str]], *, flat: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the cell and its corner; edges that are not there are 0, but that of z in a flat system."""
        missing = {"x": ("0", "0"), "y": ("0", "0"), "z": ("-0.5", "0.5") if flat else ("0", "0")}
        bounds = np.array([[float(w) for w in head.get(f"{a}lo {a}hi", missing[a])] for a in "xyz"])
        tilts = [float(word) for word in head.get("xy xz yz", ("0", "0", "0"))]
        if "avec" in head:
            rows = [[float(word) for word in head[name]] for name in ("avec", "bvec", "cvec")]
            return np.array(rows), np.array([float(word) for word in head.get("abc origin", ("0",) * 3)])
        return tilted_cell(bounds[:, 1] - bounds[:, 0], *tilts), bounds[:, 0]


def _velocities(rows: list[list[str]] | None, ids: np.ndarray) -> np.ndarray | None:
    """Return the velocities in the order of the atoms."""
    if rows is None:
        return None
    if any(len(row) < 4 for row in rows):
        raise ValueError("a row of its section Velocities has fewer than four words")
    of = {int(row[0]): [float(word) for word in row[1:4]] for row in rows}
    if lacking := [number for number in ids.tolist() if number not in of]:
        raise ValueError(f"its section Velocities lacks {len(lacking)} atoms, such as {lacking[0]}")
    return np.array([of[number] for number in ids.tolist()])


def _masses(
    table: dict[str, Any], kinds: list[str], labels: dict[str, str], rows: list[list[str]] | None
) -> np.ndarray | None:
    """Return the masses: from the density of spheres, or of the types."""
    if "density" in table and table["density"].any():  # OVITO writes 0 where it knows none
        volume = math.pi / 6.0 * table["diameter"] ** 3
        return table["density"] * np.where(volume > 0.0, volume, 1.0)  # of a point it is the mass
    if not rows:
        return None
    of = {labels.get(row[0], row[0]): float(row[1]) for row in rows}
    if lacking := sorted({*kinds} - {*of}):
        raise ValueError(f"its section Masses lacks the type {lacking[0]}")
    return np.array([of[kind] for kind in kinds])
