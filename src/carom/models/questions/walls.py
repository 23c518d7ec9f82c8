"""What the engine asks of the walls of the box, and of a motion that meets them."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import optional
from carom.models.questions.particles import NEVER


@optional
def soonest_wall(walls, x, v, radius, growth):
    """Return the time until a particle touches a wall of the box, or NEVER, and the number of that wall.

    The lower wall of an axis has the number ``2 axis``, the upper one ``2 axis + 1``.
    """
    return NEVER, np.int64(-1)


@optional
def landing_on_wall(walls, g, x, v, radius, growth):
    """Return :func:`soonest_wall` on a parabola: every particle has the acceleration ``g``, d floats."""
    return NEVER, np.int64(-1)


@optional
def wall_normal(walls, number, axis):
    """Return a coordinate of the unit vector from wall ``number`` into the box.

    It is 0 if the number is not that of a wall.
    """
    return 0.0


@optional
def yields(walls, motion, x, v, radius, growth, t):
    """Return whether a contact with an obstacle after a time ``t`` comes before one with the walls.

    It is asked where a wall is met no later. By default that wall is met: nothing lies in its plane.
    """
    return False


@optional
def wall_meeting(motion, walls, x, v, radius, growth):
    """Return :func:`soonest_wall` for particles in this motion; asked of the motion."""
    return soonest_wall(walls, x, v, radius, growth)
