"""When two components meet, as it is scheduled: with all digits, from however far away it was found."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.boundary import index, separation
from carom.kernel.dispatch import generic, inner
from carom.kernel.motion import position, velocity
from carom.kernel.pair import contact_time, depth

FAR = 32.0
"""Contact distances from which a contact is computed again from nearby.

A distance r squared is rounded by ``eps r^2``, hence that of contact by ``eps (r / sigma)^2 / 2``: by 1e-13
from 32 diameters, which is less than a scene tolerates.
"""


class FarSight(NamedTuple):
    """Sectors so wide that contacts are found from far away."""

    nearness: float = 1.0 / FAR**2
    """Contact distance over distance, squared, below which one is far away."""


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


@generic
def meet(sight, model, state, i, word, now):
    """Return when i touches the candidate that a search found, and whether a negative time was clamped."""
    raise NotImplementedError(type(sight))


@meet.register
def _(sight: None, model, state, i, word, now):
    rr, rv, vv = relative(model, state, i, word, now)
    t, clamped = contact_time(model.pair, np.int64(i), np.int64(index(model.boundary, word)), rr, rv, vv, now)
    return now + t, clamped


@meet.register
def _(sight: FarSight, model, state, i, word, now):
    due, clamped = meet(None, model, state, i, word, now)
    rr, _, vv = relative(model, state, i, word, now)
    nearness = depth(model.pair, np.int64(i), np.int64(index(model.boundary, word)), rr, now)
    if nearness < sight.nearness:
        # Two diameters of flight before the contact.
        near = max(due - 2.0 * np.sqrt(nearness * rr / vv), now)
        due, _ = meet(None, model, state, i, word, near)
    return due, clamped


@meet.register
def _(sight: NearSight, model, state, i, word, now):
    return meet(None, model, state, i, word, sight.near[i])
