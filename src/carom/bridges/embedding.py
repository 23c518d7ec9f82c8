"""What other programs need of a frame: three dimensions, chemical symbols.

Missing coordinates are 0. A missing edge is as long as the longest edge: a positive placeholder along an axis
that is not periodic.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import quote, unquote

import numpy as np

from carom.errors import InputError

if TYPE_CHECKING:
    from carom.configuration import Configuration

_ELEMENTS = """
H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Kr Rb Sr Y Zr
Nb Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce Pr Nd Pm Sm Eu Gd Tb Dy Ho Er Tm Yb Lu Hf Ta W Re Os Ir
Pt Au Hg Tl Pb Bi Po At Rn Fr Ra Ac Th Pa U Np Pu Am Cm Bk Cf Es Fm Md No Lr Rf Db Sg Bh Hs Mt Ds Rg Cn Nh Fl
Mc Lv Ts Og
"""

#: The symbols of the chemical elements.
SYMBOLS = frozenset(_ELEMENTS.split())


def embed(vectors: np.ndarray) -> np.ndarray:
    """Return (n, d) vectors, d <= 3, as (n, 3) with zeros in the missing columns; a copy only if d < 3."""
    n, dimension = vectors.shape
    if dimension == 3:
        return vectors
    result = np.zeros((n, 3), dtype=vectors.dtype)
    result[:, :dimension] = vectors
    return result


def about_axes(spins: np.ndarray) -> np.ndarray:
    """Return spins (n, 1) or (n, 3) as (n, 3): in the plane they turn about the third axis."""
    if spins.shape[1] == 3:
        return spins
    result = np.zeros((len(spins), 3))
    result[:, 2] = spins[:, 0]
    return result


def spins_of(about: np.ndarray | None, dimension: int) -> np.ndarray | None:
    """Return the spins (n, 1) or (n, 3) of vectors about the axes: the inverse of :func:`about_axes`."""
    if about is None or dimension == 1:
        return None
    about = np.ascontiguousarray(about, dtype=np.float64).reshape(len(about), -1)
    return about[:, -1:].copy() if dimension == 2 else about


def edges(box: tuple[float, ...]) -> tuple[float, ...]:
    """Return the box's edges [length], at least three of them, with placeholders where d < 3."""
    return tuple(box) + (max(box),) * (3 - len(box))


def cell_of(frame: Configuration) -> np.ndarray:
    """Return the edges of the cell, a vector a row: (3, 3), or (d, d) in more dimensions."""
    cell = np.diag(np.array(edges(tuple(frame.box))))
    if frame.tilt:
        cell[1, 0] = frame.tilt * frame.box[1]
    return cell


def upright(frame: Configuration) -> np.ndarray:
    """Return positions (n, d) in the box with right angles, which is a cell of a sheared lattice as well."""
    if not frame.tilt:
        return frame.positions
    result = frame.positions.copy()
    result[:, 0] %= frame.box[0]
    return result


def periodic(flags: tuple[bool, ...]) -> tuple[bool, ...]:
    """Return which of the (at least three) axes are periodic, given which of the d are."""
    return (*flags, *(False,) * (3 - len(flags)))


def names_of(frame: Configuration) -> tuple[str, ...]:
    """Return the names of a frame's species: by default their numbers, or X for a frame without species."""
    if frame.species is None:
        return ("X",)
    return frame.species_names or tuple(str(k) for k in range(int(frame.species.max()) + 1))


def symbols_of(frame: Configuration) -> list[str]:
    """Return the chemical symbols of the species, or X for each, as ASE fails with any other name."""
    names = names_of(frame)
    return list(names) if all(name in SYMBOLS for name in names) else ["X"] * len(names)


def plain(name: str) -> str:
    """Return a name in ASCII; it is quoted if it has other characters or a percent sign."""
    return name if name.isascii() and "%" not in name else quote(name, safe=" ")


def one_word(name: str) -> str:
    """Return a name as one word of a line: in ASCII, without spaces."""
    return quote(name, safe="") or "X"


def joined(names: tuple[str, ...]) -> str:
    """Return names as one word of plain letters, digits, commas and percent signs."""
    return ",".join(quote(name, safe="") for name in names)


def parted(word: str) -> tuple[str, ...]:
    """Return the names of :func:`joined`."""
    return tuple(unquote(name) for name in word.split(",")) if word else ()


def require_at_most_three(dimension: int, format_name: str) -> None:
    """Refuse frames that do not fit into three columns."""
    if dimension > 3:
        raise InputError(
            f"{format_name} holds at most 3 dimensions, and these frames have {dimension}; "
            "write .h5md instead."
        )
