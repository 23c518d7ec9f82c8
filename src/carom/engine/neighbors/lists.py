"""Neighbor lists (NeighborLists, Verlet lists): the sector's idea with a sphere for a sector.

A surface stays in a sphere around its reference point, its *bound*; two are listed while their bounds
overlap. At its bound, or shortly before, a component takes a new point and renews its own list only. Points
are integer fractions of the box, all axes in 64 bits: differences are exact, and to the nearest image. Cells
find neighbors; bounds of very different size have grids (*levels*) of their own, with cells as wide as their
largest.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.compiling.instructions import prefetch, prefetch_now
from carom.compiling.lanes import LANES, copy_words, pack
from carom.compiling.registry import cold
from carom.engine.neighbors.bounds import (
    EqualBounds,
)
from carom.engine.neighbors.grid import (
    Grid,
    bits,
    cell_of,
    cells_near,
    coordinate_bits,
    ends_with,
    from_reference,
    grid_coordinate,
    least_difference,
    open_window,
    speed_from_reference,
)
from carom.engine.neighbors.interface import NeighborScheme
from carom.engine.neighbors.prefetch import HUGE, leaves_first, prefetch_members, prefetch_own
from carom.engine.pair_steps import fresh_ref, named, put_newcomer, standing, stepped_ref
from carom.engine.rules import recount_ref
from carom.engine.state import aligned, filled
from carom.models.interfaces.particles import NEVER

FINE = 12  # layers across a box, which workers share, are two to this power


class NeighborLists(NeighborScheme):
    """Components by neighbor."""

    bounds: Any  # EqualBounds or UnequalBounds
    grid: Grid
    cells: np.ndarray
    """Components in each cell, (cells + 1, room) uint32; the last row is there to be read beyond the one
    before it.
    """
    members: np.ndarray  # how many each cell holds, (cells,) uint16
    grid_step: tuple  # length of one step of a reference point along each axis
    reference: np.ndarray  # reference points, (n,) uint64: steps along each axis, side by side
    refs: np.ndarray  # neighbors, list after list, uint32
    found: np.ndarray  # room for those found in the cells around one, (room,) uint32
    points: np.ndarray  # room for their reference points, (room,) uint64
    sizes: np.ndarray  # room for the radii of their bounds where these differ, (room,) float64
    newcomers: np.ndarray  # room for those newly listed, uint32
    hits: np.ndarray  # which of them are to be listed, (room,) int64
    counts: np.ndarray  # how many neighbors, (n,) uint16, or int32 where there is room for more
    steps: Any
    """How refs name the steps of pairs (:mod:`carom.engine.pair_steps`), or None where they have none."""
    window: Any  # tilts of the lattice that the lists are for (:mod:`.grid`), or None where none tilts

    def candidates(self, boundary, i, half):
        return self.refs, self.bounds.start(i), self.counts[i]

    def transit_time(self, motion, boundary, state, i, now):
        me = state.rows[i]
        slack, rate = self.bounds.skin_at(i, now)
        rr = 0.0
        b = slack * rate
        v_sq = 0.0
        for axis in range(len(self.grid_step)):
            r = from_reference(self.window, motion, self, boundary, me, self.reference[i], axis, now)
            v = speed_from_reference(self.window, motion, self, boundary, me, self.reference[i], axis, now)
            rr += r * r
            b += r * v
            v_sq += v * v
        bend = motion.bend()
        if v_sq == 0.0 and rate == 0.0 and bend == 0.0:
            return NEVER
        # No later than |r + v t| = slack - rate t, and mostly some per cent before: a root and a branch would
        # cost more than the renewals that come too early (docs/decisions/08-tried-and-left.md).
        c = max(slack * slack - rr, 0.0)
        b += slack * (root_above(v_sq) + abs(rate))
        if bend == 0.0:
            return now + c / b
        # The path has bent by bend t^2 / 2 at most: as if the slack shrank faster, by bend t / 2.
        return now + 2.0 * c / (b + np.sqrt(b * b + 4.0 * slack * bend * c))

    def must_renew(self, motion, length):
        return ends_with(self.window, motion, length)

    def cross(self, motion, boundary, state, i, now):
        count = rebuild_list(self, motion, state, i, now)
        return count >= 0, self.newcomers, 0, count

    def stages(self):
        return 3

    def prefetch_event(self, motion, boundary, state, i, step):
        if step == 0:
            prefetch_own(state, i)
            prefetch_list(self, i)
            return
        if leaves_first(state, i):
            if len(state.partner) >= HUGE:
                prefetch_cells(self, motion, state, i, step)
            return
        component = i
        ref = state.partner[i]
        if ref >= 0:
            j = boundary.index(ref)
            if step == 1:
                prefetch(state.rows, j)
                prefetch(state.crossing_time, j)
                prefetch_list(self, j)
            else:
                component = j
        if step == 1 or ref >= 0:
            prefetch_listed(self, state.rows, component)

    def prefetch_first(self, boundary, state, i):
        ref = state.partner[i]
        j = boundary.index(ref) if ref >= 0 else i
        for component in (i, j):
            start_index = self.bounds.start(component)
            prefetch_now(state.rows, component)
            prefetch_now(self.refs, start_index)
            prefetch_now(self.refs, start_index + 13)
            prefetch_now(self.reference, component)

    @cold
    def build(self, motion, boundary, state):
        if standing(self.steps):
            return True
        now = state.clock[0].now
        open_window(self.window, motion)
        self.members[:] = 0
        self.counts[:] = 0
        self.refs[:] = fresh_ref(self.steps, 0, len(self.counts))
        for i in range(len(state.partner)):
            own_class = self.bounds.size_class(i)
            new_point = reference_of(self, motion, state, i, now)
            total = gather_cells(self, i, new_point, False, new_point)
            flag_in_range(self, i, total, new_point, False, new_point)
            self.reference[i] = new_point
            entered = enter_cell(self, cell_of(self, own_class, new_point), np.uint32(i))
            if not entered or link_flagged(self, i, total) < 0:
                return False
        return True

    def put_step(self, i, j, step):
        start_index = self.bounds.start(i)
        for k in range(start_index, start_index + self.counts[i]):
            if named(self.steps, self.refs[k]) == j:
                self.refs[k] = stepped_ref(self.steps, j, step)
                break

    def recount_listed(self, rules, boundary, i, was):
        start_index = self.bounds.start(i)
        for k in range(start_index, start_index + self.counts[i]):
            recount_ref(self, rules, boundary, i, self.refs[k], was)

    def layer_of(self, i, axis):
        return grid_coordinate(self, self.reference[i], axis) >> (bits(self) - FINE)

    def prefetch_layer(self, i):
        prefetch(self.reference, i)


def make_lists(
    n: int,
    spans,
    bounds,
    grid: Grid,
    cell_capacity: int,
    refs: int,
    longest: int,
    pair_steps: Any = None,
    window: Any = None,
) -> NeighborLists:
    """Return empty lists for ``n`` components.

    Reference points are fractions of ``spans`` (d floats [length]). A cell holds ``cell_capacity``
    components, 8 at least; all lists hold ``refs`` neighbors, the longest ``longest``. ``pair_steps``
    (PairSteps, SpeciesSteps or None) says how refs name steps, ``window`` (TiltWindow or None) the tilts of
    the lattice.
    """
    nobody = n if pair_steps is None else n << pair_steps.bits
    dimension = len(spans)
    cells = int(grid.shape.prod(axis=1).sum())
    blocks = np.minimum(2 * grid.spans + 1, grid.shape).prod(axis=2).sum(axis=1)
    found_capacity = min(int(blocks.max()) * cell_capacity, n) + 2 * LANES
    return NeighborLists(
        bounds=bounds,
        grid=grid,
        cells=aligned((cells + 1) * cell_capacity, np.uint32).reshape(cells + 1, cell_capacity),
        members=filled(cells, 0, np.uint16),
        grid_step=tuple(span * 2.0 ** -coordinate_bits(dimension) for span in spans),
        reference=filled(n, 0, np.uint64),
        refs=filled(refs + LANES, nobody, np.uint32),
        found=np.zeros(found_capacity, np.uint32),
        points=np.zeros(found_capacity, np.uint64),
        sizes=np.zeros(0 if isinstance(bounds, EqualBounds) else found_capacity),
        newcomers=np.full(found_capacity + LANES, nobody, np.uint32),
        hits=np.zeros(found_capacity, np.int64),
        counts=filled(n, 0, np.uint16 if longest < 2**16 else np.int32),
        steps=pair_steps,
        window=window,
    )


def root_above(x):
    """Return the root of x and a hair or up to 6 % more: bits halved are linear between powers of four.

    The hair keeps ``b + slack root`` above zero where a component flies straight inwards from its bound.
    """
    return ((np.float64(x).view(np.int64) >> 1) + 0x1FF8000000000400).view(np.float64)


def unlink(lists, i, j):
    """Remove j from the list of i."""
    start_index = lists.bounds.start(i)
    count = lists.counts[i] - 1
    last = start_index + count
    for k in range(start_index, last):
        if named(lists.steps, lists.refs[k]) == j:
            lists.refs[k] = lists.refs[last]
            break
    lists.refs[last] = fresh_ref(lists.steps, i, len(lists.counts))
    lists.counts[i] = count


def listed_fully(lists, i):
    """Return whether the list of i is full."""
    count = lists.counts[i]
    return lists.bounds.start(i) + count == lists.bounds.start(i + 1)


def link(lists, i, j):
    """Add j to the list of i; the caller ensures that there is room."""
    count = lists.counts[i]
    lists.refs[lists.bounds.start(i) + count] = fresh_ref(lists.steps, i, j)
    lists.counts[i] = count + 1


def distance_sq(lists, point, other):
    """Return the squared distance of two reference points, or the least one where the lattice tilts."""
    rr = 0.0
    for axis in range(len(lists.grid_step)):
        r = least_difference(lists.window, lists, point, other, axis)
        rr += r * r
    return rr


def enter_cell(lists, cell, i):
    """Add i to a cell; False, and nothing done, if the cell is full."""
    last = lists.members[cell]
    if last == lists.cells.shape[1]:
        return False
    lists.cells[cell, last] = i
    lists.members[cell] += 1
    return True


def leave_cell(lists, cell, i):
    """Remove i from a cell; the last one takes its place."""
    lists.members[cell] -= 1
    last = lists.members[cell]
    for k in range(last):
        if lists.cells[cell, k] == i:
            lists.cells[cell, k] = lists.cells[cell, last]
            break


def reference_of(lists, motion, state, i, now):
    """Return the present position of i as a reference point."""
    me = state.rows[i]
    size = bits(lists)
    point = 0
    for axis in range(len(lists.grid_step)):
        x = motion.position_at(axis, me.x, me.v, now - me.t, now)
        whole = int(np.floor(x / lists.grid_step[axis])) & ((1 << size) - 1)
        point |= whole << size * axis
    return point


@cold
def rebuild_list(lists, motion, state, i, now):
    """Take a new reference point for i and renew its list; return the newcomers, -1 without room."""
    me = np.uint32(i)
    nobody = fresh_ref(lists.steps, i, len(lists.counts))
    old = lists.reference[i]
    new_point = reference_of(lists, motion, state, i, now)
    own_class = lists.bounds.size_class(i)
    leave_cell(lists, cell_of(lists, own_class, old), me)
    start_index = lists.bounds.start(i)
    end = start_index + lists.counts[i]
    kept_end = start_index
    for k in range(start_index, end):
        ref = lists.refs[k]
        j = named(lists.steps, ref)
        if distance_sq(lists, new_point, lists.reference[j]) <= lists.bounds.list_range_sq(i, j):
            lists.refs[kept_end] = ref
            kept_end += 1
        else:
            unlink(lists, j, me)
    for k in range(kept_end, end):
        lists.refs[k] = nobody
    lists.counts[i] = kept_end - start_index
    total = gather_cells(lists, i, new_point, True, old)
    flag_in_range(lists, i, total, new_point, True, old)
    lists.reference[i] = new_point
    if not enter_cell(lists, cell_of(lists, own_class, new_point), me):
        return -1
    return link_flagged(lists, i, total)


def gather_cells(lists, i, point, moved, old):
    """Put all near a reference point of i, or after a move those new, into ``found``; return how many.

    Members are copied eight at a time: cells hold a few each, and a loop over the right number would be
    mispredicted.
    """
    total = 0
    own_class = lists.bounds.size_class(i)
    for other in range(lists.bounds.class_count()):
        half, count = cells_near(
            lists, own_class, other, point, lists.bounds.max_range_sq(i, other), moved, old
        )
        for k in range(count):
            cell = lists.grid.neighbor_cells[half, k]
            members = lists.members[cell]
            for start_index in range(0, members, LANES):
                copy_words(lists.cells, cell, start_index, lists.found, total + start_index, 0, 0)
            total += members
    return total


def flag_in_range(lists, i, total, point, moved, old):
    """Mark in ``hits`` who of those found is to be listed with i, and was not where it ``moved`` from.

    What is needed is first put side by side, so that the loop is vectorized.
    """
    for k in range(0, total, LANES):
        pack(lists.reference, lists.found, k, 0, lists.points, k)
        lists.bounds.pack_bounds(lists.found, k, lists.sizes)
    for k in range(total):
        limit = lists.bounds.list_range_sq_found(i, k, lists.sizes)
        in_range = distance_sq(lists, point, lists.points[k]) <= limit
        new = distance_sq(lists, old, lists.points[k]) > limit if moved else True
        lists.hits[k] = in_range & new


def link_flagged(lists, i, total):
    """List i and the hits among those found with each other; return their number, or -1 if a list is full."""
    last = 0
    for k in range(total):  # without a branch: who is near is a coin toss for the processor
        lists.newcomers[last] = lists.found[k]
        last += lists.hits[k]
    for k in range(last):
        j = lists.newcomers[k]
        if listed_fully(lists, i) or listed_fully(lists, j):
            return -1
        link(lists, i, np.uint32(j))
        link(lists, j, np.uint32(i))
        put_newcomer(lists.steps, lists.newcomers, k, i, j)
    return last


def prefetch_list(lists, i):
    """Ask for the list of component i."""
    start_index = lists.bounds.start(i)
    prefetch(lists.refs, start_index)
    prefetch(lists.refs, start_index + 16)
    prefetch(lists.counts, i)
    prefetch(lists.reference, i)


def prefetch_listed(lists, array, i):
    """Ask for the elements of an array that belong to the neighbors of component i."""
    start_index = lists.bounds.start(i)
    for k in range(start_index, start_index + lists.counts[i]):
        prefetch(array, named(lists.steps, lists.refs[k]))


def prefetch_cells(lists, motion, state, i, step):
    """Ask for the cells that will be looked into when the list of i is renewed, or for who is in them."""
    if step == 1:
        prefetch_listed(lists, lists.reference, i)
    own_class, old = lists.bounds.size_class(i), lists.reference[i]
    point = reference_of(lists, motion, state, i, state.crossing_time[i])
    for other in range(lists.bounds.class_count()):
        half, count = cells_near(
            lists, own_class, other, point, lists.bounds.max_range_sq(i, other), True, old
        )
        for k in range(count):
            cell = lists.grid.neighbor_cells[half, k]
            if step == 1:
                prefetch(lists.members, cell)
                prefetch(lists.cells, cell * lists.cells.shape[1])
            else:
                prefetch_members(lists.reference, lists.cells, cell, lists.members[cell], i)
