"""Near pairs, listed by compiled code from sorted cells (:mod:`carom.cells`): for many components.

The list is that of a k-d tree, in another order.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.cells import Grid, SortedCells
from carom.compiling.entry import entry

ACROSS = 1.0 + 2.0**-10
"""Edge of a cell across the columns, in reaches. The reach is short, and 3 x 3 long stretches of memory take
0.6 of the time of 21 short ones.
"""

CROWDED = 64
"""Mean number of components in the cell of a component, above which a k-d tree is better. Few cells then hold
nearly all components, as for a drop in a large box.
"""

WIDE = 1000  # columns around a column above which a k-d tree is better, as in high dimensions


def near_pairs(
    box: np.ndarray,
    periodic: np.ndarray,
    ours: np.ndarray,
    theirs: np.ndarray | None,
    within: float,
) -> np.ndarray | None:
    """Return the pairs (m, 2) of rows ``within`` a distance by images, or None if cells do not help.

    ``ours`` and ``theirs`` (n, d) are in the box. A pair has one of each, or two of ours if `theirs` is None.
    """
    n = len(ours) if theirs is None else max(len(ours), len(theirs))
    grid = Grid.of(box, periodic, n, within, ACROSS)
    offsets, windows = grid.surroundings(within)
    if len(windows) > WIDE:
        return None
    mine = SortedCells.of(grid, ours)
    others = mine if theirs is None else SortedCells.of(grid, theirs)
    for cells in (mine, others):
        if crowded(cells):
            return None
    near = near_cells(grid, offsets, windows)
    # The pairs of a gas, and some more. If there are still more, the kernel returns how many.
    fraction = min(float(np.prod(np.minimum(2.0 * within / grid.box, 1.0))), 1.0)
    share = 0.6 if theirs is None else 1.2
    room = int(share * len(ours) * len(others.order) * fraction) + len(ours)
    asked = members_of(mine), members_of(others), near, theirs is None, within * within
    scratch = scratch_of(near, len(others.order))
    while True:
        found = np.empty((room, 2), dtype=np.int64)
        count = _list(*asked, found, scratch)
        if count <= room:
            return found[:count]
        room = count


class Members(NamedTuple):
    """Components in the order of their cells, as compiled code reads them."""

    places: np.ndarray  # (d, n) [length]
    starts: np.ndarray  # (cells + 1,)
    order: np.ndarray  # (n,)


class Near(NamedTuple):
    """Which cells are near a cell, by its column and its level in it."""

    height: int  # cells of a column
    around: np.ndarray  # (columns, m), the columns around each, -1 beyond a wall
    windows: np.ndarray  # (m,), how many cells up and down
    period: np.ndarray  # (d,), edges, infinite along an axis with walls [length]


def members_of(cells: SortedCells) -> Members:
    """Return the components of sorted cells."""
    return Members(cells.places, cells.starts, cells.order)


def near_cells(grid: Grid, offsets: np.ndarray, windows: np.ndarray) -> Near:
    """Return the cells of a grid that are near each other, by its ``surroundings``."""
    period = np.where(grid.periodic, grid.box, np.inf)
    return Near(int(grid.shape[-1]), columns_around(grid, offsets), windows, period)


class Scratch(NamedTuple):
    """Room for what is near one component."""

    begins: np.ndarray  # where stretches of memory begin and end
    ends: np.ndarray
    squares: np.ndarray  # squared distances


def scratch_of(near: Near, count: int) -> Scratch:
    """Return room for ``count`` squared distances, and for all stretches of memory that are near a cell."""
    most = 3 * len(near.windows) + 1  # at most three for each column around, and the cell itself
    return Scratch(np.empty(most, np.int64), np.empty(most, np.int64), np.empty(count))


def crowded(cells: SortedCells) -> bool:
    """Return whether few cells hold nearly all components, so that a k-d tree is better."""
    members = np.diff(cells.starts).astype(np.float64)
    return float(np.sum(members * members)) > CROWDED * len(cells.order)


def columns_around(grid: Grid, offsets: np.ndarray) -> np.ndarray:
    """Return the columns (columns, m) at `offsets` (m, d - 1) from each column, -1 beyond a wall."""
    across = grid.shape[:-1]
    result = np.zeros((grid.columns, len(offsets)), dtype=np.int64)
    inside = np.ones(result.shape, dtype=np.bool_)
    where = np.indices(across.tolist()).reshape(len(across), grid.columns)
    for axis, count in enumerate(across):
        place = where[axis][:, None] + offsets[:, axis]
        if grid.periodic[axis]:
            place %= count
        inside &= (place >= 0) & (place < count)
        result = result * count + place
    result[~inside] = -1
    return result


def stretch(turn, level, window, least, height):
    """Return which cells of a column are in a window around a level and not below ``least``: from, to.

    In turn 0 those in the window itself, then the images of those below the bottom and above the top.
    """
    below, above = level - window, level + window + 1
    if turn == 0:
        return max(below, least), min(above, height)
    if turn == 1:
        return max(below + height, above, least), height
    return least, min(above - height, below)


def put_spans(begins, ends, starts, column, level, near, alike):
    """Put where the components near a cell begin and end in memory; return how many stretches there are.

    If both sets are the same (``alike``), cells of lower number are left out, and the cell itself is last.
    """
    height, around, windows, period = near
    parts = 0
    turns = 1 if math.isinf(period[-1]) else 3
    for step in range(len(windows)):
        other = around[column, step]
        if other < 0 or (alike and other < column):
            continue
        least = level + 1 if alike and other == column else 0
        for turn in range(turns):
            a, b = stretch(turn, level, windows[step], least, height)
            if a < b:
                begins[parts], ends[parts] = starts[other * height + a], starts[other * height + b]
                parts += begins[parts] < ends[parts]
    if alike:
        cell = column * height + level
        begins[parts], ends[parts] = starts[cell], starts[cell + 1]
        parts += 1
    return parts


def put_squares(squares, at, ours, i, theirs, begin, size, period):
    """Put the squared distances of component i from ``size`` others, nearest images, from ``at`` on."""
    x, edge = ours[0, i], period[0]
    for j in range(size):
        # This is the nearest image, because both lie in the box.
        r = abs(theirs[0, begin + j] - x)
        r = min(r, edge - r)
        squares[at + j] = r * r
    for axis in range(1, len(period)):
        x, edge = ours[axis, i], period[axis]
        for j in range(size):
            r = abs(theirs[axis, begin + j] - x)
            r = min(r, edge - r)
            squares[at + j] += r * r


@entry
def _list(mine, yours, near, alike, limit, found, scratch):
    """Write the pairs whose squared distance is at most `limit` to `found`; return how many there are.

    Those without room are only counted. If both sets are the same (`alike`), a pair of cells is visited from
    the lower number.
    """
    ours, starts, us = mine
    theirs, others, them = yours
    height, around, _, period = near
    begins, ends, squares = scratch
    count = 0
    for column in range(len(around)):
        for level in range(height):
            start, end = starts[column * height + level], starts[column * height + level + 1]
            if start == end:
                continue
            parts = put_spans(begins, ends, others, column, level, near, alike)
            for i in range(start, end):
                if alike:
                    begins[parts - 1] = i + 1
                for part in range(parts):
                    begin, size = begins[part], ends[part] - begins[part]
                    put_squares(squares, 0, ours, i, theirs, begin, size, period)
                    for j in range(size):
                        if squares[j] <= limit:
                            if count < len(found):
                                found[count, 0] = us[i]
                                found[count, 1] = them[begin + j]
                            count += 1
    return count
