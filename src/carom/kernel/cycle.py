"""The main cycle of the paper's Figure 2, written once.

It knows the basic functions ``interaction_time``, ``jump`` and ``advance`` (here ``position`` and
``velocity``) and nothing of physics. One departure, and why: both halves of a collision are processed in one
cycle. Taken one at a time, the second is still pending while the first schedules, at the same time and with
its state from before the collision, and the printed cycle then stalls (docs/concepts).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.kernel.borrow import borrowed
from carom.kernel.boundary import count_images, index, index_bits, lasting, mirror, separation
from carom.kernel.calendar import ROOM, adapt, ask_calendar, first, insert, lay_out, pop, time_of
from carom.kernel.constants import (
    IDLE,
    LAMBDA,
    NEEDS_HEAP,
    NEEDS_LOG,
    NEEDS_NEIGHBORS,
    NEVER,
    OBSTACLE,
    REACHED_COLLISIONS,
    REACHED_TIME,
    SPENT,
)
from carom.kernel.dispatch import entry, fast, generic, inner
from carom.kernel.lists import Lists
from carom.kernel.lookahead import leaves_first
from carom.kernel.motion import position, velocity
from carom.kernel.neighbors import (
    candidates,
    change_home,
    first_met,
    first_newcomer,
    settle,
    transit,
    transit_time,
    wrapped,
)
from carom.kernel.obstacle import Obstacles, bounce, soonest
from carom.kernel.pair import age, depth, growth, interaction_time, jump, line_up_cores, transfer
from carom.kernel.sectors import Sectors
from carom.kernel.sight import meet
from carom.kernel.spread import LANES, WIDTH, spread
from carom.kernel.tally import count_pair, log_full, record

NOBODY = np.int64(0x7FEFFFFFFFFFFFFF)
"""Bits of the largest finite float: nobody found."""

NOBODY_MET = np.int64(-1)
"""No word: nothing is left out of a search."""


class Model(NamedTuple):
    """What the basic functions are, by type, and their parameters, by value."""

    pair: Any
    motion: Any
    boundary: Any
    impact: Any
    """What a contact of two components loses, or None where it is elastic."""
    obstacles: Any
    """Everything fixed that components can meet, or None."""
    sight: Any
    """Whether contacts are found from so far away that they are computed again from nearby, or None."""


@fast
def nearest(model, state, i, now, words, begin, count, half, avoided):
    """Return the word of the candidate that i meets first, ``avoided`` left out, or -1 (the paper's line 4).

    The loop has no branch and no store, so that it is vectorised: the candidate's number takes the place of
    the time's last five bits, and the smallest integer is the earliest candidate.
    """
    me = state.rows[i]
    room = np.uint64(half)
    block = state.block
    dimension = len(model.boundary.edges)
    bits = np.int64(index_bits(model.boundary))
    best = NOBODY
    chosen = np.int64(-1)
    for start in range(0, count, WIDTH):
        size = min(count - start, WIDTH)
        full = (size + LANES - 1) & ~(LANES - 1)
        for lane in range(0, full, LANES):
            first = np.int64(begin) + start + lane
            spread(state.rows, words, first, bits, block, half, np.int64(lane))
            line_up_cores(model.pair, words, first, bits, half * WIDTH + np.int64(lane))
        earliest = NOBODY
        for k in range(np.uint64(full)):
            word = words[begin + np.uint64(start) + k]
            rr = 0.0
            rv = 0.0
            vv = 0.0
            elapsed = now - block[room, dimension, k]
            for axis in range(dimension):
                x = position(model.motion, axis, me.x[axis], me.v[axis], now - me.t)
                y = position(
                    model.motion, axis, block[room, axis, k], block[room, dimension + 1 + axis, k], elapsed
                )
                r = separation(model.boundary, i, word, axis, y - x)
                v = velocity(model.motion, axis, block[room, dimension + 1 + axis, k], elapsed) - velocity(
                    model.motion, axis, me.v[axis], now - me.t
                )
                rr += r * r
                rv += r * v
                vv += v * v
            j, place = index(model.boundary, word), room * np.uint64(WIDTH) + k
            t = interaction_time(model.pair, i, j, place, rr, rv, vv, now)
            free = (block[room, 2 * dimension + 1, k] >= now + t) & (np.int64(word) != avoided)
            free &= np.int64(k) < size  # what follows the last candidate is somebody's word, but not i's
            t = t if free else NEVER
            key = (np.float64(t).view(np.int64) & ~np.int64(WIDTH - 1)) | np.int64(k)
            earliest = min(earliest, key)
        if earliest < best:
            best = earliest
            chosen = np.int64(words[begin + np.uint64(start + (earliest & (WIDTH - 1)))])
    return chosen


@inner
def search(model, state, neighbors, i, now, half, avoided):
    """Search among all that i can meet, under any word but ``avoided``."""
    return first_met(neighbors, model, state, i, now, half, avoided)


@first_met.register(Sectors)
@first_met.register(Lists)
def _(neighbors, model, state, i, now, half, avoided):
    words, begin, count = candidates(neighbors, model.boundary, i, half)
    return nearest(model, state, i, now, words, begin, count, half, avoided)


@first_newcomer.register(Sectors)
@first_newcomer.register(Lists)
def _(neighbors, model, state, i, now, words, begin, count):
    return nearest(model, state, i, now, words, begin, count, 0, NOBODY_MET)


@inner
def predict(model, state, neighbors, calendar, tally, i, now, met, word):
    """Schedule the next event of component i (lines 14 to 23 of Figure 2).

    ``word`` is what the search for i found. ``met`` is the word under which i has just collided, or none:
    those two do not collide again at the same time (condition V), even where rounding has them overlap and
    approach; in a small box they may, under another word.
    """
    rows = state.rows
    held = np.int64(state.partner[i])
    rows[i].due = NEVER
    state.partner[i] = LAMBDA
    due = NEVER
    j = np.int64(-1)
    clamped = False
    searched = False
    while word >= 0:
        j = np.int64(index(model.boundary, word))
        due, clamped = meet(model.sight, model, state, i, word, now)
        again = word == met and due == now
        if not again and (searched or due <= rows[np.uint64(j)].due):
            break
        # The two just met, or the search was made before the other half of a collision took this candidate.
        searched = True
        due = NEVER
        word = search(model, state, neighbors, i, now, 0, met if again else NOBODY_MET)
    blocked = head_for(model.obstacles, model, state, i, now, due, True)
    if due < NEVER and not blocked:
        pair_up(model, state, calendar, i, word, due)
        tally.clamped += np.int64(clamped)
        tally.returns += np.int64(met >= 0 and j == np.int64(index(model.boundary, met)))
    if held >= 0:
        release(model, state, calendar, i, held)


@generic
def head_for(obstacles, model, state, i, now, due, every):
    """Give i an event with the obstacle that it touches before the time ``due``; False if there is none."""
    raise NotImplementedError(type(obstacles))


@head_for.register
def _(obstacles: None, model, state, i, now, due, every):
    return False


@head_for.register
def _(obstacles: Obstacles, model, state, i, now, due, every):
    t, number = soonest(obstacles, model, state, i, now, every)
    if now + t >= due:
        return False
    state.rows[i].due = now + t
    state.partner[i] = OBSTACLE - number
    return True


@inner
def look_on(model, state, calendar, i, now):
    """Look for obstacles in the images of the box that have come into view with the last change of sector."""
    held = np.int64(state.partner[i])
    if head_for(model.obstacles, model, state, i, now, state.rows[i].due, False):
        note(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@inner
def release(model, state, calendar, i, held):
    """Leave the partner that i was given before it chose for itself with an advancement, unless i chose the
    same.
    """
    j = np.uint64(index(model.boundary, held))
    back = np.int64(state.partner[j])
    if back < 0 or np.uint64(index(model.boundary, back)) != i:
        return
    chosen = np.int64(state.partner[i])
    if chosen < 0 or np.uint64(index(model.boundary, chosen)) != j:
        state.partner[j] = LAMBDA
        note(state, calendar, j)


@inner
def pair_up(model, state, calendar, i, word, due):
    """Give i and the component that ``word`` names their new event; a third party is left with an
    advancement.
    """
    rows = state.rows
    j = np.uint64(index(model.boundary, word))
    third = np.int64(state.partner[j])
    if third >= 0:
        m = np.uint64(index(model.boundary, third))
        if m != np.uint64(i):
            state.partner[m] = LAMBDA
            insert(calendar, m, np.float64(rows[j].due))
    rows[i].due = due
    rows[j].due = due
    state.partner[i] = word
    state.partner[j] = mirror(model.boundary, np.int64(i), word)


@inner
def note(state, calendar, i):
    """Enter component i into the calendar: at its new event, or where it leaves its sector before that.

    The partner of i needs no entry. If it leaves its sector first, it is in the calendar with that; if i
    does, i is noted again then.
    """
    insert(calendar, i, time_of(state, i))


@inner
def watch(model, state, neighbors, i, now):
    """Find when component i leaves its sector (the paper's line 5)."""
    state.leave[i] = transit_time(neighbors, model.motion, model.boundary, state, i, now)


@inner
def welcome(model, state, calendar, tally, i, now, word):
    """Schedule i with a newcomer to its neighbourhood, if they meet before the event that i has."""
    if word < 0:
        return
    rows = state.rows
    j = np.int64(index(model.boundary, word))
    due, clamped = meet(model.sight, model, state, i, word, now)
    if due < rows[i].due and due <= rows[np.uint64(j)].due:
        held = np.int64(state.partner[i])
        pair_up(model, state, calendar, i, word, due)
        tally.clamped += np.int64(clamped)
        note(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@inner
def start_over(model, state, neighbors, calendar, tally, i, now):
    """Schedule i anew where its change of sector made its partner's word void."""
    rows = state.rows
    held = np.int64(state.partner[i])
    held_due = rows[i].due
    j = np.uint64(0)
    if held >= 0:
        j = np.uint64(index(model.boundary, held))
        rows[j].due = NEVER
        state.partner[j] = LAMBDA
        state.partner[i] = LAMBDA
    found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
    predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
    if held >= 0 and state.partner[j] == LAMBDA and rows[j].due == NEVER:
        rows[j].due = held_due
    if held >= 0:
        note(state, calendar, j)
    note(state, calendar, i)


@inner
def advance(model, state, neighbors, i, now):
    """Bring the old event of component i to the time now, its position into the box."""
    row = state.rows[i]
    t = now - row.t
    row.t = now
    for axis in range(len(model.boundary.edges)):
        x = position(model.motion, axis, row.x[axis], row.v[axis], t)
        crossings = np.floor(x * model.boundary.inverse[axis])
        if crossings != 0.0:
            x -= crossings * model.boundary.edges[axis]
            count_images(state.images, i, axis, np.int64(crossings))
            wrapped(neighbors, i, axis, crossings)
        row.x[axis] = x
        row.v[axis] = velocity(model.motion, axis, row.v[axis], t)


@inner
def collide(model, state, neighbors, tally, by_species, log, i, word, now):
    """Process both halves of a collision: advance, jump, settle."""
    rows = state.rows
    j = np.uint64(index(model.boundary, word))
    advance(model, state, neighbors, i, now)
    advance(model, state, neighbors, j, now)
    me = rows[i]
    other = rows[j]
    rr = 0.0
    rv = 0.0
    for axis in range(len(model.boundary.edges)):
        r = separation(model.boundary, i, word, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))
        rr += r * r
        rv += r * (np.float64(other.v[axis]) - np.float64(me.v[axis]))
    a, b, virial = jump(model.pair, np.int64(i), np.int64(j), rr, rv, now)
    # By surfaces that grow towards each other a contact is faster than by the centres.
    rate = growth(model.pair, np.int64(i)) + growth(model.pair, np.int64(j))
    part = transfer(model.impact, rr, rv - np.sqrt(rr) * rate)
    a *= part
    b *= part
    virial *= part
    for axis in range(len(model.boundary.edges)):
        r = separation(model.boundary, i, word, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))
        me.v[axis] += a * r
        other.v[axis] -= b * r
    tally.collisions += 1
    tally.virial += virial
    tally.depth = max(tally.depth, depth(model.pair, np.int64(i), np.int64(j), rr, now))
    count_pair(by_species, np.int64(i), np.int64(j), virial)
    record(log, state.clock[0], np.int64(i), word, virial / np.sqrt(rr))
    rows[i].due = NEVER
    rows[j].due = NEVER
    state.partner[i] = LAMBDA
    state.partner[j] = LAMBDA


@generic
def rebound(obstacles, model, state, neighbors, log, i, partner, now):
    """Process the collision of i with an obstacle; False if its event is an advancement."""
    raise NotImplementedError(type(obstacles))


@rebound.register
def _(obstacles: None, model, state, neighbors, log, i, partner, now):
    return False


@rebound.register
def _(obstacles: Obstacles, model, state, neighbors, log, i, partner, now):
    if partner == LAMBDA:
        return False
    advance(model, state, neighbors, i, now)
    momentum = bounce(model, state, i, OBSTACLE - partner, now)
    record(log, state.clock[0], np.int64(i), partner, momentum)
    return True


@inner
def new_epoch(model, state, neighbors):
    """Begin the next epoch: every old event is brought to its beginning, every time reduced by its length."""
    clock = state.clock[0]
    length = clock.length
    for i in range(np.uint64(len(state.partner))):
        advance(model, state, neighbors, i, length)
        state.rows[i].t = 0.0
        state.rows[i].due -= length
        state.leave[i] -= length
    age(model.pair, length)
    clock.epoch += 1
    clock.now = 0.0


def _schedule(digest):
    def schedule(model, state, neighbors, calendar, tallies, by_species, begin, end):
        """Schedule the components from ``begin`` to ``end`` at the present time.

        The neighbour scheme is built with the first, and the calendar laid out with the last of them.

        Returns
        -------
        done : bool
            False if an array is too small for the neighbour scheme.
        """
        digest  # noqa: B018 (part of the cache's key)
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        calendar, tallies = borrowed(calendar), borrowed(tallies)
        rows = state.rows
        partner = state.partner
        now = state.clock[0].now
        tally = tallies[0]
        n = np.uint64(len(partner))
        if begin == 0:
            if not settle(neighbors, model.motion, model.boundary, state):
                return False
            calendar.control[0].end = -NEVER  # nothing enters the calendar until all is known
            for i in range(n):
                rows[i].due = NEVER
                partner[i] = LAMBDA
        for i in range(np.uint64(begin), np.uint64(end)):
            found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
            predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
            watch(model, state, neighbors, i, now)
        if np.uint64(end) == n:
            lay_out(calendar, state, model.boundary, now, state.clock[0].length)
        return True

    return schedule


def _run(digest):
    def run(
        model, state, neighbors, calendar, tallies, by_species, log, end_epoch, end_time, collisions, cycles
    ):
        """Run the main cycle and say why it returned.

        Parameters
        ----------
        end_epoch, end_time : int, float
            Return before the first event later than this.
        collisions : int
            Return after the collision of this number.
        cycles : int
            Return after so many cycles.
        """
        digest  # noqa: B018 (part of the cache's key)
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        calendar, tallies = borrowed(calendar), borrowed(tallies)
        by_species, log = borrowed(by_species), borrowed(log)
        clock = state.clock[0]
        tally = tallies[0]
        control = calendar.control[0]
        while True:
            if control.full != 0:
                lay_out(calendar, state, model.boundary, clock.now, clock.length)
            if control.waiting + ROOM > len(calendar.due):
                return NEEDS_HEAP
            chosen = first(calendar, state, neighbors, model.boundary, model.motion)
            if chosen == -2:
                return NEEDS_HEAP
            last = clock.epoch == end_epoch
            if chosen == -1:
                if last and end_time < control.end:
                    return REACHED_TIME
                adapt(calendar, clock.length)
                start = control.end
                if start >= clock.length:
                    new_epoch(model, state, neighbors)
                    start = 0.0
                if lay_out(calendar, state, model.boundary, start, clock.length) == NEVER:
                    return IDLE
                continue
            i = np.uint64(chosen)
            leaves = leaves_first(state, i)
            now = calendar.due[0]
            if (last and now > end_time) or clock.epoch > end_epoch:
                return REACHED_TIME
            if tally.collisions >= collisions:
                return REACHED_COLLISIONS
            if cycles == 0:
                return SPENT
            if log_full(log):
                return NEEDS_LOG
            cycles -= 1
            control.cycles += 1
            clock.now = now
            if leaves:
                done, words, begin, count = transit(neighbors, model.motion, model.boundary, state, i, now)
                if not done:
                    return NEEDS_NEIGHBORS
                pop(calendar)
                tally.transits += 1
                watch(model, state, neighbors, i, now)  # first, so that it does not wait for the search
                note(state, calendar, i)
                if lasting(model.boundary):
                    found = first_newcomer(neighbors, model, state, i, now, words, begin, count)
                    welcome(model, state, calendar, tally, i, now, found)
                    look_on(model, state, calendar, i, now)
                else:
                    start_over(model, state, neighbors, calendar, tally, i, now)
                continue
            pop(calendar)
            word = np.int64(state.partner[i])
            if word < 0:
                thrown = rebound(model.obstacles, model, state, neighbors, log, i, word, now)
                tally.advancements += np.int64(not thrown)
                found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
                predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
                if thrown:
                    watch(model, state, neighbors, i, now)
                note(state, calendar, i)
                continue
            j = np.uint64(index(model.boundary, word))
            if j < i:  # the same bits, whichever of the two was found first
                word = np.int64(mirror(model.boundary, np.int64(i), word))
                i, j = j, i
            collide(model, state, neighbors, tally, by_species, log, i, word, now)
            change_home(neighbors, model.motion, model.boundary, state, i, now)
            change_home(neighbors, model.motion, model.boundary, state, j, now)
            watch(model, state, neighbors, i, now)
            watch(model, state, neighbors, j, now)
            # Two searches that do not wait for each other.
            found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
            ask_calendar(calendar, state, model.boundary, found)
            other = search(model, state, neighbors, j, now, 1, NOBODY_MET)
            ask_calendar(calendar, state, model.boundary, other)
            for _ in range(2):
                predict(model, state, neighbors, calendar, tally, i, now, word, found)
                note(state, calendar, i)
                word = np.int64(mirror(model.boundary, np.int64(i), word))
                i, j, found = j, i, other

    return run


schedule = entry(_schedule)
run = entry(_run)
