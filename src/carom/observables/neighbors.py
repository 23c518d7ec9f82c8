"""Neighbors by sorted cells (:mod:`carom.cells`): the nearest of each particle, and pairs within a reach.

Particles with too few in reach get a larger one; a k-d tree replaces cells too full or with too many around.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from carom.cells import Grid, SortedCells
from carom.errors import InputError
from carom.jit import compiled
from carom.scene.nearby import WIDE, columns_around, crowded, near_pairs, put_spans, put_squares
from carom.scene.overlaps import Room
from carom.theory import ball_volume

SPARE = 1.25
"""Expected number of particles in the first reach over the requested one. In a dense fluid one particle of
fifteen then has too few. With 1.5 it would be one of two hundred, but all others would examine more.
"""

FURTHER = 2.0  # volume of each later reach over that of the one before

ACROSS = 1.0 + 2.0**-10  # edge of a cell across the columns [reach]


def pairs_within(room: Room, places: np.ndarray, reach: float) -> np.ndarray:
    """Return the pairs (m, 2) of places (n, d), inside the box, at most ``reach`` [length] apart."""
    pairs = None if room.tilt else near_pairs(room.box, room.periodic, places, None, reach)
    return room.near(places, reach) if pairs is None else pairs


def nearest(room: Room, places: np.ndarray, count: int) -> np.ndarray:
    """Return the ``count`` nearest particles of each, by their images, (n, count); equal ones in no order."""
    n, d = places.shape
    if n <= count:
        raise InputError(f"{count} neighbors are asked for, and there are {n - 1} others.")
    if room.tilt:
        return _in_a_tilted_cell(room, places, count)
    volume = SPARE * (count + 1) / n * float(np.prod(room.box))
    who = np.full((n, count), -1, dtype=np.int64)
    while (who[:, -1] < 0).any():
        reach = 0.5 * (volume / ball_volume(d)) ** (1.0 / d)
        grid = Grid.of(room.box, room.periodic, n, reach, ACROSS)
        offsets, windows = grid.surroundings(reach)
        cells = SortedCells.of(grid, places) if len(windows) <= WIDE else None
        if cells is None or crowded(cells):
            lacking = np.flatnonzero(who[:, -1] < 0)
            who[lacking] = _by_tree(room, places, lacking, count)
            break
        _compiled()(
            cells.places,
            cells.starts,
            cells.order,
            int(grid.shape[-1]),
            columns_around(grid, offsets),
            windows,
            np.where(grid.periodic, grid.box, math.inf),
            reach * reach,
            who,
        )
        volume *= FURTHER
    return who


def _in_a_tilted_cell(room: Room, places: np.ndarray, count: int) -> np.ndarray:
    """Return the nearest of all particles in a sheared box, from the pairs within a reach that grows."""
    n, d = places.shape
    volume = SPARE * (count + 1) / n * float(np.prod(room.box))
    while True:
        found = room.near(places, (volume / ball_volume(d)) ** (1.0 / d) * 0.5)
        i, j = np.concatenate([found, found[:, ::-1]]).T
        if np.bincount(i, minlength=n).min() >= count:
            break
        volume *= FURTHER
    order = np.lexsort((np.tile(room.distances(places, found), 2), i))
    first = np.searchsorted(i[order], np.arange(n))
    return np.asarray(j[order][first[:, None] + np.arange(count)], dtype=np.int64)


def _by_tree(room: Room, places: np.ndarray, chosen: np.ndarray, count: int) -> np.ndarray:
    """Return the nearest of the chosen particles by a k-d tree."""
    from scipy.spatial import cKDTree

    tree = cKDTree(places, boxsize=np.where(room.periodic, room.box, 0.0))
    _, found = tree.query(places[chosen], k=count + 1)
    # A component finds itself, unless too many others are at the same position.
    own = found == chosen[:, None]
    own[~own.any(axis=1), -1] = True
    return np.asarray(found[~own].reshape(len(chosen), count), dtype=np.int64)


@lru_cache(maxsize=1)
def _compiled() -> Any:
    """Return the compiled :func:`_keep`."""
    from numba import types

    integers, table = types.int64[::1], types.int64[:, ::1]
    return compiled(
        _keep,
        types.void(
            *(types.float64[:, ::1], integers, integers, types.int64),
            *(table, integers, types.float64[::1], types.float64, table),
        ),
    )


def _keep(places, starts, order, height, around, windows, period, limit, who):
    """Write the nearest ones where a row of ``who`` ends with -1; ``limit`` is the square of the reach."""
    dimension, count = period.size, who.shape[1]
    # First the components around a cell; then, for one component, squared distances and those in reach.
    them, rows = np.empty((dimension, order.size)), np.empty(order.size, np.uint32)
    squares, near, names = np.empty(order.size), np.empty(order.size), np.empty(order.size, np.uint32)
    begins = np.empty(3 * windows.size, np.int64)
    ends = np.empty(3 * windows.size, np.int64)
    for column in range(around.shape[0]):
        for level in range(height):
            start, end = starts[column * height + level], starts[column * height + level + 1]
            lacking = False
            for i in range(start, end):
                lacking = lacking or who[order[i], count - 1] < 0
            if not lacking:
                continue
            total = np.uint64(0)
            parts = put_spans(begins, ends, starts, column, level, around, windows, False, height, period)
            for part in range(parts):
                begin, size = np.uint64(begins[part]), np.uint64(ends[part] - begins[part])
                for axis in range(dimension):
                    for j in range(size):
                        them[axis, total + j] = places[axis, begin + j]
                for j in range(size):
                    rows[total + j] = begin + j
                total += size
            for i in range(start, end):
                mine = order[i]
                if who[mine, count - 1] >= 0:
                    continue
                put_squares(squares, np.uint64(0), places, i, them, np.uint64(0), total, period)
                found = np.uint64(0)
                for j in range(total):
                    # No branch, as it would often be mispredicted.
                    near[found], names[found] = squares[j], rows[j]
                    found += np.uint64((squares[j] <= limit) & (rows[j] != i))
                if found < count:
                    continue
                for k in range(found):
                    # The number of nearer ones is the place in the row.
                    rank, square = np.uint64(0), near[k]
                    for j in range(found):
                        rank += np.uint64((near[j] < square) | ((near[j] == square) & (j < k)))
                    if rank < count:
                        who[mine, rank] = order[names[k]]
