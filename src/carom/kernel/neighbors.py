"""Who can meet whom next: cells, and the interface of the two neighbour schemes (``sectors`` and
``lists``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.dispatch import generic, inner


class Cells(NamedTuple):
    """A periodic grid of cells and who is in each."""

    shape: tuple
    """Cells along each axis."""
    members: np.ndarray
    """(cells, capacity) uint32."""
    counts: np.ndarray
    """(cells,) int32."""
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of the 3^d cells around one, (3^d, d) int64."""


def neighborhood(dimension: int) -> np.ndarray:
    """Return the offsets -1, 0 or 1 along each axis of the 3^d cells around one, (3^d, d) int64."""
    digits = np.stack(np.unravel_index(np.arange(3**dimension), (3,) * dimension), axis=1) - 1
    return np.ascontiguousarray(digits, dtype=np.int64)


def make_cells(shape: tuple[int, ...], capacity: int) -> Cells:
    """Return an empty grid."""
    count = int(np.prod(shape))
    return Cells(
        tuple(int(size) for size in shape),
        np.zeros((count, capacity), np.uint32),
        np.zeros(count, np.int32),
        neighborhood(len(shape)),
    )


@inner
def enter_cell(cells, cell, i):
    """Add i to a cell; False, and nothing done, if the cell is full."""
    cell = np.uint64(cell)
    count = cells.counts[cell]
    if count == cells.members.shape[1]:
        return False
    cells.members[cell, np.uint64(count)] = i
    cells.counts[cell] = count + 1
    return True


@inner
def leave_cell(cells, cell, i):
    """Remove i from a cell."""
    cell = np.uint64(cell)
    last = np.uint64(cells.counts[cell] - 1)
    for k in range(last):
        if cells.members[cell, k] == i:
            cells.members[cell, k] = cells.members[cell, last]
            break
    cells.counts[cell] = last


@generic
def candidates(neighbors, boundary, i, half):
    """Return the words of all that component i can meet before one of them has a one-component event.

    ``half`` (0 or 1) says which of two rooms to use where the words have to be put together.

    Returns
    -------
    words : uint32 array
        Holds the words; eight more can be read behind the last one, each of them a word of somebody.
    begin : int
        Where in the array they begin.
    count : int
        How many they are.
    """
    raise NotImplementedError(type(neighbors))


@generic
def transit_time(neighbors, motion, boundary, state, i, now):
    """Return the time at which component i leaves its sector (or the sphere of its list)."""
    raise NotImplementedError(type(neighbors))


@generic
def transit(neighbors, motion, boundary, state, i, now):
    """Carry component i over into its next sector (or renew its list).

    Returns
    -------
    done : bool
        False if an array is too small; everything must then be built anew.
    words, begin, count
        Those that i can meet now and could not before, as ``candidates`` returns them.
    """
    raise NotImplementedError(type(neighbors))


@generic
def wrapped(neighbors, i, axis, crossings):
    """Note that the coordinate of i was reduced by ``crossings`` boxes."""
    raise NotImplementedError(type(neighbors))


@generic
def settle(neighbors, motion, boundary, state):
    """Build the scheme from the positions at the present time; False if an array is too small for it."""
    raise NotImplementedError(type(neighbors))
