"""Neighbour lists: the sector's idea with a sphere for a sector.

Every component has a reference point. Two components are listed with each other while their reference points
are within ``reach``; a component that has moved ``margin = (reach - sigma) / 2`` away from its own takes a
new one and renews its list, alone. Reference points are fractions of the box in 32-bit integers: differences
then are the nearest image's by themselves, and exact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.constants import NEVER
from carom.kernel.dispatch import inner
from carom.kernel.lookahead import ask_candidates, ask_rows, prefetch
from carom.kernel.motion import position
from carom.kernel.neighbors import candidates, neighborhood, settle, transit, transit_time, wrapped
from carom.kernel.state import aligned

GRAIN = 2.0**-32
"""Reference points lie on a grid of this fraction of the box."""


STEP = 8
"""Members of a cell copied in one go."""


class Lists(NamedTuple):
    """Components by neighbour."""

    shape: tuple
    """Cells along each axis."""
    cells: np.ndarray
    """What each cell holds, (cells, d + 1, room) uint32: components and, beside them, their reference
    points.
    """
    members: np.ndarray
    """How many each cell holds, (cells,) int32."""
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of the 3^d cells around one, (3^d, d) int64."""
    grain: tuple
    """Length of one step of a reference point along each axis."""
    reach: float
    """Square of the distance of reference points up to which two components are listed."""
    margin: float
    """Square of the distance from its reference point that a component may reach."""
    reference: np.ndarray
    """Reference points, (n, d) uint32."""
    words: np.ndarray
    """Neighbours, (n * capacity,) uint32, each list padded with the ghost."""
    capacity: int
    """Room of one list."""
    fresh: np.ndarray
    """Room for one reference point that is not in force yet, (d,) uint32."""
    found: np.ndarray
    """Room for those found in the cells around one, as the cells hold them, (d + 1, room) uint32."""
    stale: np.ndarray
    """Room for the reference point that was in force before, (d,) uint32."""
    newcomers: np.ndarray
    """Room for those newly listed, uint32."""
    hits: np.ndarray
    """Which of them are to be listed, (room,) int64."""
    counts: np.ndarray
    """How many neighbours, (n,) int32."""


def make_lists(n: int, edges, shape, cell_capacity: int, reach: float, margin: float, capacity: int) -> Lists:
    """Return empty lists: reference points within ``reach``, flights up to ``margin`` [length]."""
    dimension = len(shape)
    count = int(np.prod(shape))
    room = -(-cell_capacity // STEP) * STEP
    around = 3**dimension * room + STEP
    return Lists(
        shape=tuple(int(size) for size in shape),
        cells=aligned(count * (dimension + 1) * room, np.uint32).reshape(count, dimension + 1, room),
        members=np.zeros(count, np.int32),
        digits=neighborhood(dimension),
        grain=tuple(edge * GRAIN for edge in edges),
        reach=reach * reach,
        margin=margin * margin,
        reference=np.zeros((n, dimension), np.uint32),
        words=np.full(n * capacity, n, np.uint32),
        counts=np.zeros(n, np.int32),
        capacity=capacity,
        fresh=np.zeros(dimension, np.uint32),
        found=np.zeros((dimension + 1, around), np.uint32),
        stale=np.zeros(dimension, np.uint32),
        newcomers=np.zeros(around + STEP, np.uint32),
        hits=np.zeros(around, np.int64),
    )


@inner
def wrap32(difference):
    """Return an integer difference of two 32-bit fractions as the nearest image's, in [-2^31, 2^31)."""
    return ((np.int64(difference) + 2147483648) & 4294967295) - 2147483648


@inner
def cell_of(lists, point):
    """Return the cell of a reference point."""
    cell = np.int64(0)
    for axis in range(len(lists.grain)):
        size = lists.shape[axis]
        cell = cell * size + ((np.int64(point[axis]) * size) >> 32)
    return np.uint64(cell)


@inner
def cell_near(lists, point, code):
    """Return the cell at offset ``code`` from that of a reference point."""
    cell = np.int64(0)
    for axis in range(len(lists.grain)):
        size = lists.shape[axis]
        place = ((np.int64(point[axis]) * size) >> 32) + lists.digits[code, axis]
        place = size - 1 if place < 0 else (0 if place >= size else place)
        cell = cell * size + place
    return np.uint64(cell)


@inner
def unlist(lists, i, j):
    """Remove j from the list of i."""
    first = i * np.uint64(lists.capacity)
    count = lists.counts[i] - 1
    last = first + np.uint64(count)
    for k in range(first, last):
        if lists.words[k] == j:
            lists.words[k] = lists.words[last]
            break
    lists.words[last] = len(lists.counts)
    lists.counts[i] = count


@inner
def enlist(lists, i, j):
    """Add j to the list of i; the caller has seen to the room."""
    count = lists.counts[i]
    lists.words[i * np.uint64(lists.capacity) + np.uint64(count)] = j
    lists.counts[i] = count + 1


@inner
def apart(lists, point, j):
    """Return the squared distance of a reference point from that of j."""
    rr = 0.0
    for axis in range(len(lists.grain)):
        r = wrap32(np.int64(point[axis]) - np.int64(lists.reference[j, axis])) * lists.grain[axis]
        rr += r * r
    return rr


@inner
def enter_cell(lists, cell, i, point):
    """Add i with its reference point to a cell; False, and nothing done, if the cell is full."""
    last = np.uint64(lists.members[cell])
    if last == np.uint64(lists.cells.shape[2]):
        return False
    lists.cells[cell, 0, last] = i
    for axis in range(len(lists.grain)):
        lists.cells[cell, axis + 1, last] = point[axis]
    lists.members[cell] += 1
    return True


@inner
def leave_cell(lists, cell, i):
    """Remove i from a cell; the last one takes its place."""
    lists.members[cell] -= 1
    last = np.uint64(lists.members[cell])
    for k in range(last):
        if lists.cells[cell, 0, k] == i:
            for row in range(len(lists.grain) + 1):
                lists.cells[cell, row, k] = lists.cells[cell, row, last]
            break


@candidates.register
def _(neighbors: Lists, boundary, i, half):
    return neighbors.words, i * np.uint64(neighbors.capacity), (np.int64(neighbors.counts[i]) + 7) & ~7


@inner
def refer(lists, motion, state, i, now):
    """Put the present position of i, as a reference point, into ``fresh``."""
    row = state.rows[i]
    for axis in range(len(lists.grain)):
        x = position(motion, axis, row.x[axis], row.v[axis], now - row.t)
        lists.fresh[axis] = np.int64(np.floor(x / lists.grain[axis])) & 4294967295


@transit_time.register
def _(neighbors: Lists, motion, boundary, state, i, now):
    row = state.rows[i]
    rr = 0.0
    rv = 0.0
    vv = 0.0
    for axis in range(len(neighbors.grain)):
        v = row.v[axis]
        r = (
            position(motion, axis, row.x[axis], v, now - row.t)
            - neighbors.reference[i, axis] * neighbors.grain[axis]
        )
        r -= boundary.edges[axis] * np.rint(r * boundary.inverse[axis])
        rr += r * r
        rv += r * v
        vv += v * v
    if vv == 0.0:
        return NEVER
    # The outward root of |r + v t|^2 = margin^2, in the form that does not cancel for either sign of r.v.
    c = max(neighbors.margin - rr, 0.0)
    root = np.sqrt(rv * rv + vv * c)
    t = c / (rv + root) if rv > 0.0 else (root - rv) / vv
    return now + t


@transit.register
def _(neighbors: Lists, motion, boundary, state, i, now):
    count = renew(neighbors, motion, state, i, now)
    return count >= 0, neighbors.newcomers, np.uint64(0), (count + 7) & ~7


@inner
def renew(lists, motion, state, i, now):
    """Take a new reference point for i and bring its list, and it in the others' lists, up to date.

    Returns the number of newcomers, or -1 if an array is too small.
    """
    me = np.uint32(i)
    nobody = np.uint32(len(lists.counts))
    old = lists.stale
    fresh = lists.fresh
    for axis in range(len(lists.grain)):
        old[axis] = lists.reference[i, axis]
    refer(lists, motion, state, i, now)
    leave_cell(lists, cell_of(lists, old), me)
    first = i * np.uint64(lists.capacity)
    end = first + np.uint64(lists.counts[i])
    kept = first
    for k in range(first, end):
        j = lists.words[k]
        if apart(lists, fresh, np.uint64(j)) <= lists.reach:
            lists.words[kept] = j
            kept += np.uint64(1)
        else:
            unlist(lists, np.uint64(j), me)
    for k in range(kept, end):
        lists.words[k] = nobody
    lists.counts[i] = kept - first
    total = look_around(lists, fresh)
    for k in range(total):
        lists.hits[k] = np.int64(
            (beside(lists, fresh, k) <= lists.reach) & (beside(lists, old, k) > lists.reach)
        )
    for axis in range(len(lists.grain)):
        lists.reference[i, axis] = fresh[axis]
    if not enter_cell(lists, cell_of(lists, fresh), me, fresh):
        return np.int64(-1)
    return enlist_hits(lists, i, total)


@inner
def look_around(lists, point):
    """Put all in the 3^d cells around a reference point into ``found`` and return how many they are.

    Members are copied eight at a time, whether so many are there or not: cells hold a few each, and a loop
    over the right number would be mispredicted at every one.
    """
    total = np.uint64(0)
    for code in range(np.uint64(len(lists.digits))):
        cell = cell_near(lists, point, code)
        count = np.uint64(lists.members[cell])
        for start in range(np.uint64(0), count, np.uint64(STEP)):
            for row in range(len(lists.grain) + 1):
                for k in range(np.uint64(STEP)):
                    lists.found[row, total + start + k] = lists.cells[cell, row, start + k]
        total += count
    return total


@inner
def beside(lists, point, k):
    """Return the squared distance of a reference point from that of the k-th found."""
    rr = 0.0
    for axis in range(len(lists.grain)):
        r = wrap32(np.int64(point[axis]) - np.int64(lists.found[axis + 1, k])) * lists.grain[axis]
        rr += r * r
    return rr


@inner
def enlist_hits(lists, i, total):
    """List i and the hits among those found with each other; return their number, or -1 if a list is full."""
    last = np.uint64(0)
    for k in range(total):  # without a branch: who is near is a coin toss for the processor
        lists.newcomers[last] = lists.found[0, k]
        last += np.uint64(lists.hits[k])
    for k in range(np.uint64(STEP)):
        lists.newcomers[last + k] = len(lists.counts)
    for k in range(last):
        j = lists.newcomers[k]
        if lists.counts[i] == lists.capacity or lists.counts[j] == lists.capacity:
            return np.int64(-1)
        enlist(lists, i, j)
        enlist(lists, np.uint64(j), np.uint32(i))
    return np.int64(last)


@ask_candidates.register
def _(neighbors: Lists, i):
    begin = np.int64(i) * neighbors.capacity
    prefetch(neighbors.words, begin)
    prefetch(neighbors.words, begin + 16)
    prefetch(neighbors.counts, np.int64(i))


@ask_rows.register
def _(neighbors: Lists, rows, i):
    begin = i * np.uint64(neighbors.capacity)
    for k in range(begin, begin + np.uint64(neighbors.counts[i])):
        prefetch(rows, np.int64(neighbors.words[k]))


@wrapped.register
def _(neighbors: Lists, i, axis, crossings):
    return None


@settle.register
def _(neighbors: Lists, motion, boundary, state):
    now = state.clock[0].now
    neighbors.members[:] = 0
    neighbors.counts[:] = 0
    neighbors.words[:] = len(neighbors.counts)
    fresh = neighbors.fresh
    for i in range(np.uint64(len(state.partner))):
        refer(neighbors, motion, state, i, now)
        total = look_around(neighbors, fresh)
        for k in range(total):
            neighbors.hits[k] = np.int64(beside(neighbors, fresh, k) <= neighbors.reach)
        for axis in range(len(neighbors.grain)):
            neighbors.reference[i, axis] = fresh[axis]
        entered = enter_cell(neighbors, cell_of(neighbors, fresh), np.uint32(i), fresh)
        if not entered or enlist_hits(neighbors, i, total) < 0:
            return False
    return True
