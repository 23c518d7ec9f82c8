"""What a frame of extended XYZ says about itself: its second line, and the columns of its table.

What other programs write otherwise is understood or refused: flags as ``T T F``, ``true,true,false`` or ``[1,
1, 0]``, keys in other letters, vectors of two columns, atoms in another order in each frame.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

_WIDEST = 100  # words of a column, at most
_WIDTHS = {
    "pos": 3,
    "velo": 3,
    "images": 3,
    "angular_velocity": 3,
    "species": 1,
    "masses": 1,
    "radius": 1,
    "id": 1,
    "kind": 1,
}
"""Words, at most, of the columns that are read."""
_NUMBERS = ("pos", "velo", "images", "angular_velocity", "masses", "radius")
"""Those of numbers."""
_KEYS = ("Lattice", "Properties", "pbc", "Origin", "time", "step", "dimension")
"""Keys of the second line that are read; other programs write some of them in other letters."""
# The key begins a word: otherwise a line of letters would be tried from each of them.
_PAIR = re.compile(
    r"""(?<![\w-])([A-Za-z_][\w-]*)\s*=\s*"""
    r"""(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|(\{[^{}]*\}|\[(?:[^\[\]]|\[[^\[\]]*\])*\])|(\S+))"""
)
_FLAGS = {"t": True, "true": True, "1": True, "f": False, "false": False, "0": False}


class Column(NamedTuple):
    """A column of the table: its name, its kind (R, I, S or L), and which words of a line it takes."""

    name: str
    kind: str
    words: slice


def pairs(line: bytes) -> dict[str, str]:
    """Return the ``key=value`` pairs of the second line of a frame, without quotes around the values."""
    found: dict[str, str] = {}
    for match in _PAIR.finditer(line.decode("utf-8", "replace")):
        key, *values = match.groups()
        found[key] = next(value for value in values if value is not None)
    known = {key.lower(): key for key in _KEYS}
    for key in [*found]:
        if key.lower() in known:
            found.setdefault(known[key.lower()], found[key])
    return found


def words_of(value: str) -> list[str]:
    """Return the words of a list, however it is written: ``T T F``, ``T,T,F``, ``[T, T, F]``."""
    return re.sub(r"[\[\](){},;]", " ", value).split()


def number_of(info: Mapping[str, str], key: str, kind: type = float, default: Any = None) -> Any:
    """Return a number of the second line."""
    if key not in info:
        if default is None:
            raise ValueError(f"its second line has no '{key}'")
        return default
    try:
        return kind(info[key])
    except ValueError:
        expected = "an integer" if kind is int else "a number"
        raise ValueError(f"its {key} is {info[key]!r}; expected {expected}") from None


def lattice_of(info: Mapping[str, str]) -> np.ndarray | None:
    """Return the (3, 3) cell, an edge a row, or None where the second line has none."""
    if "Lattice" not in info:
        return None
    try:
        cell = np.array([float(word) for word in words_of(info["Lattice"])])
    except ValueError:
        cell = np.array([np.nan])
    if cell.size != 9 or not np.isfinite(cell).all():
        raise ValueError(f"its Lattice is {info['Lattice']!r}; expected nine numbers")
    return cell.reshape(3, 3)


def tilt_of(info: Mapping[str, str], lattice: np.ndarray) -> float | None:
    """Return the tilt of a sheared box, or None of one with right angles."""
    others = lattice - np.diag(np.diag(lattice))
    sheared = float(others[1, 0])
    others[1, 0] = 0.0
    if others.any():
        raise ValueError("its box is neither rectangular nor sheared along its first axis")
    if "tilt" in info:  # the cell has lost a digit
        return float(number_of(info, "tilt"))
    return sheared / float(lattice[1, 1]) if sheared else None


def layout_of(info: Mapping[str, str]) -> tuple[list[Column], int]:
    """Return the columns that ``Properties`` announces, and how many words a line has."""
    fields = info.get("Properties", "species:S:1:pos:R:3").split(":")
    if len(fields) % 3:
        raise ValueError(f"Properties has {len(fields)} fields, which is no multiple of 3")
    result: list[Column] = []
    at = 0
    for name, kind, count in zip(fields[0::3], fields[1::3], fields[2::3], strict=True):
        name = name.lower() if name.lower() in _WIDTHS else name
        width = int(count) if count.isdecimal() else 0
        most = _WIDTHS.get(name, _WIDEST)
        if kind not in ("R", "I", "S", "L") or not 1 <= width <= most:
            raise ValueError(
                f"Properties announces {count} columns of kind {kind} for '{name}'; expected 1 to {most} "
                "of R, I, S or L"
            )
        if name in _NUMBERS and kind not in ("R", "I"):
            raise ValueError(f"Properties announces '{name}' of kind {kind}; expected R, real numbers")
        if any(column.name == name for column in result):
            raise ValueError(f"Properties announces the columns '{name}' twice")
        result.append(Column(name, kind, slice(at, at + width)))
        at += width
    return result, at


def dimension_of(info: Mapping[str, str], columns: Mapping[str, np.ndarray]) -> int:
    """Return the dimension of a frame: as many columns as ``pos`` has, unless the second line says less."""
    if "pos" not in columns:
        raise ValueError("it has no column 'pos'")
    width = 1 if columns["pos"].ndim == 1 else columns["pos"].shape[1]
    dimension = number_of(info, "dimension", int, width)
    if not 1 <= dimension <= width:
        raise ValueError(f"its dimension is {dimension}; expected 1 to {width}, as it has coordinates")
    if width > dimension and columns["pos"][:, dimension:].any():
        raise ValueError(f"its dimension is {dimension}, and coordinates along other axes are not 0")
    return int(dimension)


def vectors(columns: Mapping[str, np.ndarray], name: str, dimension: int) -> np.ndarray:
    """Return an (n, d) column."""
    values = columns[name]
    values = values[:, np.newaxis] if values.ndim == 1 else values
    if values.dtype.kind not in "if" or values.shape[1] < dimension:
        raise ValueError(f"its column '{name}' holds no vectors of {dimension} numbers")
    return values[:, :dimension]


def ids_of(columns: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Return the numbers of the components, (n,) integers of which none is there twice, or None."""
    ids = columns.get("id")
    if ids is None:
        return None
    ids = integers(ids) if ids.dtype.kind == "f" else ids
    if ids.dtype.kind != "i":
        raise ValueError("its column 'id' holds no integers")
    if len(np.unique(ids)) != len(ids):
        raise ValueError("two of its components have the same id")
    return ids


def in_order(
    columns: dict[str, np.ndarray], names: np.ndarray | None
) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
    """Return a frame's columns in the order of ``id``, and the ids (n,); ``names`` are the first frame's."""
    ids = ids_of(columns)
    if ids is None:
        if names is not None:
            raise ValueError("it has no column 'id', and the first frame has one")
        return columns, None
    if (np.diff(ids) > 0).all():
        ordered = ids
    else:
        order = np.argsort(ids)
        columns, ordered = {name: values[order] for name, values in columns.items()}, ids[order]
    if names is not None and not np.array_equal(names, ordered):
        raise ValueError("its ids are not those of the first frame")
    return columns, ordered


def periodic_axes(info: Mapping[str, str], dimension: int) -> tuple[bool, ...]:
    """Return which of d axes are periodic: by ``pbc``, else all if there is a cell, and none without."""
    cell = lattice_of(info)
    if "pbc" not in info:
        return (cell is not None,) * dimension
    flags = [_FLAGS.get(word.lower()) for word in words_of(info["pbc"])]
    if None in flags or len(flags) not in (3, dimension):
        raise ValueError(f'its pbc is {info["pbc"]!r}; expected three flags, such as "T T F"')
    for k, flag in enumerate(flags[:dimension]):
        if flag and (cell is None or not cell[k].any()):
            raise ValueError(f"its axis {k} is periodic, and has no length in a Lattice")
    return tuple(bool(flag) for flag in flags[:dimension])


def integers(values: np.ndarray) -> np.ndarray:
    """Return doubles that are integers, and small enough to be exact, as int64."""
    if not (np.abs(values) <= 2.0**53).all() or (values != np.rint(values)).any():
        raise ValueError("a column of integers holds something else")
    return values.astype(np.int64)
