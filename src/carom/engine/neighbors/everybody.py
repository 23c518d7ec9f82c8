"""Everybody: no sectors at all. A component is searched among all others, along their relative path through
the images of the box.

In a thin system a flight crosses the box several times between two collisions, and sectors are crossed
hundreds of times for nothing. Here the straight path of a pair is followed from one image to the next: in
units of the edges contacts lie near points of whole numbers, and along the axis in which the pair moves
fastest the path passes one plane of them after the other, at equal intervals. Where it does, the other
coordinates say whether it comes near a whole number. Those whose paths may come near are found with few
digits and side by side (``paths``); they are then followed with all digits. A search covers a certain time,
after which the component searches again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner
from carom.engine.images import separation
from carom.engine.neighbors.interface import (
    change_home,
    first_met,
    first_newcomer,
    settle,
    transit,
    transit_time,
)
from carom.engine.neighbors.paths import BLOCK, first_marked, mark
from carom.engine.search import relative
from carom.engine.state import aligned
from carom.models.interface import NEVER, interaction_time, position

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
    lengths: tuple
    """Edges in parts of the longest."""
    stretch: float
    """The longest edge over the shortest."""
    width: float
    """How near to an image a path must pass its plane for a contact [edges], along the shortest edge."""
    flights: np.ndarray
    """Coordinates at the beginning of the epoch [edges] and velocities [edges / span] of a block of
    components, axis after axis, and block after block, float32. Flat, and blocks of a constant size: only so
    does the compiler see that what is written is not what is read.
    """
    own: np.ndarray
    """The same of the one that searches, (2 d,)."""
    fastest: np.ndarray
    """The largest velocity along an axis that anybody had in this epoch [edges / span], (1,)."""
    lined: np.ndarray
    """The epoch that this is true for, (1,) int64."""
    names: np.ndarray
    """0 to n - 1, and the ghost from there on, uint32."""
    paths: np.ndarray
    """Of a block of pairs, ((2 d - 1) BLOCK,) uint16: for all axes but one where the first plane is passed
    and by how much more the next one is [units]; the mark.
    """
    flight: np.ndarray
    """Of one pair, coordinates [edges] and velocities [edges / time] along all axes but one, (2 d,)."""
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
    shortest, longest = float(min(edges)), float(max(edges))
    return Everybody(
        span=float(span),
        core=float(core),
        inverse=tuple(1.0 / float(edge) for edge in edges),
        lengths=tuple(float(edge) / longest for edge in edges),
        stretch=longest / shortest,
        width=math.sqrt(2.0) * WIDENED * core / shortest,
        flights=aligned(2 * dimension * room, np.float32),
        own=np.zeros(2 * dimension, np.float32),
        fastest=np.zeros(1),
        lined=np.full(1, -1),
        names=np.minimum(np.arange(room + BLOCK), n).astype(np.uint32),
        paths=aligned((2 * dimension - 1) * BLOCK, np.uint16),
        flight=np.zeros(2 * dimension),
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
        x = position(motion, axis, row.x[axis], row.v[axis], -row.t) * inverse
        v = np.float64(row.v[axis]) * (inverse * everybody.span)
        everybody.flights[begin + np.uint64(2 * axis * BLOCK)] = x - np.floor(x)
        everybody.flights[begin + np.uint64((2 * axis + 1) * BLOCK)] = v
        everybody.fastest[0] = max(everybody.fastest[0], abs(v))


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
        everybody.fastest[0] = 0.0
        for i in range(np.uint64(len(everybody.near))):
            line_up_one(everybody, motion, state, i)


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
def follow(everybody, model, state, i, j, now, end, best, avoided):
    """Return when i meets j, before the time ``best``, or NEVER: along all of their path until ``end``, with
    all digits.
    """
    flight = everybody.flight
    dimension = len(everybody.inverse)
    me = state.rows[i]
    other = state.rows[np.uint64(j)]
    fastest = 0.0
    main = np.int64(0)
    for axis in range(dimension):
        x = position(model.motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(model.motion, axis, other.x[axis], other.v[axis], now - other.t)
        speed = (np.float64(other.v[axis]) - np.float64(me.v[axis])) * everybody.inverse[axis]
        flight[np.uint64(2 * axis)] = (y - x) * everybody.inverse[axis]
        flight[np.uint64(2 * axis + 1)] = speed
        if abs(speed) * everybody.lengths[axis] > fastest:
            fastest = abs(speed) * everybody.lengths[axis]
            main = np.int64(axis)
    if fastest == 0.0:
        return NEVER
    u = flight[np.uint64(2 * main)]
    w = flight[np.uint64(2 * main + 1)]
    # The last axis in the place of the one that counts the planes.
    flight[np.uint64(2 * main)] = flight[np.uint64(2 * dimension - 2)]
    flight[np.uint64(2 * main + 1)] = flight[np.uint64(2 * dimension - 1)]
    until = min(end, np.float64(other.due))
    ahead = u if w > 0.0 else -u
    period = 1.0 / abs(w)
    first = np.ceil(ahead - everybody.width)
    last = np.floor(ahead + abs(w) * (until - now) + everybody.width)
    for number in range(np.int64(last - first) + 1):
        passed = (first + number - ahead) * period
        near = True
        for axis in range(dimension - 1):
            place = flight[np.uint64(2 * axis)] + flight[np.uint64(2 * axis + 1)] * passed
            near &= abs(place - np.rint(place)) <= everybody.width
        if not near:
            continue
        begin = approach(everybody, model, state, i, j, now, now + passed)
        rr, rv, vv = relative(model, state, i, j, begin)
        due = begin + interaction_time(model.pair, np.int64(i), j, rr, rv, vv, begin)
        again = j == np.int64(avoided) and due <= now
        if due < best and due <= state.rows[np.uint64(j)].due and not again:
            everybody.near[i] = begin
            return due
    return NEVER


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
    for start in range(0, n, BLOCK):
        near = mark(everybody, now, end - now, start)
        lane = first_marked(everybody, 0, near)
        while lane < BLOCK:
            j = np.int64(start) + np.int64(lane)
            if j < n and j != np.int64(i):
                due = follow(everybody, model, state, i, j, now, end, best, avoided)
                if due < best:
                    best = due
                    end = min(end, due)
                    chosen = j
            lane = first_marked(everybody, lane + 1, near)
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


@settle.register
def _(neighbors: Everybody, motion, boundary, state):
    neighbors.lined[0] = -1
    return True
