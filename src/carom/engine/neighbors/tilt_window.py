"""Lists in a lattice that tilts (``carom.models.motions.shear``): distances over a window of tilts.

Points move with the stream and drift apart, so two are listed if theirs are near at *any* tilt of a window.
Lists are made anew before the tilt leaves it. None in its place is a box at rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner, optional
from carom.engine.lattice import position_at, velocity_at
from carom.engine.neighbors.points import grid_coordinate, grid_difference
from carom.models.motions.shear import LISTED_STRAIN, Sheared, tilt_at


class TiltWindow(NamedTuple):
    """The tilts that lists are made for."""

    middle: np.ndarray  # of the window, (1,) float64
    half: float  # half of its width


def make_tilt_window(motion) -> TiltWindow | None:
    """Return the window of the model of a motion, or None where no lattice tilts."""
    return TiltWindow(np.zeros(1), 0.5 * LISTED_STRAIN) if isinstance(motion, Sheared) else None


@inner
def open_window(window, motion):
    """Let the window begin with the tilt at the beginning of the epoch."""
    if window is not None:
        window.middle[0] = motion.tilt[0] + math.copysign(window.half, motion.rate)


@inner
def ends_with(window, motion, length):
    """Tell whether the window ends in the epoch of this length that begins."""
    if window is None:
        return False
    return abs(tilt_at(motion, length) - window.middle[0]) > window.half


@inner
def least_difference(window, lists, to, since, axis):
    """Return the component along an axis of the way between two reference points, where it is shortest."""
    r = grid_difference(lists, to, since, axis)
    if window is None:
        return r
    if axis == 0:
        up = grid_difference(lists, to, since, 1)
        r = max(abs(r + window.middle[0] * up) - window.half * abs(up), 0.0)
    return r


@inner
def _along_lattice(motion, lists, boundary, me, point, axis, now):
    x = position_at(motion, axis, me.x, me.v, now - me.t, now)
    r = x - grid_coordinate(lists, point, axis) * lists.grid_step[axis]
    return r - boundary.edges[axis] * np.rint(r * boundary.inverse[axis])


@optional
def from_reference(motion, lists, boundary, me, point, axis, now):
    """Return a coordinate of the way to a component, whose old event is ``me``, from its reference point."""
    return _along_lattice(motion, lists, boundary, me, point, axis, now)


@optional
def speed_from_reference(motion, lists, boundary, me, point, axis, now):
    """Return how fast that changes."""
    return np.float64(me.v[axis])


@from_reference.register
def _(motion: Sheared, lists, boundary, me, point, axis, now):
    r = _along_lattice(motion, lists, boundary, me, point, axis, now)
    if axis == 0:
        r += tilt_at(motion, now) * _along_lattice(motion, lists, boundary, me, point, 1, now)
    return r


@speed_from_reference.register
def _(motion: Sheared, lists, boundary, me, point, axis, now):
    v = np.float64(velocity_at(motion, axis, me.v, now - me.t))
    if axis == 0:
        v += motion.rate * _along_lattice(motion, lists, boundary, me, point, 1, now)
    return v


@inner
def half_square(window, lists, to, since, axis):
    """Return half of the square of a move along an axis, where it is longest."""
    step = grid_difference(lists, to, since, axis)
    if window is None:
        return 0.5 * step * step
    if axis == 0:
        up = grid_difference(lists, to, since, 1)
        step = abs(step + window.middle[0] * up) + window.half * abs(up)
    return 0.5 * step * step


@inner
def pull(window, lists, to, since, axis):
    """Return the factor of a coordinate in the product of a way with a move, and its change in the window.

    The factor is that of the middle of the window.
    """
    step = grid_difference(lists, to, since, axis)
    spread = 0.0
    if window is None:
        return step, spread
    if axis < 2:
        tilt = window.middle[0]
        along, up = grid_difference(lists, to, since, 0), grid_difference(lists, to, since, 1)
        step = along + tilt * up
        spread = window.half * abs(up)
        if axis == 1:
            spread = window.half * (abs(step + tilt * up) + spread)
            step = up + tilt * step
    return step, spread


@inner
def reached(window, step, spread, low, high):
    """Return the largest product of an interval of coordinates with what :func:`pull` returns."""
    largest = max(low * step, high * step)
    if window is None:
        return largest
    return largest + spread * max(abs(low), abs(high))


@inner
def cell_gap(window, axis, low, high):
    """Return how far a cell from ``low`` to ``high`` along an axis is away, at least."""
    if window is None:
        return max(low, -high, 0.0)
    return max(low, -high, 0.0) if axis > 0 else 0.0
