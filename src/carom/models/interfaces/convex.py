"""What the engine asks of a convex obstacle, and all that follows from its closest point.

A body says which of its points is closest. All of it lies behind the plane through that point across the
line to it, at every other time too: what has not come to that plane has not touched the body. So the search
goes from the contact with one plane to that with the next, which are known in closed form on parabolas and
bracketed where the body moves. In straight flight that is Newton's method. It never passes the first contact:
it reaches the last bit, or finds a miss.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.instructions import room_for
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.parabolas import first_landing, time_to_plane


def _plane_after_plane(body, course, start, g, x, v, radius, growth):
    """Return when a sphere touches a convex body, or NEVER.

    ``course`` is None where the body rests, ``g`` where the sphere flies straight.
    """
    dimension = len(body.as_place(x))
    there = room_for(x)  # relative to the body
    limit = NEVER
    if course is not None:
        moves = growth != 0.0
        for axis in range(dimension):
            moves = moves or v[axis] != 0.0 or g[axis] != 0.0
        limit = NEVER if moves else course.period
    t = 0.0
    while t <= limit and t < NEVER:
        shift = 0.0 if course is None else course.path.place(start + t)
        for axis in range(dimension):
            bend = 0.0 if g is None else 0.5 * g[axis] * t
            there[axis] = x[axis] + (v[axis] + bend) * t
            if course is not None:
                there[axis] -= course.direction[axis] * shift
        rr = 0.0
        speed = 0.0
        acceleration = 0.0
        slant = 0.0
        for axis in range(dimension):
            r = there[axis] - body.closest(there, axis)
            rr += r * r
            if g is None:
                speed += r * v[axis]
            else:
                speed += r * (v[axis] + g[axis] * t)
                acceleration += r * g[axis]
            if course is not None:
                slant += r * course.direction[axis]
        distance = np.sqrt(rr)
        height = distance - body.rounding() - radius - growth * t
        speed = speed / distance - growth
        if course is not None:
            acceleration /= distance
            slant /= distance
            step = time_to_plane(course, start + t, slant, height + slant * shift, speed, acceleration)
        elif g is not None:
            step = first_landing(height, speed, acceleration / distance)
        elif speed < 0.0:
            step = max(height, 0.0) / -speed
        else:
            step = NEVER
        if t + step == t:
            return t
        t += step
    return NEVER


class ConvexModel(ObstacleModel):
    """A convex body that says which of its points is closest: all else follows."""

    def closest(self, x, axis):
        """Return a coordinate of the point of the body that is closest to x, (d,).

        Distance, contacts on all flights, normal and pictures of a class of one's own follow from it.
        """
        raise NotImplementedError

    def rounding(self):
        """Return how far around that point the body is solid [length]; by default not at all."""
        return 0.0

    def as_place(self, x):
        """Return what is as long as a place; where it is a tuple, loops over axes are unrolled."""
        return x

    def encounter(self, x, v, radius, growth):
        """Answer for any convex body.

        Parameters are those of :meth:`~carom.models.interfaces.obstacle.ObstacleModel.encounter`.
        """
        return _plane_after_plane(self, None, 0.0, None, x, v, radius, growth)

    def outward(self, x, axis):
        """Answer for any convex body.

        Parameters are those of :meth:`~carom.models.interfaces.obstacle.ObstacleModel.outward`.
        """
        rr = 0.0
        for k in range(len(self.as_place(x))):
            r = x[k] - self.closest(x, k)
            rr += r * r
        return (x[axis] - self.closest(x, axis)) / np.sqrt(rr)

    def fall(self, g, x, v, radius, growth, now):
        """Answer for any convex body.

        Parameters are those of :meth:`~carom.models.interfaces.obstacle.ObstacleModel.fall`.
        """
        return _plane_after_plane(self, None, 0.0, g, x, v, radius, growth)

    def time_to_moving(self, course, start, g, x, v, radius, growth):
        """Answer for any convex body.

        Parameters are those of :meth:`~carom.models.interfaces.obstacle.ObstacleModel.time_to_moving`.
        """
        return _plane_after_plane(self, course, start, g, x, v, radius, growth)
