"""Lattices as plain arrays.

A lattice is a cell with right angles, repeated. The box is a whole number of cells, so that the lattice is
periodic in it. Lengths are in units of the cell's first edge; :class:`carom.Scene` gives them their unit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks
from carom.configuration import MOST_DIMENSIONS
from carom.densities import packing_fraction
from carom.errors import InputError, warn

#: The most components a scene may have; their arrays fill about 30 GB.
MOST = 10**8


@dataclass(frozen=True)
class Lattice:
    """A lattice as a cell with right angles."""

    name: str  # e.g. "fcc"
    basis: tuple[tuple[float, ...], ...]  # points of one cell, in units of its edges
    shape: tuple[float, ...]  # edges of the cell, the first being 1
    nearest: float  # distance of nearest neighbors, in first edges

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return len(self.shape)

    @property
    def limit(self) -> float:
        """Packing fraction at which nearest neighbors touch."""
        return packing_fraction(len(self.basis), self.shape, self.nearest)

    def edge(self, density: float) -> float:
        """Return the cell's first edge [diameter] at a reduced density."""
        return (len(self.basis) / (density * math.prod(self.shape))) ** (1 / self.dimension)

    def count(self, cells: Sequence[int]) -> int:
        """Return the number of points of a block of ``cells``."""
        return len(self.basis) * math.prod(cells)

    def box(self, cells: Sequence[int], edge: float = 1.0) -> tuple[float, ...]:
        """Return the edges of a block of ``cells`` whose first edge is ``edge`` long."""
        return tuple(c * (edge * s) for c, s in zip(cells, self.shape, strict=True))

    def points(self, cells: Sequence[int], edge: float = 1.0) -> np.ndarray:
        """Return the points (n, d) of a periodic block of cells, in [0, :meth:`box`), clear of its faces."""
        edges = edge * np.asarray(self.shape)
        basis = np.asarray(self.basis)
        # Points are moved off the faces of the box, where rounding would decide on which side they lie.
        basis = basis + (1 - basis.max(axis=0)) / 2
        corners = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1)
        places = corners.reshape(-1, 1, self.dimension) + basis
        return places.reshape(-1, self.dimension) * edges


def cubic(dimension: int) -> Lattice:
    """Return the simple cubic lattice Z^d: one point a cell."""
    return Lattice("cubic", ((0.0,) * dimension,), (1.0,) * dimension, 1.0)


def triangular() -> Lattice:
    """Return the triangular lattice of the plane: two points a cell of edges 1 and sqrt(3)."""
    return Lattice("triangular", ((0.0, 0.0), (0.5, 0.5)), (1.0, math.sqrt(3)), 1.0)


def dn(dimension: int) -> Lattice:
    """Return the checkerboard lattice D_n, the integer points of even sum: 2^(d-1) points a cell.

    D_3 is fcc; D_3, D_4 and D_5 are the densest lattices of their dimensions.
    """
    halves = itertools.product((0.0, 0.5), repeat=dimension)
    basis = tuple(p for p in halves if sum(p) == int(sum(p)))
    return Lattice("fcc" if dimension == 3 else "dn", basis, (1.0,) * dimension, math.sqrt(0.5))


def densest(dimension: int) -> Lattice:
    """Return the densest lattice offered here: Z for d = 1, triangular for 2, D_n from 3 on."""
    if dimension == 1:
        return cubic(1)
    return triangular() if dimension == 2 else dn(dimension)


def named(lattice: Any, dimension: int | None = None) -> Lattice:
    """Return a lattice by its name: "cubic", "fcc", "triangular" or "dn"; a Lattice stays what it is."""
    if isinstance(lattice, Lattice):
        return lattice
    d = checks.integer(3 if dimension is None else dimension, "dimension", low=1, high=MOST_DIMENSIONS)
    if lattice == "cubic":
        return cubic(d)
    if lattice == "dn" and d >= 3:
        return dn(d)
    fixed = {"fcc": (3, dn), "triangular": (2, lambda _: triangular())}
    if isinstance(lattice, str) and lattice in fixed and dimension in (None, fixed[lattice][0]):
        return fixed[lattice][1](fixed[lattice][0])
    raise InputError(
        "lattice must be cubic, fcc (dimension 3), triangular (dimension 2) or dn (dimension 3 and up); "
        f"found {checks.describe(lattice)} in dimension {d}."
    )


def between_walls(
    points: np.ndarray, box: Sequence[float], periodic: Sequence[bool], diameter: float
) -> np.ndarray:
    """Return points (n, d) compressed along axes with walls to half a diameter from these, if needed."""
    result = points.copy()
    for axis, (edge, repeats) in enumerate(zip(box, periodic, strict=True)):
        low, high = points[:, axis].min(), points[:, axis].max()
        if not repeats and low < 0.5 * diameter and high > low:
            scale = (edge - diameter) / (high - low)
            result[:, axis] = 0.5 * edge + (points[:, axis] - 0.5 * (low + high)) * scale
    return result


def cells_along(lattice: Lattice, cells: Any) -> tuple[int, ...]:
    """Return the cells along each axis; one number is that of the first, in a box most nearly a cube."""
    if isinstance(cells, Sequence | np.ndarray) and not isinstance(cells, str):
        if len(cells) != lattice.dimension:
            raise InputError(
                f"cells must be one integer or {lattice.dimension} of them (one an axis), found {len(cells)}."
            )
        result = tuple(checks.integer(c, "cells", low=1, high=MOST) for c in cells)
    else:
        first = checks.integer(cells, "cells", low=1, high=MOST)
        result = tuple(max(1, round(first / s)) for s in lattice.shape)
    if lattice.count(result) > MOST:
        raise InputError(f"cells must make at most {MOST} components, found {lattice.count(result)}.")
    return result


def cells_for(lattice: Lattice, n: Any, nearest: bool = False) -> tuple[int, ...]:
    """Return the block of cells with ``n`` points, or the ``nearest`` number: :func:`cells_along`."""
    n = checks.integer(n, "n", low=1, high=MOST)
    below: tuple[int, ...] | None = None
    guess = (n / len(lattice.basis) * math.prod(lattice.shape)) ** (1 / lattice.dimension)
    for first in itertools.count(max(1, int(guess) - 2)):
        cells = tuple(max(1, round(first / s)) for s in lattice.shape)
        count = lattice.count(cells)
        if count >= n:
            break
        below = cells
    around = [each for each in (below, cells) if each is not None]
    if count == n or nearest:
        block = min(around, key=lambda each: abs(lattice.count(each) - n))
        if (taken := lattice.count(block)) != n:
            warn(f"{taken} particles were placed, the number nearest to n = {n} that fills {lattice.name}.")
        return block
    counts = " or ".join(str(lattice.count(each)) for each in around)
    raise InputError(
        f"n = {n} does not fill a {lattice.name} lattice with equal cells along every axis; take n = "
        f"{counts} (nearest=True does, as an option --nearest), or give cells."
    )
