"""The cells that reference points lie in, and those around one.

``lists`` is a ``Lists``, of which only the points, their window and the grid are needed here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner
from carom.engine.neighbors.points import bits, grid_coordinate
from carom.engine.neighbors.tilt_window import cell_gap, half_square, pull, reached


class Grid(NamedTuple):
    """Where the cells of every level are, one grid after the other."""

    shape: np.ndarray  # cells along each axis, (levels, d) int64
    base: np.ndarray  # first cell of each level, (levels,) int64
    spans: np.ndarray
    """How many cells to look to either side along each axis, (levels, levels, d) int64: for a component of
    the first level, in the grid of the second.
    """
    neighbor_cells: np.ndarray  # room for the numbers of cells, twice, (2, most) int64
    gaps: np.ndarray  # room for the squared distances to them, (2, most) float64
    ahead: np.ndarray  # room for how far they reach in the direction of a move, (2, most) float64


def make_grid(shapes, spans) -> Grid:
    """Return the grids of all levels."""
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
def cell_of(lists, own_class, point):
    """Return the cell of a reference point in the grid of level ``own_class``."""
    cell = np.int64(0)
    for axis in range(len(lists.grid_step)):
        size = lists.grid.shape[own_class, axis]
        cell = cell * size + ((grid_coordinate(lists, point, axis) * size) >> bits(lists))
    return np.uint64(lists.grid.base[own_class] + cell)


SQUARE_MARGIN = 1e-9
"""Cells are looked into that are this fraction too far away, so that rounding loses nobody."""


@inner
def cells_near(lists, own_class, other, point, range_sq, moved, old):
    """Find the cells of a level that can hold anybody whom a component of level ``own_class`` has to look at.

    They lie within the root of ``range_sq`` of its reference point. If it has ``moved`` from ``old``, who is
    new to it is nearer to the new point than to the old one.
    """
    grid = lists.grid
    half = np.uint64(0)
    count = np.uint64(1)
    start = SQUARE_MARGIN * range_sq
    for axis in range(len(lists.grid_step)):
        start += half_square(lists.window, lists, point, old, axis) if moved else 0.0
    grid.neighbor_cells[0, 0] = 0
    grid.gaps[0, 0] = 0.0
    grid.ahead[0, 0] = start
    for axis in range(len(lists.grid_step)):
        size = grid.shape[other, axis]
        span = grid.spans[own_class, other, axis]
        scaled = grid_coordinate(lists, point, axis) * size
        home = scaled >> bits(lists)
        inside = (scaled - (home << bits(lists))) * lists.grid_step[axis] / size
        side = lists.grid_step[axis] * np.float64(np.int64(1) << bits(lists)) / size
        step, spread = pull(lists.window, lists, point, old, axis) if moved else (0.0, 0.0)
        around = 2 * span + 1 > size  # all of them, each once
        lowest_offset = -(size // 2) if around else -span
        offsets_end = lowest_offset + size if around else span + 1
        other_half = np.uint64(1) - half
        total = np.uint64(0)
        for offset in range(lowest_offset, offsets_end):
            low = offset * side - inside
            high = low + side
            gap = 0.0 if around else cell_gap(lists.window, axis, low, high)
            cell = home + offset
            cell = cell + size if cell < 0 else (cell - size if cell >= size else cell)
            if around:
                low, high = -size * side, size * side
            ahead = reached(lists.window, step, spread, low, high)
            for k in range(count):
                square = grid.gaps[half, k] + gap * gap
                grid.neighbor_cells[other_half, total] = grid.neighbor_cells[half, k] * size + cell
                grid.gaps[other_half, total] = square
                grid.ahead[other_half, total] = grid.ahead[half, k] + ahead
                total += np.uint64(square <= range_sq * (1.0 + SQUARE_MARGIN))
        half = other_half
        count = total
    count_kept = np.uint64(0)
    for k in range(count):
        grid.neighbor_cells[half, count_kept] = grid.base[other] + grid.neighbor_cells[half, k]
        count_kept += np.uint64(grid.ahead[half, k] >= 0.0)
    return half, count_kept
