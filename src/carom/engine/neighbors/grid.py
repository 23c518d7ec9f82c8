"""Reference points of lists, the cells that they lie in, and distances over a window of tilts.

Points are fractions of the box along each axis, in integers side by side in one word of 64 bits: differences
are the nearest image's by themselves, and exact. In a lattice that tilts (``carom.models.motions.shear``)
they move with the stream and drift apart, so two are listed if theirs are near at *any* tilt of a window.
Lists are made anew before the tilt leaves it; None in its place is a box at rest. ``lists`` is a
``NeighborLists``, of which only the points, their window and the grid are needed here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.models.motions.shear import LISTED_STRAIN, Sheared, tilt_at


def coordinate_bits(dimension):
    """Return how many bits of a reference point are for one axis."""
    return min(32, 64 // dimension)


def bits(lists):
    """Return how many bits of a reference point are for one axis."""
    return coordinate_bits(len(lists.grid_step))


def grid_coordinate(lists, point, axis):
    """Return the coordinate of a reference point along an axis, in steps."""
    size = bits(lists)
    return int(point >> size * axis) & ((1 << size) - 1)


def grid_difference(lists, to, since, axis):
    """Return the component along an axis of the way between two reference points, of the nearest image."""
    shift = bits(lists) * axis
    half = 1 << (bits(lists) - 1)
    # The bits of other axes, above, are cut off with those of the wrap.
    way = int(to >> shift) - int(since >> shift)
    return np.int32(((way + half) & (2 * half - 1)) - half) * lists.grid_step[axis]


class TiltWindow(NamedTuple):
    """The tilts that lists are made for."""

    middle: np.ndarray  # of the window, (1,) float64
    half: float  # half of its width


def make_tilt_window(motion) -> TiltWindow | None:
    """Return the window of the model of a motion, or None where no lattice tilts."""
    return TiltWindow(np.zeros(1), 0.5 * LISTED_STRAIN) if isinstance(motion, Sheared) else None


def open_window(window, motion):
    """Let the window begin with the tilt at the beginning of the epoch."""
    if window is not None:
        window.middle[0] = motion.tilt[0] + math.copysign(window.half, motion.rate)


def ends_with(window, motion, length):
    """Tell whether the window ends in the epoch of this length that begins."""
    if window is None:
        return False
    return abs(tilt_at(motion, length) - window.middle[0]) > window.half


def least_difference(window, lists, to, since, axis):
    """Return the component along an axis of the way between two reference points, where it is shortest."""
    r = grid_difference(lists, to, since, axis)
    if window is None:
        return r
    if axis == 0:
        up = grid_difference(lists, to, since, 1)
        r = max(abs(r + window.middle[0] * up) - window.half * abs(up), 0.0)
    return r


def _along_lattice(motion, lists, boundary, me, point, axis, now):
    x = motion.position_at(axis, me.x, me.v, now - me.t, now)
    r = x - grid_coordinate(lists, point, axis) * lists.grid_step[axis]
    return r - boundary.edges[axis] * np.rint(r * boundary.inverse[axis])


def from_reference(window, motion, lists, boundary, me, point, axis, now):
    """Return a coordinate of the way to a component, whose old event is ``me``, from its reference point."""
    r = _along_lattice(motion, lists, boundary, me, point, axis, now)
    if window is None:
        return r
    if axis == 0:
        r += tilt_at(motion, now) * _along_lattice(motion, lists, boundary, me, point, 1, now)
    return r


def speed_from_reference(window, motion, lists, boundary, me, point, axis, now):
    """Return how fast that changes."""
    v = np.float64(motion.velocity_at(axis, me.v, now - me.t))
    if window is not None and axis == 0:
        v += motion.rate * _along_lattice(motion, lists, boundary, me, point, 1, now)
    return v


def half_square(window, lists, to, since, axis):
    """Return half of the square of a move along an axis, where it is longest."""
    step = grid_difference(lists, to, since, axis)
    if window is None:
        return 0.5 * step * step
    if axis == 0:
        up = grid_difference(lists, to, since, 1)
        step = abs(step + window.middle[0] * up) + window.half * abs(up)
    return 0.5 * step * step


def pull(window, lists, to, since, axis):
    """Return a coordinate's factor in a way times a move, mid-window, and its change in the window."""
    step = grid_difference(lists, to, since, axis)
    spread = 0.0
    if window is None:
        return step, spread
    if axis < 2:
        tilt = window.middle[0]
        along, up = grid_difference(lists, to, since, 0), grid_difference(lists, to, since, 1)
        step = along + tilt * up
        spread = window.half * abs(up)
        if axis == 1:
            spread = window.half * (abs(step + tilt * up) + spread)
            step = up + tilt * step
    return step, spread


def reached(window, step, spread, low, high):
    """Return the largest product of an interval of coordinates with what :func:`pull` returns."""
    largest = max(low * step, high * step)
    if window is None:
        return largest
    return largest + spread * max(abs(low), abs(high))


def cell_gap(window, axis, low, high):
    """Return how far a cell from ``low`` to ``high`` along an axis is away, at least."""
    if window is None:
        return max(low, -high, 0.0)
    return max(low, -high, 0.0) if axis > 0 else 0.0


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


def cell_of(lists, own_class, point):
    """Return the cell of a reference point in the grid of level ``own_class``."""
    cell = 0
    for axis in range(len(lists.grid_step)):
        size = lists.grid.shape[own_class, axis]
        cell = cell * size + ((grid_coordinate(lists, point, axis) * size) >> bits(lists))
    return lists.grid.base[own_class] + cell


SQUARE_MARGIN = 1e-9
"""Cells are looked into that are this fraction too far away, so that rounding loses nobody."""


def cells_near(lists, own_class, other, point, range_sq, moved, old):
    """Find the cells of a level that can hold anybody whom a component of level ``own_class`` has to look at.

    They lie within the root of ``range_sq`` of its reference point. If it has ``moved`` from ``old``, who is
    new to it is nearer to the new point than to the old one.
    """
    grid = lists.grid
    half = 0
    count = 1
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
        side = lists.grid_step[axis] * np.float64(1 << bits(lists)) / size
        step, spread = pull(lists.window, lists, point, old, axis) if moved else (0.0, 0.0)
        around = 2 * span + 1 > size  # all of them, each once
        lowest_offset = -(size // 2) if around else -span
        offsets_end = lowest_offset + size if around else span + 1
        other_half = 1 - half
        total = 0
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
                total += square <= range_sq * (1.0 + SQUARE_MARGIN)
        half = other_half
        count = total
    count_kept = 0
    for k in range(count):
        grid.neighbor_cells[half, count_kept] = grid.base[other] + grid.neighbor_cells[half, k]
        count_kept += grid.ahead[half, k] >= 0.0
    return half, count_kept
