"""Neighbors by sorted cells (:mod:`carom.cells`): the nearest of each particle, and pairs within a reach.

Particles with too few in reach get a larger one; a k-d tree replaces cells too full or with too many around.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from carom.cells import Grid, SortedCells
from carom.compiling.entry import entry
from carom.errors import InputError
from carom.geometry.nearby import (
    WIDE,
    crowded,
    members_of,
    near_cells,
    near_pairs,
    put_spans,
    put_squares,
    scratch_of,
)  # fmt: skip
from carom.geometry.overlaps import Geometry
from carom.theory import ball_volume

SPARE = 1.25
"""Expected number of particles in the first reach over the requested one. In a dense fluid one particle of
fifteen then has too few. With 1.5 it would be one of two hundred, but all others would examine more.
"""

FURTHER = 2.0  # volume of each later reach over that of the one before

ACROSS = 1.0 + 2.0**-10  # edge of a cell across the columns [reach]


Bonds = Callable[[slice], np.ndarray]
"""Makes the vectors (m, d) of a portion of bonds [length]."""


def pairs_within(room: Geometry, places: np.ndarray, reach: float) -> np.ndarray:
    """Return the pairs (m, 2) of places (n, d), inside the box, whose nearest images are within ``reach``."""
    pairs = None if room.tilt else near_pairs(room.box, room.periodic, places, None, reach)
    return room.near(places, reach) if pairs is None else pairs


def within(room: Geometry, places: np.ndarray, reach: float) -> tuple[np.ndarray, Bonds]:
    """Return particle and neighbor of each bond within ``reach`` [length] from both ends, and its vectors.

    In a small box, several bonds may be to images of one particle, or of the particle itself.
    """
    if reach < room.half:
        found = pairs_within(room, places, reach)
        return _of_nearest_images(room, places, np.concatenate([found, found[:, ::-1]]))
    from scipy.spatial import cKDTree

    points, who = room.images(places, reach)
    ours = cKDTree(points[: len(places)])
    near = ours.sparse_distance_matrix(cKDTree(points), reach, output_type="ndarray")
    i, j = near["i"], near["j"]
    return _of_points(points, who, i[i != j], j[i != j])


def nearest(room: Geometry, places: np.ndarray, count: int) -> tuple[np.ndarray, Bonds]:
    """Return particle and neighbor of each bond to the ``count`` nearest, (n count, 2), and its vectors.

    Bonds of a particle follow each other; equally long ones come in no order. In a small box, several may be
    to images of one particle, or of the particle itself.
    """
    n = len(places)
    if n <= count and not room.periodic.any():
        raise InputError(f"{count} neighbors are asked for, and there are {n - 1} others.")
    if n > count and not room.tilt:
        who = _nearest_images(room, places, count)
        last = np.stack([np.arange(n), who[:, -1]], axis=1)
        if room.distances(places, last).max() < room.half:
            pairs = np.stack([np.repeat(np.arange(n), count), who.ravel()], axis=1)
            return _of_nearest_images(room, places, pairs)
    from scipy.spatial import cKDTree

    reach, longest = 0.0, _first_reach(room, n, count)
    while longest > reach:
        reach = longest
        points, who = room.images(places, reach)
        if len(points) <= count:
            longest = 2.0 * reach
            continue
        lengths, found = cKDTree(points).query(points[:n], k=count + 1)
        longest = float(lengths[:, -1].max())
    return _of_points(points, who, np.repeat(np.arange(n), count), _without_self(found).ravel())


def _of_nearest_images(room: Geometry, places: np.ndarray, pairs: np.ndarray) -> tuple[np.ndarray, Bonds]:
    return pairs, lambda part: room.separations(places, pairs[part])


def _of_points(points: np.ndarray, who: np.ndarray, i: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, Bonds]:
    return np.stack([i, who[j]], axis=1), lambda part: points[j[part]] - points[i[part]]


def _first_reach(room: Geometry, n: int, count: int) -> float:
    """Return a reach [length] in which about ``count`` neighbors of each are expected."""
    volume = SPARE * (count + 1) / n * float(np.prod(room.box))
    return float(0.5 * (volume / ball_volume(len(room.box))) ** (1.0 / len(room.box)))


def _nearest_images(room: Geometry, places: np.ndarray, count: int) -> np.ndarray:
    """Return the nearest of each in a box with right angles, (n, count), by its nearest image alone."""
    n, d = places.shape
    reach = _first_reach(room, n, count)
    who = np.full((n, count), -1, dtype=np.int64)
    while (who[:, -1] < 0).any():
        grid = Grid.of(room.box, room.periodic, n, reach, ACROSS)
        offsets, windows = grid.surroundings(reach)
        cells = SortedCells.of(grid, places) if len(windows) <= WIDE else None
        if cells is None or crowded(cells):
            from scipy.spatial import cKDTree

            lacking = np.flatnonzero(who[:, -1] < 0)
            tree = cKDTree(places, boxsize=np.where(room.periodic, room.box, 0.0))
            who[lacking] = _without_self(tree.query(places[lacking], k=count + 1)[1], lacking)
            break
        near, rows = near_cells(grid, offsets, windows), np.empty((2, n), np.uint32)
        _keep(members_of(cells), near, reach * reach, who, scratch_of(near, n), np.empty((d, n)), *rows)
        reach *= FURTHER ** (1.0 / d)
    return who


def _without_self(found: np.ndarray, chosen: np.ndarray | None = None) -> np.ndarray:
    """Return what a tree found around the chosen particles, (m, count + 1), without each itself."""
    own = found == (np.arange(len(found)) if chosen is None else chosen)[:, None]
    # A particle finds itself, unless too many others are at the same position.
    own[~own.any(axis=1), -1] = True
    return np.asarray(found[~own].reshape(len(found), -1), dtype=np.int64)


@entry
def _keep(members, near, limit, who, scratch, them, rows, names):
    """Write the nearest ones where a row of ``who`` ends with -1; ``limit`` is the square of the reach.

    ``them`` (d, n) and ``rows`` (n,) have room for what is around a cell, ``names`` (n,) for that in reach.
    """
    places, starts, order = members
    height, around, _, period = near
    begins, ends, squares = scratch
    dimension, count = len(period), len(who[0])
    for column in range(len(around)):
        for level in range(height):
            start, end = starts[column * height + level], starts[column * height + level + 1]
            lacking = False
            for i in range(start, end):
                lacking = lacking or who[order[i], count - 1] < 0
            if not lacking:
                continue
            total = 0
            parts = put_spans(begins, ends, starts, column, level, near, False)
            for part in range(parts):
                begin, size = begins[part], ends[part] - begins[part]
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
                put_squares(squares, 0, places, i, them, 0, total, period)
                found = 0
                for j in range(total):
                    # No branch, as it would often be mispredicted. What is kept moves to the front.
                    square = squares[j]
                    squares[found], names[found] = square, rows[j]
                    found += int((square <= limit) & (rows[j] != i))
                if found < count:
                    continue
                for k in range(found):
                    # The number of nearer ones is the place in the row.
                    rank, square = 0, squares[k]
                    for j in range(found):
                        rank += int((squares[j] < square) | ((squares[j] == square) & (j < k)))
                    if rank < count:
                        who[mine, rank] = order[names[k]]
