"""The next partner of a component, and the time: the minimum of the paper's line 4, over all candidates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.columns import LANES, WIDTH, spread
from carom.compiling.lanes import asked_of, line_up_fields
from carom.compiling.registry import fast, inner, optional, required
from carom.engine.images import NearestImage, SectorImage, index, index_bits, separation
from carom.engine.neighbors.interface import candidates, first_met, first_newcomer
from carom.engine.neighbors.lists import Lists
from carom.engine.neighbors.sectors import Sectors
from carom.engine.pair_steps import SteppedImage, step_of
from carom.models.contact import FAR, sure_contact
from carom.models.interface import (
    NEVER,
    contact_time,
    interaction_time,
    position,
    step_core_square,
    step_time,
    velocity,
)

NOBODY = np.int64(0x7FEFFFFFFFFFFFFF)
"""Bits of the largest finite float: nobody found."""

NOBODY_MET = np.int64(-1)
"""No word: nothing is left out of a search."""


@required
def time_until(boundary, pair, lanes, place, i, word, rr, rv, vv, now):
    """Return the time until i meets the candidate that a word names, and that is at a place of the lanes."""


@time_until.register
def _(boundary: NearestImage | SectorImage, pair, lanes, place, i, word, rr, rv, vv, now):
    return asked_of(interaction_time, pair, lanes, place, i, index(boundary, word), (rr, rv, vv, now))


@time_until.register
def _(boundary: SteppedImage, pair, lanes, place, i, word, rr, rv, vv, now):
    j, step = index(boundary, word), step_of(boundary, word)
    return asked_of(step_time, pair, lanes, place, i, j, (step, rr, rv, vv, now))


@fast
def nearest(model, state, i, now, words, begin, count, half, avoided):
    """Return the word of the candidate that i meets first, ``avoided`` left out, or -1, and the time until
    then, to 47 bits (the paper's line 4).

    The loop has no branch and no store, so that it is vectorised. The candidate's number replaces the last
    five bits of the time; the smallest of these integers is the earliest candidate.
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
            line_up_fields(model.pair, model.lanes, words, first, bits, half * WIDTH + np.int64(lane))
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
            place = room * np.uint64(WIDTH) + k
            t = time_until(model.boundary, model.pair, model.lanes, place, i, word, rr, rv, vv, now)
            free = (block[room, 2 * dimension + 1, k] >= now + t) & (np.int64(word) != avoided)
            free &= np.int64(k) < size  # what follows the last candidate is somebody's word, but not i's
            t = t if free else NEVER
            key = (np.float64(t).view(np.int64) & ~np.int64(WIDTH - 1)) | np.int64(k)
            earliest = min(earliest, key)
        if earliest < best:
            best = earliest
            chosen = np.int64(words[begin + np.uint64(start + (earliest & (WIDTH - 1)))])
    return chosen, np.int64(best & ~np.int64(WIDTH - 1)).view(np.float64)


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


class RowSight(NamedTuple):
    """Contacts that are computed from the younger of the two rows, or from shortly before them where that is
    far away.

    Their times are functions of the two rows alone, not of the moment at which somebody looks at the pair:
    scheduling leaves no trace in a run.
    """

    square: float
    """Square of how far two may fly relative to each other from the moment from which their contact is
    computed [length^2].
    """


class FarSteps(NamedTuple):
    """Pairs on steps with hard cores that are small compared with the reach of the steps: a contact may be
    found from far away, and is then computed again from nearby.

    From nearby only the time of the contact with the core is computed, not whether it occurs. Otherwise a
    graze that looks like a miss there would become an exit from the step, far later, and events in between
    would be missed. Crossings of other ends are not computed again: no pair overlaps if one is late by
    rounding.
    """

    nearness: float = 1.0 / FAR**2
    """Distance of the core over distance, squared, below which one is far away."""


class NearSight(NamedTuple):
    """Contacts that are found along paths of several boxes."""

    near: np.ndarray
    """A time shortly before the contact found last for each component, (n,): everybody's own array."""


@inner
def relative(model, state, i, word, now):
    """Return r.r, r.v and v.v of the candidate relative to i at the time now."""
    rows = state.rows
    me = rows[i]
    other = rows[np.uint64(index(model.boundary, word))]
    rr = 0.0
    rv = 0.0
    vv = 0.0
    for axis in range(len(model.boundary.edges)):
        x = position(model.motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(model.motion, axis, other.x[axis], other.v[axis], now - other.t)
        r = separation(model.boundary, i, word, axis, y - x)
        # As the search does, whatever the rows hold: in double precision.
        v = np.float64(velocity(model.motion, axis, other.v[axis], now - other.t)) - np.float64(
            velocity(model.motion, axis, me.v[axis], now - me.t)
        )
        rr += r * r
        rv += r * v
        vv += v * v
    return rr, rv, vv


@required
def surely(boundary, pair, i, word, rr, rv, vv, now):
    """Return the time until i meets the candidate that a search found, and whether a negative one was
    clamped.
    """


@surely.register
def _(boundary: NearestImage | SectorImage, pair, i, word, rr, rv, vv, now):
    return contact_time(pair, i, np.int64(index(boundary, word)), rr, rv, vv, now)


@surely.register
def _(boundary: SteppedImage, pair, i, word, rr, rv, vv, now):
    j, step = np.int64(index(boundary, word)), step_of(boundary, word)
    t = step_time(pair, i, j, step, rr, rv, vv, now)
    return t if t < NEVER else max(-rv / vv, 0.0), False


@optional
def meet(sight, model, state, i, word, now, t):
    """Return when i touches the candidate that a search found after a time t, and whether the time until then
    was negative, and clamped.
    """
    rr, rv, vv = relative(model, state, i, word, now)
    t, clamped = surely(model.boundary, model.pair, np.int64(i), word, rr, rv, vv, now)
    return now + t, clamped


@inner
def moment_before(square, vv, due):
    """Return a moment before the contact of a pair that is due about then: within the time in which it flies
    a distance of this square, and not before a quarter of it.

    It is a multiple of a power of two. The last bits of ``due``, which depend on when the pair was looked at,
    do not change it.
    """
    # Half the root of the quotient, to its leading bit, and the inverse.
    half = (((np.float64(square / vv).view(np.int64) >> 52) - 1023) >> 1) - 1
    step = np.int64((1023 + half) << 52).view(np.float64)
    steps = np.int64((1023 - half) << 52).view(np.float64)
    return (np.floor(due * steps) - 1.0) * step


@meet.register
def _(sight: RowSight, model, state, i, word, now, t):
    rows = state.rows
    due = now + t
    then = max(np.float64(rows[i].t), np.float64(rows[np.uint64(index(model.boundary, word))].t))
    rr, rv, vv = relative(model, state, i, word, then)
    if (due - then) * (due - then) * vv > sight.square:
        then = moment_before(sight.square, vv, due)
        rr, rv, vv = relative(model, state, i, word, then)
    t, clamped = surely(model.boundary, model.pair, np.int64(i), word, rr, rv, vv, then)
    return max(then + t, now), clamped


@meet.register
def _(sight: FarSteps, model, state, i, word, now, t):
    due, clamped = meet(None, model, state, i, word, now, t)
    rr, rv, vv = relative(model, state, i, word, now)
    core = step_core_square(model.pair, step_of(model.boundary, word))
    falls = (core > 0.0) & (rv < 0.0) & (rv * rv - vv * (rr - core) >= 0.0)
    if falls & (core < sight.nearness * rr):
        # Two diameters of flight before the contact.
        near = max(due - 2.0 * np.sqrt(core / vv), now)
        rr, rv, vv = relative(model, state, i, word, near)
        t, clamped = sure_contact(rr - core, rv, vv)
        due = near + t
    return due, clamped


@meet.register
def _(sight: NearSight, model, state, i, word, now, t):
    return meet(None, model, state, i, word, sight.near[i], t)
