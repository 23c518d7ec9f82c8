"""What a collision does to both: advance, jump (with restitution), and the impulse and virial added up."""

from __future__ import annotations

import numpy as np

from carom.engine.advance import advance
from carom.engine.constants import LAMBDA
from carom.engine.observers.interface import PairEvent
from carom.engine.rules import on_crossing
from carom.engine.tangential_impulse import rub
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.contact import LONGER


def collide(model, state, neighbors, tally, i, ref, now):
    """Process both halves of a collision: advance, jump, and what is added up."""
    rows = state.rows
    j = model.boundary.index(ref)
    advance(model, state, neighbors, i, now)
    advance(model, state, neighbors, j, now)
    me = rows[i]
    other = rows[j]
    rr = 0.0
    rv = 0.0
    long_rr = 0.0
    long_rv = 0.0
    # On a line equal masses swap their velocities, but for rounding, and nothing is lost in between.
    longer = LONGER if len(model.boundary.edges) > 1 else 1.0
    for axis in range(len(model.boundary.edges)):
        r = model.motion.contact_vector(model.boundary, i, ref, axis, me, other, now)
        v = model.motion.contact_velocity(model.boundary, i, ref, axis, me, other)
        rr += r * r
        rv += r * v
        r *= longer
        long_rr += r * r
        long_rv += r * v
    a, b, virial, kind, before, step = model.boundary.outcome(
        model.pair, neighbors, tally, i, ref, long_rr, long_rv, now
    )
    # Surfaces that grow approach faster than the centers do.
    rate = model.pair.growth_of(i) + model.pair.growth_of(j)
    part = 1.0
    if model.impact is not None:
        part = model.impact.exchanged_part(i, j, rr, rv - np.sqrt(rr) * rate, now)
    a *= part
    b *= part
    virial *= part / longer
    event = PairEvent(i, j, ref, now, rr, rv, a * longer, b * longer, virial, kind, before, step)
    model.observers.before_pair(model, state, event)
    for axis in range(len(model.boundary.edges)):
        r = model.motion.contact_vector(model.boundary, i, ref, axis, me, other, now)
        me.v[axis] += a * (longer * model.motion.push_direction(axis, me.x[axis], r, rr))
        other.v[axis] += b * (longer * model.motion.push_direction(axis, other.x[axis], -r, rr))
    rub(model.impact, model, state, i, j, ref, rr, virial, now)
    on_crossing(model.rules, model, state, neighbors, i, j, ref, kind, now)
    model.observers.after_pair(model, state, event)
    tally.collisions += 1
    tally.virial += virial
    tally.depth = max(tally.depth, model.pair.core_square(i, j, now) / rr)
    model.observers.count_pair(i, j, virial)
    model.pair.record_impulse(i, j, virial / np.sqrt(rr))
    logged_ref = model.boundary.logged(ref, kind)
    model.observers.record(state.clock[0], i, logged_ref, virial / np.sqrt(rr))
    rows[i].event_time = NEVER
    rows[j].event_time = NEVER
    state.partner[i] = LAMBDA
    state.partner[j] = LAMBDA
