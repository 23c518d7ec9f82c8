"""Where components are, alone and relative to each other: in the box, or in a lattice that tilts.

Only these functions know that under shear (``carom.models.motions.shear``) coordinates depend on each other.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import optional
from carom.engine.boundary import count_images
from carom.models.mathematics.parabolas import leaving
from carom.models.motions.shear import Sheared, tilt_at
from carom.models.questions.motion import exit_time, position, velocity

GRADIENT = 1
"""The axis along which a stream grows; it flows along axis 0."""


def tilt_of(motion, now: float) -> float | None:
    """Return the tilt of the lattice at a time of the epoch; None where none tilts."""
    return float(tilt_at(motion, now)) if isinstance(motion, Sheared) else None


def in_lattice(motion, positions: np.ndarray) -> np.ndarray:
    """Return positions (n, d) at the start as coordinates along the axes of the lattice, in the box."""
    if not isinstance(motion, Sheared) or motion.tilt[0] == 0.0:
        return positions
    found = positions.copy()
    found[:, 0] -= motion.tilt[0] * positions[:, 1]
    return found


@optional
def position_at(motion, axis, x, v, t, now):
    """Return a coordinate at the time ``now``, a time ``t`` after the state was x, v (d,)."""
    return position(motion, axis, x[axis], v[axis], t)


@optional
def velocity_at(motion, axis, v, t):
    """Return a coordinate of the velocity a time ``t`` after it was v (d,)."""
    return velocity(motion, axis, v[axis], t)


@optional
def relative_to(motion, boundary, i, ref, me, other, now):
    """Return r.r, r.v and v.v at ``now`` of the image ``ref`` relative to i, by the old events of both.

    The loop over axes is here: one question an axis cost 5 % of the rate
    (docs/decisions/14-transport-and-shear.md).
    """
    rr = 0.0
    rv = 0.0
    vv = 0.0
    for axis in range(len(boundary.edges)):
        x = position(motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(motion, axis, other.x[axis], other.v[axis], now - other.t)
        r = boundary.separation(i, ref, axis, y - x)
        # As the search does, whatever the rows hold: in double precision.
        v = np.float64(velocity(motion, axis, other.v[axis], now - other.t)) - np.float64(
            velocity(motion, axis, me.v[axis], now - me.t)
        )
        rr += r * r
        rv += r * v
        vv += v * v
    return rr, rv, vv


@optional
def candidate_relative_to(motion, boundary, i, ref, me, block, k, now):
    """Return the same of a candidate whose old event is in a column of the block."""
    rr = 0.0
    rv = 0.0
    vv = 0.0
    dimension = len(boundary.edges)
    elapsed = now - block[dimension, k]
    for axis in range(dimension):
        x = position(motion, axis, me.x[axis], me.v[axis], now - me.t)
        y = position(
            motion,
            axis,
            block[axis, k],
            block[dimension + 1 + axis, k],
            elapsed,
        )
        r = boundary.separation(i, ref, axis, y - x)
        v = velocity(motion, axis, block[dimension + 1 + axis, k], elapsed) - velocity(
            motion, axis, me.v[axis], now - me.t
        )
        rr += r * r
        rv += r * v
        vv += v * v
    return rr, rv, vv


@optional
def contact_vector(motion, boundary, i, ref, axis, me, other, now):
    """Return a coordinate of the image relative to i, where the old events of both are those of now."""
    return boundary.separation(i, ref, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))


@optional
def contact_velocity(motion, boundary, i, ref, axis, me, other):
    """Return a coordinate of its velocity relative to i, where the old events of both are those of now."""
    return np.float64(other.v[axis]) - np.float64(me.v[axis])


@optional
def exit_time_at(motion, axis, me, now, low, high):
    """Return the time from now until a coordinate leaves an interval, and at which end: ``exit_time``."""
    v = np.float64(me.v[axis])
    x = position(motion, axis, me.x[axis], v, now - me.t)
    return exit_time(motion, axis, x, velocity(motion, axis, v, now - me.t), low, high)


@optional
def remap(motion, state, edges, length):
    """At the end of an epoch lay the lattice anew if it must be; tell whether all must be scheduled again."""
    return False


@position_at.register
def _position_at_of_sheared(motion: Sheared, axis, x, v, t, now):
    speed = v[axis] - tilt_at(motion, now) * v[GRADIENT] if axis == 0 else np.float64(v[axis])
    return x[axis] + speed * t


@velocity_at.register
def _velocity_at_of_sheared(motion: Sheared, axis, v, t):
    return v[axis] - motion.rate * v[GRADIENT] * t if axis == 0 else np.float64(v[axis])


def _apart(motion, boundary, i, ref, axis, me, other, now):
    x = position_at(motion, axis, me.x, me.v, now - me.t, now)
    y = position_at(motion, axis, other.x, other.v, now - other.t, now)
    return boundary.separation(i, ref, axis, y - x)


@relative_to.register
def _relative_to_of_sheared(motion: Sheared, boundary, i, ref, me, other, now):
    rr = 0.0
    rv = 0.0
    vv = 0.0
    for axis in range(len(boundary.edges)):
        r = _apart(motion, boundary, i, ref, axis, me, other, now)
        v = np.float64(velocity_at(motion, axis, other.v, now - other.t)) - np.float64(
            velocity_at(motion, axis, me.v, now - me.t)
        )
        if axis == 0:
            up = _apart(motion, boundary, i, ref, 1, me, other, now)
            r += tilt_at(motion, now) * up
            v += motion.rate * up
        rr += r * r
        rv += r * v
        vv += v * v
    return rr, rv, vv


def _candidate_apart(motion, boundary, i, ref, axis, me, block, k, now):
    dimension = len(boundary.edges)
    elapsed = now - block[dimension, k]
    x = position_at(motion, axis, me.x, me.v, now - me.t, now)
    speed = np.float64(block[dimension + 1 + axis, k])
    if axis == 0:
        speed -= tilt_at(motion, now) * block[dimension + 2, k]
    return boundary.separation(i, ref, axis, block[axis, k] + speed * elapsed - x)


@candidate_relative_to.register
def _candidate_relative_to_of_sheared(motion: Sheared, boundary, i, ref, me, block, k, now):
    dimension = len(boundary.edges)
    elapsed = now - block[dimension, k]
    rr = 0.0
    rv = 0.0
    vv = 0.0
    for axis in range(dimension):
        r = _candidate_apart(motion, boundary, i, ref, axis, me, block, k, now)
        v = np.float64(block[dimension + 1 + axis, k])
        if axis == 0:
            up = _candidate_apart(motion, boundary, i, ref, 1, me, block, k, now)
            r += tilt_at(motion, now) * up
            v += motion.rate * (up - block[dimension + 2, k] * elapsed)
        v -= velocity_at(motion, axis, me.v, now - me.t)
        rr += r * r
        rv += r * v
        vv += v * v
    return rr, rv, vv


def _gradient_apart(boundary, i, ref, me, other):
    difference = np.float64(other.x[GRADIENT]) - np.float64(me.x[GRADIENT])
    return boundary.separation(i, ref, 1, difference)


@contact_vector.register
def _contact_vector_of_sheared(motion: Sheared, boundary, i, ref, axis, me, other, now):
    r = boundary.separation(i, ref, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))
    if axis == 0:
        r += tilt_at(motion, now) * _gradient_apart(boundary, i, ref, me, other)
    return r


@contact_velocity.register
def _contact_velocity_of_sheared(motion: Sheared, boundary, i, ref, axis, me, other):
    v = np.float64(other.v[axis]) - np.float64(me.v[axis])
    if axis == 0:
        v += motion.rate * _gradient_apart(boundary, i, ref, me, other)
    return v


@exit_time_at.register
def _exit_time_at_of_sheared(motion: Sheared, axis, me, now, low, high):
    x = position_at(motion, axis, me.x, me.v, now - me.t, now)
    v = np.float64(velocity_at(motion, axis, me.v, now - me.t))
    g = 0.0
    if axis == 0:  # along the tilting axis a flight is a parabola
        v -= tilt_at(motion, now) * me.v[GRADIENT]
        g = -2.0 * motion.rate * me.v[GRADIENT]
    return leaving(x, v, g, low, high)


@remap.register
def _remap_of_sheared(motion: Sheared, state, edges, length):
    motion.tilt[0] += motion.rate * length
    turns = np.rint(motion.tilt[0] / motion.ratio)
    if turns == 0.0:
        return False
    motion.tilt[0] -= turns * motion.ratio
    for i in range(len(state.partner)):
        me = state.rows[i]
        x = me.x[0] + turns * motion.ratio * me.x[GRADIENT]
        crossings = np.floor(x / edges[0])
        me.x[0] = x - crossings * edges[0]
        count_images(state.images, i, 0, crossings)
        shift_images(state.images, i, turns)
    return True


def shift_images(images, i, turns):
    """Refer the images of component i to a lattice whose tilt is less by so many boxes."""
    if images is not None:
        images[i, 0] += int(turns) * images[i, 1]
