"""Walls of the box, None where there are none, and the question of a motion that meets them."""

from __future__ import annotations

from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.parabolas import first_landing


def soonest_wall(walls, x, v, radius, growth):
    """Return the time until a particle touches a wall of the box, or NEVER, and the number of that wall.

    The lower wall of an axis has the number ``2 axis``, the upper one ``2 axis + 1``.
    """
    if walls is None:
        return NEVER, -1
    best = NEVER
    number = -1
    for axis in range(len(walls.lows)):
        upper = v[axis] > 0.0
        approach = abs(v[axis]) + growth
        ahead = walls.stands[2 * axis + 1] if upper else walls.stands[2 * axis]
        if ahead != 0 and approach > 0.0:
            gap = walls.highs[axis] - x[axis] - radius if upper else x[axis] - walls.lows[axis] - radius
            t = max(gap / approach, 0.0)
            if t < best:
                best = t
                number = 2 * axis + upper
        back = growth - abs(v[axis])
        other = walls.stands[2 * axis] if upper else walls.stands[2 * axis + 1]
        if growth > 0.0 and back > 0.0 and other != 0:  # it may be reached by growth
            gap = x[axis] - walls.lows[axis] - radius if upper else walls.highs[axis] - x[axis] - radius
            t = max(gap / back, 0.0)
            if t < best:
                best = t
                number = 2 * axis + 1 - upper
    return best, number


def landing_on_wall(walls, g, x, v, radius, growth):
    """Return :func:`soonest_wall` on a parabola: every particle has the acceleration ``g``, d floats."""
    if walls is None:
        return NEVER, -1
    best = NEVER
    number = -1
    for axis in range(len(walls.lows)):
        if walls.stands[2 * axis] != 0:
            t = first_landing(x[axis] - walls.lows[axis] - radius, v[axis] - growth, g[axis])
            if t < best:
                best = t
                number = 2 * axis
        if walls.stands[2 * axis + 1] != 0:
            t = first_landing(walls.highs[axis] - x[axis] - radius, -v[axis] - growth, -g[axis])
            if t < best:
                best = t
                number = 2 * axis + 1
    return best, number


def wall_normal(walls, number, axis):
    """Return a coordinate of the unit vector from wall ``number`` into the box; 0 if that is no wall."""
    if walls is None:
        return 0.0
    if number >> 1 != axis:
        return 0.0
    return 1.0 if number & 1 == 0 else -1.0


def yields(walls, motion, x, v, radius, growth, t):
    """Return whether a contact with an obstacle after a time ``t`` comes before one with the walls.

    It is asked where a wall is met no later. That wall is met, unless an obstacle lies in its plane.
    """
    return False if walls is None else _comes_before(walls.behind, motion, x, v, radius, growth, t)


def _comes_before(behind, motion, x, v, radius, growth, t):
    """Return whether a contact after a time ``t`` comes no later than one with the walls that stand back."""
    if behind is None:
        return False
    time_behind, _ = motion.wall_meeting(behind, x, v, radius, growth)
    return t < NEVER and t <= time_behind
