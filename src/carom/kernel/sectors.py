"""Sectors: the paper's grid of cells, at least a diameter wide; a component looks into the 3^d around its
own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.boundary import index, index_bits, mirror, separation
from carom.kernel.constants import NEVER
from carom.kernel.dispatch import inner
from carom.kernel.lookahead import ask, stages, ask_members, ask_own, leaves_first, prefetch
from carom.kernel.motion import position
from carom.kernel.neighbors import candidates, change_home, settle, transit, transit_time, wrapped
from carom.kernel.state import aligned
from carom.kernel.words import STEP, copy_words, replace_words

ASKED = 50_000
"""Components from which on it pays to ask for sectors ahead of time."""


class Sectors(NamedTuple):
    """Components by sector."""

    shape: tuple
    """Sectors along each axis."""
    sides: tuple
    """Sides of a sector [length]."""
    slacks: tuple
    """How far a component may be beyond the faces of its sector along each axis [length]."""
    members: np.ndarray
    """Who is in each sector, and in the last column how many, (sectors, room) uint32."""
    digits: np.ndarray
    """Offset -1, 0 or 1 along each axis of the 3^d sectors around one, (3^d, d) int64."""
    around: np.ndarray
    """Number of the sector at each place of the grid with one more layer on every side, int32: across a face
    of the box it is the one on the other side.
    """
    strides: tuple
    """Distance of neighbours along each axis in ``around``."""
    offsets: np.ndarray
    """Distance in ``around`` of the 3^d sectors around one, (3^d,) int64."""
    place: np.ndarray
    """Sector of each component along each axis, (n + 1, d) int32; the ghost has one, too."""
    turn: np.ndarray
    """Boxes from the component's position, which is not wrapped in flight, to that sector, (n + 1, d)
    int32.
    """
    face: np.ndarray
    """Face through which each component leaves its sector: twice the axis, plus one for the upper, (n,)
    uint8.
    """
    ways: np.ndarray
    """Difference of their numbers from that of the one between them, but across a face of the box, (3^d,)
    int64.
    """
    moves: np.ndarray
    """The same, and the distance in ``around``, of the neighbour through each face, (2 d, 2) int64."""
    faces: np.ndarray
    """Neighbouring sectors that come into view when a component moves down or up along an axis, (2 d, 3^(d
    - 1)) int64.
    """
    words: np.ndarray
    """Room for the candidates of two components, uint32."""


def make_sectors(n: int, edges, shape, capacity: int, slacks) -> Sectors:
    """Return empty sectors: ``shape`` of them along the edges, ``capacity`` components in each at most, who
    may be beyond its faces by ``slacks``.
    """
    dimension = len(shape)
    room = -(-(capacity + 1) // STEP) * STEP
    digits = np.stack(np.unravel_index(np.arange(3**dimension), (3,) * dimension), axis=1) - 1
    wide = tuple(int(size) + 2 for size in shape)
    strides = tuple(int(np.prod(wide[axis + 1 :])) for axis in range(dimension))
    steps = np.array([int(np.prod(shape[axis + 1 :])) for axis in range(dimension)])
    wrapped_places = np.ix_(*(np.arange(-1, size + 1) % size for size in shape))
    around = np.ravel_multi_index(np.broadcast_arrays(*wrapped_places), tuple(shape)).astype(np.int32)
    return Sectors(
        shape=tuple(int(size) for size in shape),
        sides=tuple(edge / size for edge, size in zip(edges, shape, strict=True)),
        slacks=tuple(slacks),
        members=aligned(int(np.prod(shape)) * room, np.uint32).reshape(-1, room),
        digits=np.ascontiguousarray(digits, dtype=np.int64),
        around=np.ascontiguousarray(around.ravel()),
        strides=strides,
        offsets=np.ascontiguousarray(digits @ np.array(strides), dtype=np.int64),
        ways=np.ascontiguousarray(digits @ steps, dtype=np.int64),
        moves=np.stack([np.ravel(np.outer(each, (-1, 1))) for each in (steps, strides)], axis=1),
        place=np.zeros((n + 1, dimension), np.int32),
        turn=np.zeros((n + 1, dimension), np.int32),
        face=np.zeros(n, np.uint8),
        faces=np.array([np.flatnonzero(digits[:, k // 2] == 2 * (k % 2) - 1) for k in range(2 * dimension)]),
        words=np.zeros(2 * (3**dimension * room + STEP), np.uint32),
    )


@inner
def home_of(sectors, i):
    """Return where the sector that holds component i is in ``around``."""
    home = np.int64(0)
    for axis in range(len(sectors.sides)):
        home += sectors.strides[axis] * (np.int64(sectors.place[i, axis]) + 1)
    return home


@inner
def sector_of(sectors, i):
    """Return the sector that holds component i."""
    return np.uint64(sectors.around[np.uint64(home_of(sectors, i))])


@inner
def unwrapped(sectors, i, axis):
    """Return the place of component i's sector along an axis, counted on beyond the faces of the box."""
    return np.int64(sectors.place[i, axis]) + sectors.shape[axis] * np.int64(sectors.turn[i, axis])


@inner
def enter(sectors, cell, i):
    """Add i to a sector; False, and nothing done, if the sector is full."""
    last = np.uint64(sectors.members.shape[1] - 1)
    count = np.uint64(sectors.members[cell, last])
    if count == last:
        return False
    sectors.members[cell, count] = i
    sectors.members[cell, last] = count + np.uint64(1)
    return True


@inner
def leave(sectors, cell, i):
    """Remove i from a sector."""
    last = np.uint64(sectors.members.shape[1] - 1)
    count = np.uint64(sectors.members[cell, last]) - np.uint64(1)
    moved = np.int64(sectors.members[cell, count])
    for start in range(np.uint64(0), last, np.uint64(STEP)):
        replace_words(sectors.members, np.int64(cell), np.int64(start), np.int64(i), moved)
    sectors.members[cell, last] = count


@inner
def look_into(sectors, boundary, home, code, total):
    """Append the words of all in a sector around ``home`` at ``total``; return where the next go.

    Eight are copied at a time, whether so many are there or not: sectors hold a few each, and a loop over the
    right number would be mispredicted at every one.
    """
    members = sectors.members
    cell = np.uint64(sectors.around[np.uint64(home + sectors.offsets[np.uint64(code)])])
    count = np.uint64(members[cell, np.uint64(members.shape[1] - 1)])
    bits = np.int64(index_bits(boundary))
    code = np.int64(code) if bits > 0 else np.int64(0)
    copy_words(members, np.int64(cell), np.int64(0), sectors.words, np.int64(total), bits, code)
    for start in range(np.uint64(STEP), count, np.uint64(STEP)):
        copy_words(
            members, np.int64(cell), np.int64(start), sectors.words, np.int64(total + start), bits, code
        )
    return total + count


@candidates.register
def _(neighbors: Sectors, boundary, i, half):
    begin = np.uint64(half * (len(neighbors.words) // 2))
    total = begin
    home = home_of(neighbors, i)
    for code in range(np.uint64(len(neighbors.digits))):
        total = look_into(neighbors, boundary, home, np.int64(code), total)
    return neighbors.words, begin, np.int64(total - begin)


@transit_time.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    row = state.rows[i]
    best = NEVER
    face = np.int64(0)
    for axis in range(len(neighbors.sides)):
        v = np.float64(row.v[axis])
        x = position(motion, axis, row.x[axis], v, now - row.t)
        up = np.int64(v > 0.0)
        end = neighbors.sides[axis] * (unwrapped(neighbors, i, axis) + up)
        end += (2 * up - 1) * neighbors.slacks[axis]
        t = max((end - x) / v, 0.0) if v != 0.0 else NEVER
        face = 2 * axis + up if t < best else face
        best = min(t, best)
    neighbors.face[i] = face
    return now + best


@change_home.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    row = state.rows[i]
    home = home_of(neighbors, i)
    target = home
    changes = np.int64(0)
    for axis in range(len(neighbors.sides)):
        v = np.float64(row.v[axis])
        x = position(motion, axis, row.x[axis], v, now - row.t)
        up = np.int64(v > 0.0)
        ahead = (neighbors.sides[axis] * (unwrapped(neighbors, i, axis) + up) - x) * (2 * up - 1)
        change = (v != 0.0) & (ahead < neighbors.slacks[axis]) & (neighbors.slacks[axis] > 0.0)
        target += neighbors.strides[axis] * (2 * up - 1) if change else 0
        changes |= np.int64(change) << axis
    if changes == 0:
        return
    old, new = np.uint64(neighbors.around[np.uint64(home)]), np.uint64(neighbors.around[np.uint64(target)])
    if not enter(neighbors, new, np.uint32(i)):
        return
    leave(neighbors, old, np.uint32(i))
    for axis in range(len(neighbors.sides)):
        if (changes >> axis) & 1:
            move(neighbors, i, axis, row.v[axis] > 0.0)


@inner
def move(sectors, i, axis, up):
    """Note that component i is in the next sector along an axis."""
    place = np.int64(sectors.place[i, axis]) + (1 if up else -1)
    if place < 0:
        place += sectors.shape[axis]
        sectors.turn[i, axis] -= 1
    elif place >= sectors.shape[axis]:
        place -= sectors.shape[axis]
        sectors.turn[i, axis] += 1
    sectors.place[i, axis] = place


@transit.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    face = np.int64(neighbors.face[i])
    axis = face >> 1
    old = sector_of(neighbors, i)
    move(neighbors, i, axis, (face & 1) == 1)
    new = sector_of(neighbors, i)
    total = np.uint64(0)
    done = True
    if new != old:  # one sector along this axis is its own neighbour
        done = enter(neighbors, new, np.uint32(i))
        if done:
            leave(neighbors, old, np.uint32(i))
    home = home_of(neighbors, i)
    for k in range(np.uint64(neighbors.faces.shape[1])):
        total = look_into(neighbors, boundary, home, neighbors.faces[face, k], total)
    return done, neighbors.words, np.uint64(0), np.int64(total)


@ask.register
def _(neighbors: Sectors, motion, boundary, state, i, step):
    if step == 0:
        ask_own(state, i)
        ask_place(neighbors, i)
        prefetch(neighbors.face, np.int64(i))
        return
    if len(state.partner) < ASKED:
        return
    cell, home = whereabouts(neighbors, i)
    if leaves_first(state, i):
        if step == 3:
            return
        if step == 1:
            ask_sector(neighbors, cell, home)  # which it leaves
        face = np.uint64(neighbors.face[i])
        cell += neighbors.moves[face, 0]
        home += neighbors.moves[face, 1]
        if step == 1:
            ask_sector(neighbors, cell, home)
        for k in range(np.uint64(neighbors.faces.shape[1])):
            ask_near(neighbors, state, i, cell, home, np.uint64(neighbors.faces[face, k]), step)
        return
    word = np.int64(state.partner[i])
    if word < 0:
        if step == 3:
            return
        for code in range(np.uint64(len(neighbors.digits))):
            ask_near(neighbors, state, i, cell, home, code, step)
        return
    j = np.uint64(index(boundary, word))
    if step == 1:
        ask_sector(neighbors, cell, home)
        prefetch(state.rows, np.int64(j))
        prefetch(state.leave, np.int64(j))
        ask_place(neighbors, j)
        return
    if step == 2:
        cell, home = whereabouts(neighbors, j)
        ask_sector(neighbors, cell, home)
    ask_after(neighbors, motion, boundary, state, i, word, step)
    ask_after(neighbors, motion, boundary, state, j, np.int64(mirror(boundary, np.int64(i), word)), step)


@inner
def ask_after(sectors, motion, boundary, state, i, word, step):
    """Ask for what is near component i after its collision with the one that ``word`` names."""
    me, other = state.rows[i], state.rows[np.uint64(index(boundary, word))]
    now = me.due
    rr = 0.0
    rv = 0.0
    for axis in range(len(sectors.sides)):
        x = position(motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(motion, axis, other.x[axis], other.v[axis], now - other.t)
        r = separation(boundary, i, word, axis, y - x)
        rr += r * r
        rv += r * (np.float64(other.v[axis]) - np.float64(me.v[axis]))
    factor = rv / rr
    cell, home = whereabouts(sectors, i)
    scale = np.int64(1)
    for back in range(len(sectors.sides)):
        axis = len(sectors.sides) - 1 - back
        x = position(motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(motion, axis, other.x[axis], other.v[axis], now - other.t)
        v = me.v[axis] + factor * separation(boundary, i, word, axis, y - x)
        up = np.int64(v > 0.0)
        ahead = (sectors.sides[axis] * (unwrapped(sectors, i, axis) + up) - x) * (2 * up - 1)
        change = 2 * up - 1 if (v != 0.0) & (ahead < sectors.slacks[axis]) & (sectors.slacks[axis] > 0.0) else 0
        cell += scale * change
        home += sectors.strides[axis] * change
        scale *= sectors.shape[axis]
    for code in range(np.uint64(len(sectors.digits))):
        ask_near(sectors, state, i, cell, home, code, step - 1)


@stages.register
def _(neighbors: Sectors):
    return 4


@inner
def ask_place(sectors, i):
    """Ask for where component i is."""
    prefetch(sectors.place, np.int64(i) * len(sectors.sides))
    prefetch(sectors.turn, np.int64(i) * len(sectors.sides))


@inner
def whereabouts(sectors, i):
    """Return the number of the sector that holds component i, and where that is in ``around``, which is not
    read.
    """
    cell = np.int64(0)
    home = np.int64(0)
    for axis in range(len(sectors.sides)):
        place = np.int64(sectors.place[i, axis])
        cell = cell * sectors.shape[axis] + place
        home += sectors.strides[axis] * (place + 1)
    return cell, home


@inner
def ask_sector(sectors, cell, home):
    """Ask for a sector, and for its number."""
    prefetch(sectors.members, cell * sectors.members.shape[1])
    prefetch(sectors.around, home)


@inner
def ask_near(sectors, state, i, cell, home, code, step):
    """Ask for one of the sectors around one near component i, or for who is in it.

    Across a face of the box it is a wrong one: what is asked for in vain harms nobody.
    """
    near = min(max(cell + sectors.ways[code], 0), len(sectors.members) - 1)
    if step == 1:
        ask_sector(sectors, near, home + sectors.offsets[code])
        return
    count = np.int64(sectors.members[np.uint64(near), np.uint64(sectors.members.shape[1] - 1)])
    ask_members(state.rows, sectors.members, np.uint64(near), count, i)


@wrapped.register
def _(neighbors: Sectors, i, axis, crossings):
    neighbors.turn[i, axis] -= np.int64(crossings)


@settle.register
def _(neighbors: Sectors, motion, boundary, state):
    now = state.clock[0].now
    neighbors.members[:, neighbors.members.shape[1] - 1] = 0
    for i in range(np.uint64(len(state.partner))):
        row = state.rows[i]
        for axis in range(len(neighbors.sides)):
            x = position(motion, axis, row.x[axis], row.v[axis], now - row.t)
            place = np.int64(np.floor(x / neighbors.sides[axis]))
            turn = place // neighbors.shape[axis]
            neighbors.place[i, axis] = place - turn * neighbors.shape[axis]
            neighbors.turn[i, axis] = turn
        if not enter(neighbors, sector_of(neighbors, i), np.uint32(i)):
            return False
    return True
