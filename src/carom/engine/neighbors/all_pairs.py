"""All pairs: no sectors. In a dilute system a component would cross hundreds of them between two collisions.

:class:`Everybody` follows the straight path of a pair through the images of the box. In units of the edges,
contacts lie near integer points. Along the axis of fastest motion the path passes planes of these at equal
intervals, and the other coordinates say whether it comes near one. Candidates are found with few digits, many
at a time (``prefilter``), then followed with all. Every pair is searched once an epoch, and all contacts
until its end are kept (``contact_cache``). Then only the two that collided search, and enter what they find
on both sides; one that lost its partner takes the next of its contacts.

:class:`Pairs` is for curved relative flight: ``meeting_time`` of every pair, for some hundred components. A
search covers a certain time, after which the component searches again.
"""

from __future__ import annotations

import math

import numpy as np

from carom.compiling.registry import cold
from carom.engine.constants import LAMBDA
from carom.engine.neighbors.contact_cache import (
    STALE,
    Contacts,
    best_of,
    clear,
    contact_of,
    keep,
    make_contacts,
)
from carom.engine.neighbors.interface import NeighborScheme
from carom.engine.neighbors.prefilter import BLOCK, UNITS, marked, position_error_of, prefilter
from carom.engine.search import Timing, relative
from carom.engine.state import aligned
from carom.models.interfaces.particles import NEVER

WIDENED = 1.0 + 2.0**-10
"""Factor on how near is near, for the rounding of paths that are boxes long: 1e-3 of a diameter, in boxes of
10^9 diameters a thousand roundings.
"""

NARROWEST = 3.0
"""Edges in largest diameters, at least: the image that is nearest where the other's plane is passed, up to
sqrt(2) diameters away, must be the one that is met.
"""


class Everybody(NeighborScheme):
    """All components, side by side."""

    span: float
    """Length of an epoch: a search covers what is left of it."""
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
    packed_flights: np.ndarray
    """Coordinates at the beginning of the epoch [units] and velocities [units / span] of a block of
    components, axis after axis, and block after block, float32. Flat, and blocks of a constant size: only so
    does the compiler see that what is written is not what is read.
    """
    packed_self: np.ndarray
    """The same of the one that searches, (2 d,)."""
    fastest: np.ndarray
    """The largest velocity along an axis that anybody had in this epoch [edges / span], (1,)."""
    swiftest: np.ndarray
    """The same of each block, axis by axis, (blocks d,)."""
    lined_up_epoch: np.ndarray
    """The epoch that this is true for, (1,) int64."""
    names: np.ndarray
    """0 to n - 1, and the padding row from there on, uint32."""
    paths: np.ndarray
    """Of a block of pairs, ((2 d - 1) BLOCK,) uint16: for all axes but one where the next plane is passed and
    by how much more the one after it is [units]; the mark.
    """
    flight: np.ndarray
    """Of one pair, coordinates [edges] and velocities [edges / time] along all axes but one, (2 d,)."""
    start_times: np.ndarray
    """Shortly before the contact that the last search of each component has found, (n,): a time from which
    the nearest image is the one met, and close.
    """
    contacts: Contacts
    """Of every component, whom it meets in this epoch if neither changes its flight before."""

    def earliest_partner(self, model, state, i, now, half, avoided):
        if self.lined_up_epoch[0] != state.clock[0].epoch:
            search_everybody(self, model, state, now)
        contacts = self.contacts
        if contacts.counts[i] != STALE and avoided < 0:
            k, known = best_of(contacts, state, i, False)
            if known:
                if k < 0:
                    return -1, 0.0
                contact = contact_of(contacts, i, k)
                self.start_times[i] = contact.start_time
                return contact.other, 0.0
        clear(contacts, i)
        return search_all(self, model, state, i, now, -1, avoided), 0.0

    def earliest_newcomer(self, model, state, i, now, refs, start_index, count):
        return -1, 0.0

    def transit_time(self, motion, boundary, state, i, now):
        return self.span if self.fastest[0] > 0.0 else NEVER

    def rebin(self, motion, boundary, state, i, now):
        pack_one(self, motion, state, i)
        self.contacts.versions[i] += 1
        self.contacts.counts[i] = STALE

    def begin_epoch(self, model, state, tally):
        rows = state.rows
        n = len(self.start_times)
        search_everybody(self, model, state, 0.0)
        for i in range(n):
            # An advancement now for whom contacts found no room: it looks at all by itself.
            rows[i].event_time = NEVER if self.contacts.first_dropped[i] == NEVER else 0.0
            state.partner[i] = LAMBDA
            state.crossing_time[i] = self.transit_time(model.motion, model.boundary, state, i, 0.0)
        # Nobody takes the earliest pair apart, then nobody the next earliest, and so on: this ends.
        changed = True
        while changed:
            changed = False
            for i in range(n):
                changed |= choose(self, model, state, tally, i)

    @cold
    def build(self, motion, boundary, state):
        self.lined_up_epoch[0] = -1
        return True

    def cross(self, motion, boundary, state, i, now):
        return True, self.names, 0, 0


def make_everybody(n: int, edges, core: float, span: float, number: type = np.float64) -> Everybody:
    """Return room for ``n`` components: ``span`` is an epoch, ``core`` the largest distance of contact."""
    dimension = len(edges)
    padded = -(-n // BLOCK) * BLOCK
    shortest, longest = float(min(edges)), float(max(edges))
    return Everybody(
        span=float(span),
        core=float(core),
        inverse=tuple(1.0 / float(edge) for edge in edges),
        lengths=tuple(float(edge) / longest for edge in edges),
        stretch=longest / shortest,
        width=math.sqrt(2.0) * WIDENED * core / shortest,
        packed_flights=aligned(2 * dimension * padded, np.float32),
        packed_self=np.zeros(2 * dimension, np.float32),
        fastest=np.zeros(1),
        swiftest=np.zeros(dimension * (padded // BLOCK)),
        lined_up_epoch=np.full(1, -1),
        names=np.minimum(np.arange(padded + BLOCK), n).astype(np.uint32),
        paths=aligned((2 * dimension - 1) * BLOCK, np.uint16),
        flight=np.zeros(2 * dimension),
        start_times=np.zeros(n),
        contacts=make_contacts(n, number),
    )


class Pairs(NeighborScheme):
    """Nothing but the time that a search covers, and the names of all."""

    span: float  # time that a search covers
    names: np.ndarray  # 0 to n - 1, uint32

    def earliest_partner(self, model, state, i, now, half, avoided):
        return first_of_pairs(self, model, state, i, now, NEVER, avoided), 0.0

    def earliest_newcomer(self, model, state, i, now, refs, start_index, count):
        return first_of_pairs(self, model, state, i, now, np.float64(state.rows[i].event_time), -1), 0.0

    def transit_time(self, motion, boundary, state, i, now):
        return now + self.span

    @cold
    def build(self, motion, boundary, state):
        return True

    def cross(self, motion, boundary, state, i, now):
        return True, self.names, 0, 0


class AlongCurves(Timing):
    """Contacts of components that do not fly straight relative to each other."""

    span: float  # time that a search covers

    def contact_time(self, model, state, i, ref, now, t):
        low_index, high_index = min(i, ref), max(i, ref)
        t, clamped = curved_meeting(model, state, low_index, high_index, now, NEVER, self.span)
        return now + t, clamped


def make_pairs(n: int, span: float) -> Pairs:
    """Return the scheme for ``n`` components; ``span`` is the time that a search covers."""
    return Pairs(float(span), np.arange(n, dtype=np.uint32))


def pack_one(everybody, motion, state, i):
    """Put component i among the others, as its row says."""
    me = state.rows[i]
    block_index, lane = i // BLOCK, i % BLOCK
    start_index = block_index * (2 * BLOCK * len(everybody.inverse)) + lane
    for axis in range(len(everybody.inverse)):
        inverse = everybody.inverse[axis]
        x = motion.position(axis, me.x[axis], me.v[axis], -me.t) * inverse
        v = np.float64(me.v[axis]) * (inverse * everybody.span)
        everybody.packed_flights[start_index + 2 * axis * BLOCK] = (x - np.floor(x)) * UNITS
        everybody.packed_flights[start_index + (2 * axis + 1) * BLOCK] = v * UNITS
        everybody.fastest[0] = max(everybody.fastest[0], abs(v))
        swiftest = block_index * len(everybody.inverse) + axis
        everybody.swiftest[swiftest] = max(everybody.swiftest[swiftest], abs(v))


def pack_self(everybody, i):
    """Put the flight of component i apart."""
    block_index, lane = i // BLOCK, i % BLOCK
    start_index = block_index * (2 * BLOCK * len(everybody.inverse)) + lane
    for k in range(2 * len(everybody.inverse)):
        everybody.packed_self[k] = everybody.packed_flights[start_index + k * BLOCK]


def pack_all(everybody, motion, state):
    """Put all components side by side, if an epoch has begun since that was done."""
    epoch = state.clock[0].epoch
    if everybody.lined_up_epoch[0] != epoch:
        everybody.lined_up_epoch[0] = epoch
        everybody.fastest[0] = 0.0
        for k in range(len(everybody.swiftest)):
            everybody.swiftest[k] = 0.0
        for i in range(len(everybody.start_times)):
            pack_one(everybody, motion, state, i)


def approach_time(everybody, model, state, i, j, now, at_plane):
    """Return a time one diameter of flight before i and j are closest, near that of the plane of j."""
    rows = state.rows
    me = rows[i]
    other = rows[j]
    rv = 0.0
    vv = 0.0
    for axis in range(len(everybody.inverse)):
        x = model.motion.position(axis, me.x[axis], me.v[axis], at_plane - me.t)
        y = model.motion.position(axis, other.x[axis], other.v[axis], at_plane - other.t)
        r = model.boundary.separation(i, j, axis, y - x)
        v = np.float64(other.v[axis]) - np.float64(me.v[axis])
        rv += r * v
        vv += v * v
    return max(at_plane - rv / vv - everybody.core / np.sqrt(vv), now)


def exact_meeting(everybody, model, state, i, j, now, avoided):
    """Return a time shortly before i and j touch, and when, or NEVER; if ``avoided``, not now."""
    flight = everybody.flight
    dimension = len(everybody.inverse)
    me = state.rows[i]
    other = state.rows[j]
    fastest = 0.0
    main = 0
    for axis in range(dimension):
        x = model.motion.position(axis, me.x[axis], me.v[axis], now - me.t)
        y = model.motion.position(axis, other.x[axis], other.v[axis], now - other.t)
        speed = (np.float64(other.v[axis]) - np.float64(me.v[axis])) * everybody.inverse[axis]
        flight[2 * axis] = (y - x) * everybody.inverse[axis]
        flight[2 * axis + 1] = speed
        if abs(speed) * everybody.lengths[axis] > fastest:
            fastest = abs(speed) * everybody.lengths[axis]
            main = axis
    if fastest == 0.0:
        return now, NEVER
    u = flight[2 * main]
    w = flight[2 * main + 1]
    # The last axis in the place of the one that counts the planes.
    flight[2 * main] = flight[2 * dimension - 2]
    flight[2 * main + 1] = flight[2 * dimension - 1]
    ahead = u if w > 0.0 else -u
    period = 1.0 / abs(w)
    first_plane = np.ceil(ahead - everybody.width)
    last = np.floor(ahead + abs(w) * (everybody.span - now) + everybody.width)
    for number in range(int(last - first_plane) + 1):
        at_plane = (first_plane + number - ahead) * period
        near = True
        for axis in range(dimension - 1):
            coordinate = flight[2 * axis] + flight[2 * axis + 1] * at_plane
            near &= abs(coordinate - np.rint(coordinate)) <= everybody.width
        if not near:
            continue
        start_time = approach_time(everybody, model, state, i, j, now, now + at_plane)
        rr, rv, vv = relative(model, state, i, j, start_time)
        event_time = start_time + model.pair.interaction_time(i, j, rr, rv, vv, start_time)
        repeats = j == avoided and event_time <= now
        if event_time <= everybody.span and not repeats:
            return start_time, event_time
    return now, NEVER


def search_all(everybody, model, state, i, now, after, avoided):
    """Keep, on both sides, the contacts of i with all behind number ``after``; return its first, or -1.

    Whoever has changed and has yet to look at all is left out: it will find i itself.
    """
    contacts = everybody.contacts
    pack_self(everybody, i)
    n = len(everybody.start_times)
    best = NEVER
    chosen = -1
    elapsed = now / everybody.span
    covered = 1.0 - elapsed
    position_error = position_error_of(everybody, elapsed, covered)
    start_index = after + 1
    for start in range(start_index // BLOCK * BLOCK, n, BLOCK):
        limit = prefilter(everybody, elapsed, covered, position_error, start)
        lane, last = marked(everybody, max(start_index - start, 0), limit)
        while lane < BLOCK:
            j = start + lane
            if j < n and j != i and contacts.counts[j] != STALE:
                shortly, event_time = exact_meeting(everybody, model, state, i, j, now, avoided)
                if event_time < NEVER:
                    keep(contacts, i, j, shortly, event_time)
                    keep(contacts, j, i, shortly, event_time)
                    if event_time < best and event_time <= state.rows[j].event_time:
                        best = event_time
                        chosen = j
                        everybody.start_times[i] = shortly
            if lane == last:
                break
            lane, _ = marked(everybody, lane + 1, limit)
    return chosen


def search_everybody(everybody, model, state, now):
    """Look at every pair, from now to the end of the epoch."""
    pack_all(everybody, model.motion, state)
    for i in range(len(everybody.start_times)):
        clear(everybody.contacts, i)
    for i in range(len(everybody.start_times)):
        search_all(everybody, model, state, i, now, i, -1)


def choose(everybody, model, state, tally, i):
    """Give i its first contact, if earlier than its event; whom the two leave then have no event."""
    rows = state.rows
    k, _ = best_of(everybody.contacts, state, i, True)
    if k < 0 or contact_of(everybody.contacts, i, k).event_time >= rows[i].event_time:
        return False
    contact = contact_of(everybody.contacts, i, k)
    j = contact.other
    for left in (state.partner[i], state.partner[j]):
        if left >= 0:
            rows[left].event_time = NEVER
            state.partner[left] = LAMBDA
    everybody.start_times[i] = contact.start_time
    event_time, clamped = model.timing.contact_time(model, state, i, j, 0.0, 0.0)
    tally.clamped += clamped
    rows[i].event_time = event_time
    rows[j].event_time = event_time
    state.partner[i] = j
    state.partner[j] = i
    return True


def curved_meeting(model, state, i, j, now, limit, span):
    """Return the time until i and j touch, or NEVER beyond ``limit``, and whether they do so already."""
    contact = np.sqrt(model.pair.core_square(i, j, now))
    rate = model.pair.growth_of(i) + model.pair.growth_of(j)
    rows = state.rows
    me, other = rows[i], rows[j]
    return model.motion.meeting_time(me, other, now, contact, rate, limit, span)


def first_of_pairs(neighbors, model, state, i, now, limit, avoided):
    """Return whom i meets first until ``limit`` or the search's end, or -1; not the one ``avoided`` now."""
    best = min(now + neighbors.span, limit)
    chosen = -1
    for j in range(len(neighbors.names)):
        if j == i:
            continue
        end = min(best, np.float64(state.rows[j].event_time))
        # In the order of their numbers, so that a meeting has the same bits for both.
        low_index, high_index = min(i, j), max(i, j)
        t, _ = curved_meeting(model, state, low_index, high_index, now, end - now, neighbors.span)
        event_time = now + t
        if event_time < best and event_time <= end and not (j == avoided and event_time <= now):
            best = event_time
            chosen = j
    return chosen
