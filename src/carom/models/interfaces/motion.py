"""What the engine asks of a motion between two events."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from carom.compiling.registry import Questions
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.interfaces.walls import soonest_wall
from carom.models.mathematics.double_double import exact_product, exact_sum, with_product


class Motion(Protocol):
    """A motion as users write it.

    It may also have:

    - ``check(scene)``, as an :class:`Interaction`;
    - ``conserves(axis)``, whether it conserves the total momentum along an axis (true if left out);
    - ``straight = False``, if particles do not fly straight and uniformly between two events;
    - ``curved = True``, if they do not fly straight relative to each other either.
    """

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class MotionModel(Questions):
    """What a motion answers."""

    def position(self, axis, x, v, t):
        """Return the coordinate at a time ``t`` after it was ``x`` with the velocity ``v``.

        The time may be negative.
        """
        raise NotImplementedError

    def velocity(self, axis, v, t):
        """Return the velocity's coordinate at a time ``t`` after it was ``v``."""
        raise NotImplementedError

    def exit_time(self, axis, x, v, low, high):
        """Return the time until a coordinate leaves the interval from ``low`` to ``high``, and at which end.

        Parameters
        ----------
        axis : int
            The axis.
        x, v : float
            Coordinate and velocity now; x is in the interval up to rounding.
        low, high : float
            The ends [length].

        Returns
        -------
        t : float
            The time, not negative; NEVER if the coordinate stays inside.
        up : int
            1 at the upper end, 0 at the lower one.

        Notes
        -----
        The default is for straight, uniform motion, where only the end ahead can be reached. A motion on
        curved paths answers for both ends, and its value has ``straight = False``.
        """
        up = v > 0.0
        end = high if up else low
        return max((end - x) / v, 0.0) if v != 0.0 else NEVER, up

    def carry(self, x, v, t, there, then):
        """Move all coordinates of a particle at once, if they depend on each other.

        Parameters
        ----------
        x, v : (d,) arrays
            Position [length] and velocity.
        t : float
            Duration of the motion.
        there, then : (d,) arrays
            A curved motion writes position and velocity after that time into them; they may be x and v.

        Returns
        -------
        x, v, t
            State from which :meth:`position` and :meth:`velocity` continue, axis by axis, and the remaining
            time. By default nothing has moved; a curved motion returns ``there, then, 0.0``.
        """
        return x, v, t

    def push_direction(self, axis, x, r, rr):
        """Return a coordinate of the direction in which a contact pushes a particle.

        Parameters
        ----------
        axis : int
            The axis.
        x : float
            Coordinate of the particle [length].
        r : float
            Coordinate of the vector to the other particle [length]; by default the direction is that of r.
        rr : float
            Square of the length of that vector [length^2].
        """
        return r

    def meeting_time(self, me, other, now, contact, rate, limit, span):
        """Return the time from now until two particles touch, on paths curved relative to each other.

        Parameters
        ----------
        me, other : records
            The old events of both: fields x and v, (d,), and t.
        now : float
            Time since the beginning of the epoch.
        contact, rate : float
            Distance of contact now [length], and the rate at which it grows.
        limit : float
            Latest time of interest. For a later contact NEVER may be returned.
        span : float
            Time up to which to search. It is the same in all calls, so that a contact has the same bits in
            all.

        Returns
        -------
        t : float
            The time, not negative, or NEVER.
        clamped : bool
            Whether the two are already in contact, by rounding.
        """
        return NEVER, False

    def rest_speed(self):
        """Return the least speed at which a particle leaves an obstacle after a contact; by default 0.

        In a uniform field, or on an obstacle that accelerates, one at rest would stay in contact. A lasting
        contact has no next event.
        """
        return 0.0

    def normal_acceleration(self, normal):
        """Return the acceleration towards a surface with the unit ``normal``."""
        return 0.0

    def rebound_speed(self, approach):
        """Return the normal velocity that an elastic contact adds, for an ``approach`` before it."""
        return 2.0 * approach

    def bend(self):
        """Return a bound on the magnitude of the acceleration between two events; by default 0.

        A motion with ``straight = False`` that answers it can have neighbor lists.
        """
        return 0.0

    def push(self, change, v, normal):
        """Add ``change`` along a unit normal to the velocity ``v``, in place.

        Parameters
        ----------
        change : float
            What the contact adds to the velocity along the normal.
        v, normal : sequences of d floats
            Velocity before the contact, and the normal.
        """
        # A contact on a circle is found just outside it, and its distance from the center is rounded alike
        # every time: unit normals are too long by 1e-16 on average. What is lost at every bounce in the same
        # direction, be it a part of 1e-17, adds up over millions. So all is computed with twice the digits,
        # and only the new velocity is rounded.
        along = 0.0
        high, low = 0.0, 0.0
        longer, rest = -1.0, 0.0
        for axis in range(len(normal)):
            along += normal[axis] * v[axis]
            high, low = with_product(high, low, normal[axis], v[axis])
            longer, rest = with_product(longer, rest, normal[axis], normal[axis])
        # Of an elastic contact the change is -2 along / normal^2; the caller had -2 along.
        more = -2.0 * ((high - along) + low) - change * (longer + rest)
        for axis in range(len(normal)):
            product, product_error = exact_product(change, normal[axis])
            total, error = exact_sum(v[axis], product)
            v[axis] = total + (error + (product_error + more * normal[axis]))

    def meeting(self, obstacle, x, v, radius, growth, now):
        """Return ``encounter`` of an obstacle for particles in this motion.

        Parameters
        ----------
        obstacle : model
            The obstacle.
        x, v, radius, growth
            As for ``encounter`` of an obstacle.
        now : float
            Time since the beginning of the epoch.
        """
        return obstacle.arrival(x, v, radius, growth, now)

    def wall_meeting(self, walls, x, v, radius, growth):
        """Return :func:`~carom.models.interfaces.walls.soonest_wall` for particles in this motion."""
        return soonest_wall(walls, x, v, radius, growth)

    def position_at(self, axis, x, v, t, now):
        """Return a coordinate at the time ``now``, a time ``t`` after the state was x, v (d,)."""
        return self.position(axis, x[axis], v[axis], t)

    def velocity_at(self, axis, v, t):
        """Return a coordinate of the velocity a time ``t`` after it was v (d,)."""
        return self.velocity(axis, v[axis], t)

    def in_space(self, axis, x, now):
        """Return a coordinate in space.

        At the time ``now`` x (d,) is along the axes of the box.
        """
        return x[axis]

    def relative_to(self, boundary, i, ref, me, other, now):
        """Return r.r, r.v and v.v of an image relative to i.

        Parameters
        ----------
        boundary : model
            What edges of the box do.
        i, ref : int
            The particle, and the reference to the image of the other.
        me, other : records
            The old events of both.
        now : float
            Time since the beginning of the epoch.
        """
        # The loop over axes is here: one question an axis cost 5 % of the rate (decision 14).
        rr = 0.0
        rv = 0.0
        vv = 0.0
        for axis in range(len(boundary.edges)):
            x = self.position(axis, me.x[axis], me.v[axis], now - me.t)
            y = self.position(axis, other.x[axis], other.v[axis], now - other.t)
            r = boundary.separation(i, ref, axis, y - x)
            # As the search does, whatever the rows hold: in double precision.
            v = np.float64(self.velocity(axis, other.v[axis], now - other.t)) - np.float64(
                self.velocity(axis, me.v[axis], now - me.t)
            )
            rr += r * r
            rv += r * v
            vv += v * v
        return rr, rv, vv

    def candidate_relative_to(self, boundary, i, ref, me, block, k, now):
        """Return the same of a candidate whose old event is in column k of the block.

        The other parameters are as for :meth:`relative_to`.
        """
        rr = 0.0
        rv = 0.0
        vv = 0.0
        dimension = len(boundary.edges)
        elapsed = now - block[dimension, k]
        for axis in range(dimension):
            x = self.position(axis, me.x[axis], me.v[axis], now - me.t)
            y = self.position(
                axis,
                block[axis, k],
                block[dimension + 1 + axis, k],
                elapsed,
            )
            r = boundary.separation(i, ref, axis, y - x)
            v = self.velocity(axis, block[dimension + 1 + axis, k], elapsed) - self.velocity(
                axis, me.v[axis], now - me.t
            )
            rr += r * r
            rv += r * v
            vv += v * v
        return rr, rv, vv

    def contact_vector(self, boundary, i, ref, axis, me, other, now):
        """Return a coordinate of the image relative to i, where both old events are of now.

        Parameters are as for :meth:`relative_to`, and the axis.
        """
        return boundary.separation(i, ref, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))

    def contact_velocity(self, boundary, i, ref, axis, me, other):
        """Return a coordinate of its velocity relative to i, likewise.

        Parameters are as for :meth:`relative_to`, and the axis.
        """
        return np.float64(other.v[axis]) - np.float64(me.v[axis])

    def exit_time_at(self, axis, me, now, low, high):
        """Return the time from now until a coordinate leaves an interval, and at which end.

        Parameters are as for :meth:`exit_time`, with the old event ``me`` in the place of x and v.
        """
        v = np.float64(me.v[axis])
        x = self.position(axis, me.x[axis], v, now - me.t)
        return self.exit_time(axis, x, self.velocity(axis, v, now - me.t), low, high)
