"""Components sorted into cells: neighbors in space are neighbors in memory.

Cells along the last axis, and their members, follow each other: all of a *column* near a component are one
stretch of memory, in any dimension.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from carom.errors import InputError

ACROSS, ALONG = 0.5, 0.2
"""Edges of a cell, in reaches: across the columns, and along them.

Larger cells hold more pairs that are too far apart; smaller ones make more and shorter stretches. A third and
a half of the reach across the columns take the same time, within a tenth, at 2 to 5 diameters in d = 2 and 3.
A whole reach takes 1.5 times as long.
"""

SLACK = 2.0**-20
"""Bound, in cells, on how far rounding can move a component into a wrong cell; rounding is far smaller."""


def wrapped(positions: np.ndarray, box: np.ndarray | float) -> np.ndarray:
    """Return positions (n, d) moved by whole edges into ``0 <= x < edge``."""
    if ((positions >= 0.0) & (positions < box)).all():
        return positions + 0.0  # -0 becomes 0, as by np.mod, which is slow
    inside = np.mod(positions, box)
    # A tiny negative coordinate is rounded up to the edge itself, which is the image of 0.
    inside[inside >= box] = 0.0
    return inside


@dataclass(frozen=True, eq=False)
class Grid:
    """A box cut into equal cells."""

    box: np.ndarray  # (d,), edges [length]
    periodic: np.ndarray  # (d,) bool; the other axes have walls
    shape: np.ndarray  # (d,) int64, cells along each axis

    @classmethod
    def of(cls, box: np.ndarray, periodic: np.ndarray, n: int, reach: float, across: float = ACROSS) -> Grid:
        """Return the grid in which pairs up to `reach` [length] of n components are found fast.

        Its cells are `across` reaches wide, and longer where there are few components.
        """
        box = np.asarray(box, dtype=np.float64)
        spacing = float(np.prod(box / max(n, 1) ** (1.0 / len(box)))) ** (1.0 / len(box))
        wanted = np.full(len(box), max(across * reach, spacing))
        wanted[-1] = max(ALONG * reach, spacing)
        # Numbers of cells are cut to n before they become integers, which could overflow.
        along = np.clip(np.floor(box / wanted), 1, max(n, 1))
        return cls(box, np.asarray(periodic, dtype=np.bool_), along.astype(np.int64))

    @property
    def columns(self) -> int:
        """Number of columns: rows of cells along the last axis."""
        return math.prod(self.shape[:-1].tolist())

    def surroundings(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return which cells may hold components within `reach` [length] of a cell.

        These are the offsets (m, d - 1) from a column to itself and those around it, each column once, and
        how many cells up and down each, (m,).
        """
        edges = self.box / self.shape
        ranges = []
        for count, edge, repeats in zip(self.shape[:-1], edges, self.periodic, strict=False):
            far = int(min(reach / edge + SLACK, count)) + 1
            low, high = ((count - 1) // 2, count // 2) if repeats else (count - 1, count - 1)
            ranges.append(range(-min(far, low), min(far, high) + 1))
        offsets, windows = [], []
        for offset in itertools.product(*ranges):
            gaps = [max(abs(k) - 1.0 - SLACK, 0.0) * edge for k, edge in zip(offset, edges, strict=False)]
            left = reach**2 - math.fsum(gap**2 for gap in gaps)
            if left >= 0.0:
                offsets.append(offset)
                windows.append(int(min(math.sqrt(left) / edges[-1] + SLACK, self.shape[-1])) + 1)
        shape = (len(offsets), len(self.box) - 1)
        return np.array(offsets, dtype=np.int64).reshape(shape), np.array(windows, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class SortedCells:
    """Components in the order of the cells of a grid, numbered with the last axis fastest."""

    grid: Grid
    places: np.ndarray  # (d, n), coordinates in the box [length]
    order: np.ndarray  # (n,), which component stands at each place
    starts: np.ndarray  # (cells + 1,): cell c has those from ``starts[c]`` to ``starts[c + 1]``

    @classmethod
    def of(cls, grid: Grid, positions: np.ndarray) -> SortedCells:
        """Sort positions (n, d) [length], wrapped into the box first."""
        positions = np.asarray(positions, dtype=np.float64)
        if not np.isfinite(positions).all():
            worst = int(np.argmin(np.isfinite(positions).all(axis=1)))
            raise InputError(f"Position {worst} is {positions[worst].tolist()}; expected finite numbers.")
        places = np.array(positions.T, order="C")
        cells = np.zeros(len(positions), dtype=np.int64)
        for axis, count in enumerate(grid.shape):
            edge = grid.box[axis]
            if grid.periodic[axis]:
                places[axis] = wrapped(places[axis], edge)
            elif places[axis].size and not (places[axis].min() >= 0.0 and places[axis].max() <= edge):
                raise InputError(f"A position is outside of the box along axis {axis}, which has walls.")
            cells *= count
            cells += np.minimum((places[axis] * (count / edge)).astype(np.int64), count - 1)
        order = np.argsort(cells, kind="stable")
        starts = np.zeros(math.prod(grid.shape.tolist()) + 1, dtype=np.int64)
        np.cumsum(np.bincount(cells, minlength=starts.size - 1), out=starts[1:])
        return cls(grid, np.take(places, order, axis=1), order, starts)
