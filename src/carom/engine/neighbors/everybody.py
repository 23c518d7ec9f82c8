"""Everybody: no sectors at all. A component is searched among all others, along their relative path through
the images of the box.

In a thin system a flight crosses the box several times between two collisions, and sectors are crossed
hundreds of times for nothing. Here the straight path of a pair is followed from one image to the next: in
units of the edges contacts lie near points of whole numbers, and along the axis in which the pair moves
fastest the path passes one plane of them after the other, at equal intervals. Where it does, the other
coordinates say whether it comes near a whole number. All of this is one line of arithmetic a pair and plane,
without a branch and without a calendar; what comes near (one plane in hundreds) is then computed with all
digits. A search covers a certain time, after which the component searches again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.compiling.registry import approximate, fast, inner
from carom.engine.images import separation
from carom.engine.neighbors.interface import (
    change_home,
    first_met,
    first_newcomer,
    settle,
    transit,
    transit_time,
    wrapped,
)
from carom.engine.neighbors.prefetch import ask, stages
from carom.engine.search import relative
from carom.engine.state import aligned
from carom.models.interface import NEVER, interaction_time, position

BLOCK = 64
"""Components looked at side by side."""

WIDENED = 1.0 + 2.0**-10
"""Factor on how near is near, for the rounding of paths that are boxes long: 1e-3 of a diameter, in boxes of
10^9 diameters a thousand roundings.
"""

NARROWEST = 3.0
"""Edges in largest diameters, at least: the image that is nearest where the other's plane is passed, up to
sqrt(2) diameters away, must be the one that is met.
"""


class Everybody(NamedTuple):
    """All components, side by side."""

    span: float
    """Time that a search covers."""
    core: float
    """The largest distance of contact [length]."""
    inverse: tuple
    """1 / edge along each axis."""
    widths: tuple
    """How near to an image a path must pass its plane for a contact, along each axis [edges]."""
    width: float
    """The largest of them."""
    flights: np.ndarray
    """Coordinates at the beginning of the epoch [edges] and velocities [edges / time] of a block of
    components, axis after axis, and block after block, float64. Flat, and blocks of a constant size: only so
    does the compiler see that what is written is not what is read.
    """
    own: np.ndarray
    """The same of the one that searches, (2 d,)."""
    lined: np.ndarray
    """The epoch that this is true for, (1,) int64."""
    names: np.ndarray
    """0 to n - 1, and the ghost from there on, uint32."""
    paths: np.ndarray
    """Of a block of pairs, ((2 d + 1) BLOCK,) float64: for all axes but one where the first plane is passed
    and by how much more the next one is [edges]; when the first is passed, and the time from one to the next;
    how many are passed.
    """
    near: np.ndarray
    """Shortly before the contact that the last search of each component has found, (n,): a time from which
    the nearest image is the one met, and close.
    """


def make_everybody(n: int, edges, core: float, span: float) -> Everybody:
    """Return room for ``n`` components in a box; ``span`` is the time that a search covers, ``core`` the
    largest distance of contact.
    """
    dimension = len(edges)
    room = -(-n // BLOCK) * BLOCK
    return Everybody(
        span=float(span),
        core=float(core),
        inverse=tuple(1.0 / float(edge) for edge in edges),
        widths=tuple(math.sqrt(2.0) * WIDENED * core / float(edge) for edge in edges),
        width=math.sqrt(2.0) * WIDENED * core / float(min(edges)),
        flights=aligned(2 * dimension * room, np.float64),
        own=np.zeros(2 * dimension),
        lined=np.full(1, -1),
        names=np.minimum(np.arange(room + BLOCK), n).astype(np.uint32),
        paths=aligned((2 * dimension + 1) * BLOCK, np.float64),
        near=np.zeros(n),
    )


@inner
def line_up_one(everybody, motion, state, i):
    """Put component i among the others, as its row says."""
    row = state.rows[i]
    block, lane = np.uint64(i) // np.uint64(BLOCK), np.uint64(i) % np.uint64(BLOCK)
    begin = block * np.uint64(2 * BLOCK * len(everybody.inverse)) + lane
    for axis in range(len(everybody.inverse)):
        inverse = everybody.inverse[axis]
        x = position(motion, axis, row.x[axis], row.v[axis], -row.t)
        everybody.flights[begin + np.uint64(2 * axis * BLOCK)] = x * inverse
        everybody.flights[begin + np.uint64((2 * axis + 1) * BLOCK)] = np.float64(row.v[axis]) * inverse


@inner
def line_up_own(everybody, i):
    """Put the flight of component i apart."""
    block, lane = np.uint64(i) // np.uint64(BLOCK), np.uint64(i) % np.uint64(BLOCK)
    begin = block * np.uint64(2 * BLOCK * len(everybody.inverse)) + lane
    for k in range(2 * len(everybody.inverse)):
        everybody.own[k] = everybody.flights[begin + np.uint64(k * BLOCK)]


@inner
def line_up_all(everybody, motion, state):
    """Put all components side by side, if an epoch has begun since that was done."""
    epoch = state.clock[0].epoch
    if everybody.lined[0] != epoch:
        everybody.lined[0] = epoch
        for i in range(np.uint64(len(everybody.near))):
            line_up_one(everybody, motion, state, i)


@fast
def lay_paths(everybody, now, span, start):
    """Lay out the paths of the block that begins with component ``start``, relative to the one that
    searches, for a time ``span`` from now.
    """
    flights, own, paths = everybody.flights, everybody.own, everybody.paths
    dimension = len(everybody.inverse)
    begin = np.uint64(2 * dimension * start)
    for lane in range(np.uint64(BLOCK)):
        u = 0.0
        w = 0.0
        width = 0.0
        main = np.int64(0)
        for axis in range(dimension):
            speed = flights[begin + np.uint64((2 * axis + 1) * BLOCK) + lane] - own[2 * axis + 1]
            place = flights[begin + np.uint64(2 * axis * BLOCK) + lane] - own[2 * axis] + speed * now
            # The fastest in lengths: edges are in inverse proportion to the widths.
            faster = abs(speed) * width >= abs(w) * everybody.widths[axis]
            u = place if faster else u
            w = speed if faster else w
            width = everybody.widths[axis] if faster else width
            main = np.int64(axis) if faster else main
        pace = abs(w)
        ahead = u if w > 0.0 else -u
        period = 1.0 / pace
        first = np.ceil(ahead - width)
        last = np.floor(ahead + pace * span + width)
        wait = (first - ahead) * period
        last_speed = flights[begin + np.uint64((2 * dimension - 1) * BLOCK) + lane] - own[2 * dimension - 1]
        last_place = flights[begin + np.uint64((2 * dimension - 2) * BLOCK) + lane] - own[2 * dimension - 2]
        last_place += last_speed * now
        for axis in range(dimension - 1):
            speed = flights[begin + np.uint64((2 * axis + 1) * BLOCK) + lane] - own[2 * axis + 1]
            place = flights[begin + np.uint64(2 * axis * BLOCK) + lane] - own[2 * axis] + speed * now
            # The others' coordinates; the last one's in the place of the one that counts the planes.
            speed = last_speed if main == axis else speed
            place = last_place if main == axis else place
            paths[np.uint64(2 * axis * BLOCK) + lane] = place + speed * wait
            paths[np.uint64((2 * axis + 1) * BLOCK) + lane] = speed * period
        paths[np.uint64((2 * dimension - 2) * BLOCK) + lane] = wait
        paths[np.uint64((2 * dimension - 1) * BLOCK) + lane] = period
        paths[np.uint64(2 * dimension * BLOCK) + lane] = last - first + 1.0 if pace > 0.0 else 0.0


@fast
def most_planes(everybody):
    """Return the largest number of planes that a path of the block passes."""
    begin = np.uint64(2 * len(everybody.inverse) * BLOCK)
    most = 0.0
    for lane in range(np.uint64(BLOCK)):
        most = max(most, everybody.paths[begin + lane])
    return np.int64(most)


@approximate
def passes_near(everybody, number, lane):
    """Return 1 if the path of one lane passes its plane of that number near an image, and else 0."""
    paths = everybody.paths
    dimension = len(everybody.inverse)
    near = np.int64(number < paths[np.uint64(2 * dimension * BLOCK) + lane])
    for axis in range(dimension - 1):
        place = paths[np.uint64(2 * axis * BLOCK) + lane]
        place += number * paths[np.uint64((2 * axis + 1) * BLOCK) + lane]
        near &= np.int64(abs(place - np.rint(place)) <= everybody.width)
    return near


@approximate
def count_near(everybody, number):
    """Return how many of the paths pass their plane of that number near an image."""
    found = np.int64(0)
    for lane in range(np.uint64(BLOCK)):
        found += passes_near(everybody, number, lane)
    return found


@inner
def approach(everybody, model, state, i, j, now, passed):
    """Return a time shortly before i and j would touch, if they do, near the time at which j passes its
    plane: one diameter of flight before they are closest.
    """
    rows = state.rows
    me = rows[i]
    other = rows[np.uint64(j)]
    rv = 0.0
    vv = 0.0
    for axis in range(len(everybody.inverse)):
        x = position(model.motion, axis, me.x[axis], me.v[axis], passed - me.t)
        y = position(model.motion, axis, other.x[axis], other.v[axis], passed - other.t)
        r = separation(model.boundary, i, j, axis, y - x)
        v = np.float64(other.v[axis]) - np.float64(me.v[axis])
        rv += r * v
        vv += v * v
    return max(passed - rv / vv - everybody.core / np.sqrt(vv), now)


@inner
def first_of_all(everybody, model, state, i, now, limit, avoided):
    """Return whom i meets first, until ``limit`` or the end of the time that a search covers, or -1.

    The one whom it has just met is ``avoided``, but only now: they may meet again in another image.
    """
    line_up_all(everybody, model.motion, state)
    line_up_own(everybody, i)
    n = np.int64(len(everybody.near))
    end = min(now + everybody.span, limit)
    best = NEVER
    chosen = np.int64(-1)
    waits = np.uint64((2 * len(everybody.inverse) - 2) * BLOCK)
    for start in range(0, n, BLOCK):
        lay_paths(everybody, now, end - now, start)
        lanes = np.uint64(min(int(n - start), BLOCK))
        for k in range(most_planes(everybody)):
            number = np.float64(k)
            if count_near(everybody, number) == 0:
                continue
            for lane in range(lanes):
                if passes_near(everybody, number, lane) == 0:
                    continue
                j = np.int64(start) + np.int64(lane)
                passed = now + everybody.paths[waits + lane]
                passed += number * everybody.paths[waits + np.uint64(BLOCK) + lane]
                near = approach(everybody, model, state, i, j, now, passed)
                rr, rv, vv = relative(model, state, i, j, near)
                t = interaction_time(model.pair, np.int64(i), j, rr, rv, vv, near)
                due = near + t
                again = j == np.int64(avoided) and due <= now
                if due < best and due <= state.rows[np.uint64(j)].due and not again:
                    best = due
                    end = min(end, due)
                    chosen = j
                    everybody.near[i] = near
    return chosen


@first_met.register
def _(neighbors: Everybody, model, state, i, now, half, avoided):
    return first_of_all(neighbors, model, state, i, now, NEVER, avoided)


@first_newcomer.register
def _(neighbors: Everybody, model, state, i, now, words, begin, count):
    return first_of_all(neighbors, model, state, i, now, np.float64(state.rows[i].due), np.int64(-1))


@transit_time.register
def _(neighbors: Everybody, motion, boundary, state, i, now):
    return now + neighbors.span


@transit.register
def _(neighbors: Everybody, motion, boundary, state, i, now):
    return True, neighbors.names, np.uint64(0), np.int64(0)


@change_home.register
def _(neighbors: Everybody, motion, boundary, state, i, now):
    line_up_one(neighbors, motion, state, i)


@wrapped.register
def _(neighbors: Everybody, i, axis, crossings):
    return None


@settle.register
def _(neighbors: Everybody, motion, boundary, state):
    neighbors.lined[0] = -1
    return True


@stages.register
def _(neighbors: Everybody):
    return 0


@ask.register
def _(neighbors: Everybody, motion, boundary, state, i, step):
    return None
