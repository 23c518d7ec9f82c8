"""Reference points, and the cells that they lie in.

A reference point is a fraction of the box along each axis, in integers side by side in one word of 64 bits:
differences then are the nearest image's by themselves, and exact. Its cell follows from the same integers.

``lists`` is a ``Lists``, of which only the grain and the grid are needed here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner


class Grid(NamedTuple):
    """Where the cells of every level are, one grid after the other."""

    shape: np.ndarray
    """Cells along each axis, (levels, d) int64."""
    base: np.ndarray
    """First cell of each level, (levels,) int64."""
    spans: np.ndarray
    """How many cells to look to either side along each axis, (levels, levels, d) int64: for a component of
    the first level, in the grid of the second.
    """
    near: np.ndarray
    """Room for the numbers of cells, twice, (2, most) int64."""
    gaps: np.ndarray
    """Room for the squared distances to them, (2, most) float64."""
    ahead: np.ndarray
    """Room for how far they reach in the direction of a move, (2, most) float64."""


def make_grid(shapes, spans) -> Grid:
    """Return the grids of all levels.

    Parameters
    ----------
    shapes : (levels) sequences of d ints
        Cells along each axis.
    spans : (levels, levels) nested sequences of d ints
        How many cells to look to either side along each axis: for a component of the first level, in the grid
        of the second.
    """
    shape = np.array(shapes, np.int64)
    table = np.array(spans, np.int64).reshape(len(shape), len(shape), -1)
    most = int(np.minimum(2 * table + 1, shape).prod(axis=2).max())
    cells = shape.prod(axis=1)
    return Grid(
        shape,
        (np.cumsum(cells) - cells).astype(np.int64),
        table,
        np.zeros((2, most), np.int64),
        np.zeros((2, most)),
        np.zeros((2, most)),
    )


@inner
def coordinate_bits(dimension):
    """Return how many bits of a reference point are for one axis."""
    return min(32, 64 // dimension)


@inner
def bits(lists):
    """Return how many bits of a reference point are for one axis."""
    return np.int64(coordinate_bits(len(lists.grain)))


@inner
def steps(lists, point, axis):
    """Return the coordinate of a reference point along an axis, in steps."""
    size = bits(lists)
    return np.int64(np.uint64(point) >> np.uint64(size * axis)) & ((np.int64(1) << size) - 1)


@inner
def between(lists, to, since, axis):
    """Return the component along an axis of the way between two reference points, of the nearest image."""
    shift = np.uint64(bits(lists) * axis)
    half = np.int64(1) << (bits(lists) - 1)
    # The bits of other axes, above, are cut off with those of the wrap.
    way = np.int64(np.uint64(to) >> shift) - np.int64(np.uint64(since) >> shift)
    return np.int32(((way + half) & (2 * half - 1)) - half) * lists.grain[axis]


@inner
def cell_of(lists, own, point):
    """Return the cell of a reference point in the grid of level ``own``."""
    cell = np.int64(0)
    for axis in range(len(lists.grain)):
        size = lists.grid.shape[own, axis]
        cell = cell * size + ((steps(lists, point, axis) * size) >> bits(lists))
    return np.uint64(lists.grid.base[own] + cell)


HAIR = 1e-9
"""Cells are looked into that are this fraction too far away, so that rounding loses nobody."""


@inner
def cells_near(lists, own, other, point, reach, moved, old):
    """Find the cells of a level that can hold anybody whom a component of level ``own`` has to look at.

    Those are no further from the reference point than the square root of ``reach``; and if the component has
    ``moved`` from ``old`` to this point, who is new to it is nearer to the new point than to the old one.

    Returns
    -------
    half, count : int
        ``grid.near[half, :count]`` holds the cells.
    """
    grid = lists.grid
    half = np.uint64(0)
    count = np.uint64(1)
    start = HAIR * reach
    for axis in range(len(lists.grain)):
        step = between(lists, point, old, axis)
        start += 0.5 * step * step if moved else 0.0
    grid.near[0, 0] = 0
    grid.gaps[0, 0] = 0.0
    grid.ahead[0, 0] = start
    for axis in range(len(lists.grain)):
        size = grid.shape[other, axis]
        span = grid.spans[own, other, axis]
        scaled = steps(lists, point, axis) * size
        home = scaled >> bits(lists)
        inside = (scaled - (home << bits(lists))) * lists.grain[axis] / size
        side = lists.grain[axis] * np.float64(np.int64(1) << bits(lists)) / size
        step = between(lists, point, old, axis) if moved else 0.0
        around = 2 * span + 1 > size  # all of them, each once
        first = -(size // 2) if around else -span
        last = first + size if around else span + 1
        fresh = np.uint64(1) - half
        total = np.uint64(0)
        for offset in range(first, last):
            low = offset * side - inside
            high = low + side
            gap = 0.0 if around else max(low, -high, 0.0)
            place = home + offset
            place = place + size if place < 0 else (place - size if place >= size else place)
            reached = abs(step) * size * side if around else max(low * step, high * step)
            for k in range(count):
                square = grid.gaps[half, k] + gap * gap
                grid.near[fresh, total] = grid.near[half, k] * size + place
                grid.gaps[fresh, total] = square
                grid.ahead[fresh, total] = grid.ahead[half, k] + reached
                total += np.uint64(square <= reach * (1.0 + HAIR))
        half = fresh
        count = total
    kept = np.uint64(0)
    for k in range(count):
        grid.near[half, kept] = grid.base[other] + grid.near[half, k]
        kept += np.uint64(grid.ahead[half, k] >= 0.0)
    return half, kept
