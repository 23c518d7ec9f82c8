"""Sectors: the paper's cells, at least a diameter wide; a component looks into the 3^d around its own.

Elsewhere a cell list (CellList).
"""

from __future__ import annotations

import numpy as np

from carom.compiling.instructions import prefetch
from carom.compiling.lanes import LANES, copy_words, replace_words
from carom.compiling.registry import cold
from carom.engine.neighbors.interface import NeighborScheme
from carom.engine.neighbors.prefetch import leaves_first, prefetch_members, prefetch_own
from carom.engine.state import aligned, filled
from carom.models.interfaces.particles import NEVER

PREFETCH_FROM = 50_000  # components from which on it pays to ask for sectors ahead of time


class Sectors(NeighborScheme):
    """Components by sector."""

    shape: tuple
    """Sectors along each axis."""
    sides: tuple
    """Sides of a sector [length]."""
    slacks: tuple
    """How far the largest component may be beyond the faces of its sector along each axis [length]."""
    extra_slack: np.ndarray | None
    """How much further each component may be where there is slack, (n + 1,) float32, or None where all are
    equal [length].
    """
    members: np.ndarray
    """Who is in each sector, and in the last column how many, (sectors, room) uint32."""
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of the 3^d sectors around one, (3^d, d) int64."""
    cell: np.ndarray
    """Sector of each component along each axis, (n + 1, d) int32; the padding row has one, too."""
    wraps: np.ndarray
    """Boxes from the component's position, which is not wrapped in flight, to that sector, (n + 1, d)
    int32.
    """
    exit_face: np.ndarray
    """Face through which each component leaves its sector: twice the axis, plus one for the upper, (n,)
    uint8.
    """
    ways: np.ndarray
    """Difference of their numbers from that of the one between them, but across a face of the box, (3^d,)
    int64.
    """
    moves: np.ndarray
    """The same of the neighbor through each face, (2 d,) int64."""
    faces: np.ndarray
    """Neighboring sectors that come into view when a component moves down or up along an axis, (2 d, 3^(d
    - 1)) int64.
    """
    neighbor_cells: np.ndarray
    """Room for the numbers of sectors that are looked into, or of rows of them, (3^(d - 1),) int64."""
    refs: np.ndarray
    """Room for the candidates of two components, uint32."""

    def candidates(self, boundary, i, half):
        neighbor_cells = self.neighbor_cells
        start_index = half * (len(self.refs) // 2)
        total = start_index
        count, below, cell, above = neighbor_rows(self, i)
        if narrow(self):
            for row in range(count):
                base, code = neighbor_cells[row], 3 * row
                total += copy_members(self, boundary, base + below, code, total)
                total += copy_members(self, boundary, base + cell, code + 1, total)
                total += copy_members(self, boundary, base + above, code + 2, total)
        else:
            for number in range(3 * count):
                third = number // 3
                digit = number - 3 * third
                way = below if digit == 0 else (cell if digit == 1 else above)
                total += copy_all_members(self, boundary, neighbor_cells[third] + way, number, total)
        return self.refs, start_index, total - start_index

    def transit_time(self, motion, boundary, state, i, now):
        me = state.rows[i]
        best = NEVER
        exit_face = 0
        for axis in range(len(self.sides)):
            cell, side = unwrapped(self, i, axis), self.sides[axis]
            beyond = slack(self.extra_slack, self, i, axis)
            t, up = motion.exit_time_at(axis, me, now, side * cell - beyond, side * (cell + 1) + beyond)
            exit_face = 2 * axis + up if t < best else exit_face
            best = min(t, best)
        self.exit_face[i] = exit_face
        return now + best

    def rebin(self, motion, boundary, state, i, now):
        me = state.rows[i]
        new = 0
        changed = False
        for axis in range(len(self.sides)):
            v = np.float64(me.v[axis])
            x = motion.position_at(axis, me.x, me.v, now - me.t, now)
            way = best_cell(self, i, axis, x, v)
            new = new * self.shape[axis] + wrap(self, axis, self.cell[i, axis] + way)
            changed |= way != 0
        if not changed or not enter(self, new, np.uint32(i)):
            return
        remove_member(self, sector_of(self, i), np.uint32(i))
        for axis in range(len(self.sides)):
            v = np.float64(me.v[axis])
            x = motion.position_at(axis, me.x, me.v, now - me.t, now)
            move(self, i, axis, best_cell(self, i, axis, x, v))

    def cross(self, motion, boundary, state, i, now):
        exit_face = int(self.exit_face[i])
        axis = exit_face >> 1
        old = sector_of(self, i)
        move(self, i, axis, 2 * (exit_face & 1) - 1)
        new = sector_of(self, i)
        total = 0
        done = True
        if new != old:  # one sector along this axis is its own neighbor
            done = enter(self, new, np.uint32(i))
            if done:
                remove_member(self, old, np.uint32(i))
        count = neighbor_rows_ahead(self, i, exit_face, new)
        if narrow(self):
            for k in range(count):
                total += copy_members(self, boundary, self.neighbor_cells[k], self.faces[exit_face, k], total)
        else:
            for k in range(count):
                total += copy_all_members(
                    self, boundary, self.neighbor_cells[k], self.faces[exit_face, k], total
                )
        return done, self.refs, 0, total

    def stages(self):
        return 4

    def prefetch_event(self, motion, boundary, state, i, step):
        if step == 0:
            prefetch_own(state, i)
            prefetch_cell(self, i)
            prefetch(self.exit_face, i)
            return
        if len(state.partner) < PREFETCH_FROM:
            return
        ref = state.partner[i]
        if leaves_first(state, i):
            if step < 3:
                prefetch_ahead(self, state, i, step)
        elif ref >= 0:
            prefetch_both(self, motion, boundary, state, i, ref, step)
        elif step < 3:
            prefetch_around(self, state, i, sector_of(self, i), step)

    def on_wrap(self, i, axis, crossings):
        self.wraps[i, axis] -= int(crossings)

    @cold
    def build(self, motion, boundary, state):
        now = state.clock[0].now
        self.members[:, self.members.shape[1] - 1] = 0
        for i in range(len(state.partner)):
            me = state.rows[i]
            for axis in range(len(self.sides)):
                x = motion.position_at(axis, me.x, me.v, now - me.t, now)
                cell = int(np.floor(x / self.sides[axis]))
                wraps = cell // self.shape[axis]
                self.cell[i, axis] = cell - wraps * self.shape[axis]
                self.wraps[i, axis] = wraps
            if not enter(self, sector_of(self, i), np.uint32(i)):
                return False
        return True

    def layer_of(self, i, axis):
        return self.cell[i, axis]

    def prefetch_layer(self, i):
        prefetch_cell(self, i)


def make_sectors(n: int, edges, shape, capacity: int, slacks, extra_slack=None) -> Sectors:
    """Return empty sectors, of ``capacity``, whose members may be beyond faces by their ``slacks``."""
    dimension = len(shape)
    cell_size = -(-(capacity + 1) // LANES) * LANES
    digits = np.stack(np.unravel_index(np.arange(3**dimension), (3,) * dimension), axis=1) - 1
    strides = np.array([int(np.prod(shape[axis + 1 :])) for axis in range(dimension)])
    return Sectors(
        shape=tuple(int(size) for size in shape),
        sides=tuple(edge / size for edge, size in zip(edges, shape, strict=True)),
        slacks=tuple(slacks),
        extra_slack=extra_slack,
        members=aligned(int(np.prod(shape)) * cell_size, np.uint32).reshape(-1, cell_size),
        digits=np.ascontiguousarray(digits, dtype=np.int64),
        ways=np.ascontiguousarray(digits @ strides, dtype=np.int64),
        moves=np.ravel(np.outer(strides, (-1, 1))),
        cell=filled((n + 1, dimension), 0, np.int32),
        wraps=filled((n + 1, dimension), 0, np.int32),
        exit_face=filled(n, 0, np.uint8),
        faces=np.array([np.flatnonzero(digits[:, k // 2] == 2 * (k % 2) - 1) for k in range(2 * dimension)]),
        neighbor_cells=np.zeros(3 ** (dimension - 1), np.int64),
        refs=np.zeros(2 * (3**dimension * cell_size + LANES), np.uint32),
    )


def sector_of(sectors, i):
    """Return the sector that holds component i."""
    cell = 0
    for axis in range(len(sectors.sides)):
        cell = cell * sectors.shape[axis] + sectors.cell[i, axis]
    return cell


def neighbor_rows(sectors, i):
    """Put the first sectors of the rows around i into ``neighbor_cells``; return count and threes."""
    neighbor_cells = sectors.neighbor_cells
    neighbor_cells[0] = 0
    count = 1
    last = len(sectors.sides) - 1
    for axis in range(last):
        cell, length = sectors.cell[i, axis], sectors.shape[axis + 1]
        below, above = wrap(sectors, axis, cell - 1), wrap(sectors, axis, cell + 1)
        for k in range(count):
            row = count - 1 - k
            base = neighbor_cells[row]
            neighbor_cells[3 * row + 2] = (base + above) * length
            neighbor_cells[3 * row + 1] = (base + cell) * length
            neighbor_cells[3 * row] = (base + below) * length
        count *= 3
    cell = sectors.cell[i, last]
    return count, wrap(sectors, last, cell - 1), cell, wrap(sectors, last, cell + 1)


def neighbor_rows_ahead(sectors, i, exit_face, cell):
    """Put the sectors in view when i enters ``cell`` by a face into ``neighbor_cells``; return how many."""
    neighbor_cells = sectors.neighbor_cells
    axis = exit_face >> 1
    below, above = steps_along(sectors, i, axis)
    neighbor_cells[0] = cell + (above if exit_face & 1 else below)
    count = 1
    for k in range(len(sectors.sides) - 1):
        below, above = steps_along(sectors, i, k + (k >= axis))
        for back in range(count):
            row = count - 1 - back
            base = neighbor_cells[row]
            neighbor_cells[3 * row + 2] = base + above
            neighbor_cells[3 * row + 1] = base
            neighbor_cells[3 * row] = base + below
        count *= 3
    return count


def steps_along(sectors, i, axis):
    """Return by how much the numbers of the sectors below and above that of component i differ from its."""
    cell, size = sectors.cell[i, axis], sectors.shape[axis]
    step = sectors.moves[2 * axis + 1]
    return (-step if cell > 0 else (size - 1) * step), (step if cell + 1 < size else (1 - size) * step)


def unwrapped(sectors, i, axis):
    """Return the place of component i's sector along an axis, counted on beyond the faces of the box."""
    return sectors.cell[i, axis] + sectors.shape[axis] * sectors.wraps[i, axis]


def slack(extra_slack, sectors, i, axis):
    """Return how far component i may be beyond the faces of its sector along an axis."""
    if extra_slack is None:
        return sectors.slacks[axis]
    return sectors.slacks[axis] + extra_slack[i] if sectors.slacks[axis] > 0.0 else 0.0


def enter(sectors, cell, i):
    """Add i to a sector; False, and nothing done, if the sector is full."""
    last = sectors.members.shape[1] - 1
    count = sectors.members[cell, last]
    if count == last:
        return False
    sectors.members[cell, count] = i
    sectors.members[cell, last] = count + 1
    return True


def remove_member(sectors, cell, i):
    """Remove i from a sector."""
    last = sectors.members.shape[1] - 1
    count = sectors.members[cell, last] - 1
    moved = sectors.members[cell, count]
    for start in range(0, last, LANES):
        replace_words(sectors.members, cell, start, i, moved)
    sectors.members[cell, last] = count


def copy_members(sectors, boundary, cell, code, total):
    """Append the refs of the first eight at most in a sector at ``total``; return how many are in it.

    Eight are always copied: sectors hold a few each, and a loop over the right number would be mispredicted.
    """
    members = sectors.members
    copy_code(sectors, boundary, cell, 0, code, total)
    return members[cell, members.shape[1] - 1]


def copy_all_members(sectors, boundary, cell, code, total):
    """Append the refs of all in a sector at ``total``; return how many they are."""
    count = copy_members(sectors, boundary, cell, code, total)
    for start in range(LANES, count, LANES):
        copy_code(sectors, boundary, cell, start, code, total + start)
    return count


def copy_code(sectors, boundary, cell, start, code, total):
    """Copy the refs of the eight members of a sector from ``start`` on to ``total``."""
    bits = boundary.index_bits()
    code = code if bits > 0 else 0
    copy_words(sectors.members, cell, start, sectors.refs, total, bits, code)


def narrow(sectors):
    """Tell whether a row of members is one register.

    The compiler makes a loop of its own for them. It knows there where the counts are, and asks for none.
    """
    return sectors.members.shape[1] == LANES


def best_cell(sectors, i, axis, x, v):
    """Return in which sector along an axis, -1, 0 or 1 from its own, i would stay longest."""
    up = v > 0.0
    sign = 2 * up - 1
    ahead = (sectors.sides[axis] * (unwrapped(sectors, i, axis) + up) - x) * sign
    beyond = slack(sectors.extra_slack, sectors, i, axis)
    return sign if (v != 0.0) & (ahead < beyond) & (beyond > 0.0) else 0


def wrap(sectors, axis, cell):
    """Return a place along an axis that is at most one beyond the box as the one that it is an image of."""
    size = sectors.shape[axis]
    return cell + size if cell < 0 else (cell - size if cell >= size else cell)


def move(sectors, i, axis, way):
    """Note that component i is in the next sector along an axis, if ``way`` is 1 or -1."""
    cell = sectors.cell[i, axis] + way
    sectors.cell[i, axis] = wrap(sectors, axis, cell)
    sectors.wraps[i, axis] += int(cell >= sectors.shape[axis]) - int(cell < 0)


def prefetch_ahead(sectors, state, i, step):
    """Ask for the sectors that i leaves, enters and brings into view, or for who is in them."""
    exit_face = sectors.exit_face[i]
    old = sector_of(sectors, i)
    new = old + sectors.moves[exit_face]
    if step == 1:
        prefetch_sector(sectors, old)
        prefetch_sector(sectors, new)
    for k in range(sectors.faces.shape[1]):
        prefetch_near(sectors, state, i, new, sectors.faces[exit_face, k], step)


def prefetch_around(sectors, state, i, cell, step):
    """Ask for all sectors around one near component i, or for who is in them."""
    for code in range(len(sectors.digits)):
        prefetch_near(sectors, state, i, cell, code, step)


def prefetch_both(sectors, motion, boundary, state, i, ref, step):
    """Ask for what the collision of component i with the one that ``ref`` names will touch."""
    j = boundary.index(ref)
    if step == 1:
        prefetch_sector(sectors, sector_of(sectors, i))
        prefetch(state.rows, j)
        prefetch(state.crossing_time, j)
        prefetch_cell(sectors, j)
        return
    if step == 2:
        prefetch_sector(sectors, sector_of(sectors, j))
    prefetch_after(sectors, motion, boundary, state, i, ref, step)
    prefetch_after(sectors, motion, boundary, state, j, boundary.mirror(i, ref), step)


def prefetch_after(sectors, motion, boundary, state, i, ref, step):
    """Ask for the sectors, or members, around i after its collision with ``ref``, as if of one mass."""
    me, other = state.rows[i], state.rows[boundary.index(ref)]
    now = me.event_time
    rr = 0.0
    rv = 0.0
    for axis in range(len(sectors.sides)):
        x = motion.position(axis, me.x[axis], me.v[axis], now - me.t)
        y = motion.position(axis, other.x[axis], other.v[axis], now - other.t)
        r = boundary.separation(i, ref, axis, y - x)
        rr += r * r
        rv += r * (np.float64(other.v[axis]) - np.float64(me.v[axis]))
    factor = rv / rr
    cell = sector_of(sectors, i)
    scale = 1
    for back in range(len(sectors.sides)):
        axis = len(sectors.sides) - 1 - back
        x = motion.position(axis, me.x[axis], me.v[axis], now - me.t)
        y = motion.position(axis, other.x[axis], other.v[axis], now - other.t)
        v = me.v[axis] + factor * boundary.separation(i, ref, axis, y - x)
        cell += scale * best_cell(sectors, i, axis, x, v)
        scale *= sectors.shape[axis]
    prefetch_around(sectors, state, i, cell, step - 1)


def prefetch_cell(sectors, i):
    """Ask for where component i is."""
    prefetch(sectors.cell, i * len(sectors.sides))
    prefetch(sectors.wraps, i * len(sectors.sides))


def prefetch_sector(sectors, cell):
    """Ask for a sector."""
    prefetch(sectors.members, cell * sectors.members.shape[1])


def prefetch_near(sectors, state, i, cell, code, step):
    """Ask for a sector near i, or its members; across a face it is a wrong one, which harms nobody."""
    neighbor_cells = min(max(cell + sectors.ways[code], 0), len(sectors.members) - 1)
    if step == 1:
        prefetch_sector(sectors, neighbor_cells)
        return
    count = sectors.members[neighbor_cells, sectors.members.shape[1] - 1]
    prefetch_members(state.rows, sectors.members, neighbor_cells, count, i)
