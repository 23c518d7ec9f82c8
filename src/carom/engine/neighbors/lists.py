"""Neighbour lists: the sector's idea with a sphere for a sector.

Every component has a reference point, and a sphere around it that its surface does not leave: its *bound*.
Two components are listed with each other while their bounds overlap. A component whose surface reaches its
bound takes a new reference point and renews its list; other lists are not renewed. Reference points are
fractions of the box in integers, all axes in one word of 64 bits. Their differences are exact, and are those
to the nearest image without further work.

Neighbours are found in cells. Components with bounds of very different size are kept in separate grids
(*levels*), each with cells as wide as the largest bounds in it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.columns import LANES, line_up
from carom.compiling.prefetch import prefetch
from carom.compiling.registers import STEP, copy_words
from carom.compiling.registry import inner
from carom.engine.images import index
from carom.engine.neighbors.bounds import (
    EqualBounds,
    level,
    levels,
    line_up_bounds,
    margin,
    start,
    touching,
    touching_found,
    widest,
)
from carom.engine.neighbors.grid import Grid, between, bits, cell_of, cells_near, coordinate_bits, steps
from carom.engine.neighbors.interface import candidates, settle, transit, transit_time
from carom.engine.neighbors.prefetch import (
    HUGE,
    leaves_first,
    prefetch_event,
    prefetch_members,
    prefetch_own,
    stages,
)
from carom.engine.pair_steps import fresh_word, named, put_newcomer, standing
from carom.engine.state import aligned
from carom.models.interface import NEVER, position


class Lists(NamedTuple):
    """Components by neighbour."""

    bounds: Any
    """EqualBounds, UnequalBounds or GrowingBounds."""
    grid: Grid
    cells: np.ndarray
    """Components in each cell, (cells + 1, room) uint32; the last row is there to be read beyond the one
    before it.
    """
    members: np.ndarray
    """How many each cell holds, (cells,) uint16."""
    grain: tuple
    """Length of one step of a reference point along each axis."""
    reference: np.ndarray
    """Reference points, (n,) uint64: steps along each axis, side by side."""
    words: np.ndarray
    """Neighbours, list after list, uint32."""
    found: np.ndarray
    """Room for those found in the cells around one, (room,) uint32."""
    points: np.ndarray
    """Room for their reference points, (room,) uint64."""
    sizes: np.ndarray
    """Room for the radii of their bounds where these differ, (room,) float64."""
    newcomers: np.ndarray
    """Room for those newly listed, uint32."""
    hits: np.ndarray
    """Which of them are to be listed, (room,) int64."""
    counts: np.ndarray
    """How many neighbours, (n,) uint16, or int32 where there is room for more."""
    steps: Any
    """How words name the steps of pairs (:mod:`carom.engine.pair_steps`), or None where they have none."""


def make_lists(
    n: int, spans, bounds, grid: Grid, cell_capacity: int, words: int, longest: int, steps: Any = None
) -> Lists:
    """Return empty lists.

    Parameters
    ----------
    n : int
        Components.
    spans : d floats
        Lengths that reference points are fractions of [length].
    bounds : EqualBounds, UnequalBounds or GrowingBounds
        Bounds of the components.
    grid : Grid
        The cells.
    cell_capacity : int
        Components a cell can hold, 8 at least.
    words : int
        Neighbours that all lists can hold.
    longest : int
        Neighbours that the longest of them can hold.
    steps : PairSteps or SpeciesSteps, optional
        How words name the steps of pairs.
    """
    nobody = n if steps is None else n << steps.bits
    dimension = len(spans)
    cells = int(grid.shape.prod(axis=1).sum())
    blocks = np.minimum(2 * grid.spans + 1, grid.shape).prod(axis=2).sum(axis=1)
    room = min(int(blocks.max()) * cell_capacity, n) + 2 * STEP
    return Lists(
        bounds=bounds,
        grid=grid,
        cells=aligned((cells + 1) * cell_capacity, np.uint32).reshape(cells + 1, cell_capacity),
        members=np.zeros(cells, np.uint16),
        grain=tuple(span * 2.0 ** -coordinate_bits(dimension) for span in spans),
        reference=np.zeros(n, np.uint64),
        words=np.full(words + STEP, nobody, np.uint32),
        found=np.zeros(room, np.uint32),
        points=np.zeros(room, np.uint64),
        sizes=np.zeros(0 if isinstance(bounds, EqualBounds) else room),
        newcomers=np.full(room + STEP, nobody, np.uint32),
        hits=np.zeros(room, np.int64),
        counts=np.zeros(n, np.uint16 if longest < 2**16 else np.int32),
        steps=steps,
    )


@inner
def unlist(lists, i, j):
    """Remove j from the list of i."""
    first = start(lists.bounds, i)
    count = lists.counts[i] - 1
    last = first + np.uint64(count)
    for k in range(first, last):
        if named(lists.steps, lists.words[k]) == j:
            lists.words[k] = lists.words[last]
            break
    lists.words[last] = fresh_word(lists.steps, i, len(lists.counts))
    lists.counts[i] = count


@inner
def listed_fully(lists, i):
    """Return whether the list of i is full."""
    count = np.uint64(lists.counts[i])
    return start(lists.bounds, i) + count == start(lists.bounds, i + np.uint64(1))


@inner
def enlist(lists, i, j):
    """Add j to the list of i; the caller ensures that there is room."""
    count = lists.counts[i]
    lists.words[start(lists.bounds, i) + np.uint64(count)] = fresh_word(lists.steps, i, j)
    lists.counts[i] = count + 1


@inner
def apart(lists, point, other):
    """Return the squared distance of two reference points."""
    rr = 0.0
    for axis in range(len(lists.grain)):
        r = between(lists, point, other, axis)
        rr += r * r
    return rr


@inner
def enter_cell(lists, cell, i):
    """Add i to a cell; False, and nothing done, if the cell is full."""
    last = np.uint64(lists.members[cell])
    if last == np.uint64(lists.cells.shape[1]):
        return False
    lists.cells[cell, last] = i
    lists.members[cell] += 1
    return True


@inner
def leave_cell(lists, cell, i):
    """Remove i from a cell; the last one takes its place."""
    lists.members[cell] -= 1
    last = np.uint64(lists.members[cell])
    for k in range(last):
        if lists.cells[cell, k] == i:
            lists.cells[cell, k] = lists.cells[cell, last]
            break


@candidates.register
def _(neighbors: Lists, boundary, i, half):
    return neighbors.words, start(neighbors.bounds, i), np.int64(neighbors.counts[i])


@inner
def refer(lists, motion, state, i, now):
    """Return the present position of i as a reference point."""
    row = state.rows[i]
    size = bits(lists)
    point = np.uint64(0)
    for axis in range(len(lists.grain)):
        x = position(motion, axis, row.x[axis], row.v[axis], now - row.t)
        whole = np.int64(np.floor(x / lists.grain[axis])) & ((np.int64(1) << size) - 1)
        point |= np.uint64(whole) << np.uint64(size * axis)
    return point


@transit_time.register
def _(neighbors: Lists, motion, boundary, state, i, now):
    row = state.rows[i]
    room, rate = margin(neighbors.bounds, i, now)
    rr = 0.0
    b = room * rate
    a = -rate * rate
    for axis in range(len(neighbors.grain)):
        v = np.float64(row.v[axis])
        r = (
            position(motion, axis, row.x[axis], v, now - row.t)
            - steps(neighbors, neighbors.reference[i], axis) * neighbors.grain[axis]
        )
        r -= boundary.edges[axis] * np.rint(r * boundary.inverse[axis])
        rr += r * r
        b += r * v
        a += v * v
    if a == 0.0 and rate == 0.0:
        return NEVER
    # The outward root of |r + v t| = room - rate t, in the form that does not cancel for either sign of b.
    c = max(room * room - rr, 0.0)
    root = np.sqrt(max(b * b + a * c, 0.0))
    if b > 0.0:
        return now + c / (b + root)
    return now + (root - b) / a if a > 0.0 else now


@transit.register
def _(neighbors: Lists, motion, boundary, state, i, now):
    count = renew(neighbors, motion, state, i, now)
    return count >= 0, neighbors.newcomers, np.uint64(0), count


@inner
def renew(lists, motion, state, i, now):
    """Take a new reference point for i and bring its list, and it in the others' lists, up to date.

    Returns the number of newcomers, or -1 if an array is too small.
    """
    me = np.uint32(i)
    nobody = fresh_word(lists.steps, i, len(lists.counts))
    old = lists.reference[i]
    fresh = refer(lists, motion, state, i, now)
    own = level(lists.bounds, i)
    leave_cell(lists, cell_of(lists, own, old), me)
    first = start(lists.bounds, i)
    end = first + np.uint64(lists.counts[i])
    kept = first
    for k in range(first, end):
        word = lists.words[k]
        j = named(lists.steps, word)
        if apart(lists, fresh, lists.reference[np.uint64(j)]) <= touching(lists.bounds, i, np.uint64(j)):
            lists.words[kept] = word
            kept += np.uint64(1)
        else:
            unlist(lists, np.uint64(j), me)
    for k in range(kept, end):
        lists.words[k] = nobody
    lists.counts[i] = kept - first
    total = look_around(lists, i, fresh, True, old)
    mark_hits(lists, i, total, fresh, True, old)
    lists.reference[i] = fresh
    if not enter_cell(lists, cell_of(lists, own, fresh), me):
        return np.int64(-1)
    return enlist_hits(lists, i, total)


@inner
def look_around(lists, i, point, moved, old):
    """Put all in the cells around a reference point of component i into ``found`` and return how many they
    are; if it has ``moved`` there from ``old``, those at least who are new to it.

    Members are copied eight at a time, whether so many are there or not: cells hold a few each, and a loop
    over the right number would be mispredicted at every one.
    """
    total = np.uint64(0)
    own = level(lists.bounds, i)
    for other in range(np.uint64(levels(lists.bounds))):
        half, count = cells_near(lists, own, other, point, widest(lists.bounds, i, other), moved, old)
        for k in range(count):
            cell = np.uint64(lists.grid.near[half, k])
            members = np.uint64(lists.members[cell])
            for begin in range(np.uint64(0), members, np.uint64(STEP)):
                copy_words(
                    lists.cells,
                    np.int64(cell),
                    np.int64(begin),
                    lists.found,
                    np.int64(total + begin),
                    np.int64(0),
                    np.int64(0),
                )
            total += members
    return total


@inner
def mark_hits(lists, i, total, point, moved, old):
    """Mark in ``hits`` who of those found is to be listed with component i at a reference point, and was not
    where it has ``moved`` from.

    What is needed of those found is first put side by side: the loop is then vectorised.
    """
    for k in range(0, np.int64(total), LANES):
        line_up(lists.reference, lists.found, k, np.int64(0), lists.points, k)
        line_up_bounds(lists.bounds, lists.found, k, lists.sizes)
    for k in range(total):
        limit = touching_found(lists.bounds, i, k, lists.sizes)
        near = apart(lists, point, lists.points[k]) <= limit
        new = apart(lists, old, lists.points[k]) > limit if moved else True
        lists.hits[k] = np.int64(near & new)


@inner
def enlist_hits(lists, i, total):
    """List i and the hits among those found with each other; return their number, or -1 if a list is full."""
    last = np.uint64(0)
    for k in range(total):  # without a branch: who is near is a coin toss for the processor
        lists.newcomers[last] = lists.found[k]
        last += np.uint64(lists.hits[k])
    for k in range(last):
        j = np.uint64(lists.newcomers[k])
        if listed_fully(lists, i) or listed_fully(lists, j):
            return np.int64(-1)
        enlist(lists, i, np.uint32(j))
        enlist(lists, j, np.uint32(i))
        put_newcomer(lists.steps, lists.newcomers, k, i, j)
    return np.int64(last)


@inner
def prefetch_list(lists, i):
    """Ask for the list of component i."""
    begin = np.int64(start(lists.bounds, i))
    prefetch(lists.words, begin)
    prefetch(lists.words, begin + 16)
    prefetch(lists.counts, np.int64(i))
    prefetch(lists.reference, np.int64(i))


@inner
def prefetch_listed(lists, array, i):
    """Ask for the elements of an array that belong to the neighbours of component i."""
    begin = start(lists.bounds, i)
    for k in range(begin, begin + np.uint64(lists.counts[i])):
        prefetch(array, np.int64(named(lists.steps, lists.words[k])))


@stages.register
def _(neighbors: Lists):
    return 3


@prefetch_event.register
def _(neighbors: Lists, motion, boundary, state, i, step):
    if step == 0:
        prefetch_own(state, i)
        prefetch_list(neighbors, i)
        return
    if leaves_first(state, i):
        if len(state.partner) >= HUGE:
            prefetch_cells(neighbors, motion, state, i, step)
        return
    who = np.int64(i)
    word = np.int64(state.partner[i])
    if word >= 0:
        j = np.int64(index(boundary, word))
        if step == 1:
            prefetch(state.rows, j)
            prefetch(state.leave, j)
            prefetch_list(neighbors, np.uint64(j))
        else:
            who = j
    if step == 1 or word >= 0:
        prefetch_listed(neighbors, state.rows, np.uint64(who))


@inner
def prefetch_cells(lists, motion, state, i, step):
    """Ask for the cells that will be looked into when the list of i is renewed, or for who is in them."""
    if step == 1:
        prefetch_listed(lists, lists.reference, i)
    own, old = level(lists.bounds, i), lists.reference[i]
    point = refer(lists, motion, state, i, state.leave[i])
    for other in range(np.uint64(levels(lists.bounds))):
        half, count = cells_near(lists, own, other, point, widest(lists.bounds, i, other), True, old)
        for k in range(count):
            cell = np.uint64(lists.grid.near[half, k])
            if step == 1:
                prefetch(lists.members, np.int64(cell))
                prefetch(lists.cells, np.int64(cell) * lists.cells.shape[1])
            else:
                prefetch_members(lists.reference, lists.cells, cell, np.int64(lists.members[cell]), i)


@settle.register
def _(neighbors: Lists, motion, boundary, state):
    if standing(neighbors.steps):
        return True
    now = state.clock[0].now
    neighbors.members[:] = 0
    neighbors.counts[:] = 0
    neighbors.words[:] = fresh_word(neighbors.steps, np.uint64(0), len(neighbors.counts))
    for i in range(np.uint64(len(state.partner))):
        own = level(neighbors.bounds, i)
        fresh = refer(neighbors, motion, state, i, now)
        total = look_around(neighbors, i, fresh, False, fresh)
        mark_hits(neighbors, i, total, fresh, False, fresh)
        neighbors.reference[i] = fresh
        entered = enter_cell(neighbors, cell_of(neighbors, own, fresh), np.uint32(i))
        if not entered or enlist_hits(neighbors, i, total) < 0:
            return False
    return True
