"""What the engine asks of an obstacle, at rest or moving on a path, and of a motion that meets it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from carom.compiling.registry import Questions
from carom.models.interfaces.memory import Model


@runtime_checkable
class Obstacle(Protocol):
    """The interface of an obstacle.

    It may also have:

    - ``glides(axis)``, whether it takes up no momentum along an axis;
    - ``area(box)``, its surface area [length^(d-1)];
    - ``inside(box)``, the inner width of a container [length];
    - ``confines(normal)``, the least and the greatest offset, at rest or while it moves, of the plane with
      this unit normal behind which it lets no surface of a particle; None if there is none. Where that is
      the plane of a wall of the box, the obstacle stands for the wall;
    - ``outline(box, periodic)`` and ``surface(box, periodic)``, shapes to draw in two and in three dimensions
      (``carom.models.obstacles.outlines``);
    - ``live(particles)``, which replaces ``model()`` in the engine, for an obstacle that moves, loses energy
      or has a memory;
    - ``adds_energy = True``, if contacts add a part of the energy that a particle has, of which a simulation
      warns otherwise.
    """

    @property
    def name(self) -> str:
        """Name in messages and results."""

    def gap(
        self, positions: np.ndarray, radii: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
    ) -> np.ndarray:
        """Return each particle's distance from the obstacle, surface to surface, (n,) [length].

        It is negative for particles that overlap the obstacle.

        Parameters
        ----------
        positions : (n, d) array
            Centers [length].
        radii : (n,) array
            Radii [length].
        box : sequence of d floats
            Edges [length].
        periodic : sequence of d bools
            Which axes are periodic.
        """

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle does not fit this box."""

    def model(self) -> Any:
        """Return the model that the engine compiles, an :class:`ObstacleModel`."""


def rebound(motion, v, normal, approach):
    """Throw back a particle of the velocity ``v``, (d,), from what comes at the speed ``approach``."""
    for axis in range(len(v)):
        approach -= normal[axis] * v[axis]
    motion.push(motion.rebound_speed(approach), v, normal)


class ObstacleModel(Model):
    """What an obstacle, at rest or moving, answers."""

    def encounter(self, x, v, radius, growth):
        """Return the time until a particle touches the obstacle, not negative, or NEVER.

        Parameters
        ----------
        x, v : (d,) float64 arrays
            Position of the center [length] and velocity.
        radius, growth : float
            Radius [length], and the rate at which it grows.

        Notes
        -----
        The time is 0 for a particle that touches and approaches, or that is inside by rounding and goes
        deeper. A particle that moves away does not touch.
        """
        raise NotImplementedError

    def outward(self, x, axis):
        """Return a coordinate of the unit normal, away from the obstacle, where a particle at x touches."""
        raise NotImplementedError

    def is_periodic(self):
        """Return whether the obstacle stands in every image of the box; by default it does not."""
        return False

    def anchor(self, axis):
        """Return a coordinate of the obstacle's center, whose periodic image is that of the obstacle."""
        return 0.0

    def arrival(self, x, v, radius, growth, now):
        """Return :meth:`encounter` at the time ``now`` of the epoch, in straight flight.

        By default the obstacle does not move.
        """
        return self.encounter(x, v, radius, growth)

    def fall(self, g, x, v, radius, growth, now):
        """Return :meth:`encounter` on a parabola: every particle has the acceleration ``g``, d floats."""
        raise NotImplementedError

    def time_to_moving(self, course, start, g, x, v, radius, growth):
        """Return :meth:`encounter` on a parabola, of an obstacle that is displaced along a ``course``.

        The obstacle is where it is not displaced. The time of its path is ``start`` now, and ``g`` the
        acceleration of the particle.
        """
        raise NotImplementedError

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        """Set ``v``, (d,) float64, to the velocity of particle i after the contact.

        By default the contact is elastic in the frame of the obstacle (:meth:`surface_speed`).

        Parameters
        ----------
        motion : model
            The motion of the particles.
        i : int
            The particle.
        mass : float
            Its mass.
        x, v : (d,) float64 arrays
            Position of its center, and velocity.
        normal : (d,) float64 array
            Unit vector along which the particle is thrown back.
        growth, now : float
            Rate at which its radius grows, and time since the beginning of the epoch.
        """
        rebound(motion, v, normal, growth + self.surface_speed(normal, now))

    def surface_speed(self, normal, now):
        """Return the velocity of the obstacle along the unit ``normal`` at the time ``now``; by default 0."""
        return 0.0

    def surface_velocity(self, axis, now):
        """Return a coordinate of the velocity of the surface at the time ``now``; by default 0.

        Of it a thermal surface (``obstacles.surfaces``) uses the part along the surface. What is along the
        normal is asked with :meth:`surface_speed`.
        """
        return 0.0

    def rest_speed(self):
        """Return the least speed at which a particle leaves the obstacle after a contact; by default 0."""
        return 0.0

    def at_time(self, now):
        """Set the time of the contact for the next calls of :meth:`outward` and :meth:`anchor`."""
        return


LIVE = ("recoil", "surface_speed", "at_time", "shift_epoch", "copy_state")
"""What is asked only of obstacles that move, lose energy or have a memory."""


class PathModel(Questions):
    """What the path of an obstacle answers."""

    def place(self, t):
        """Return the displacement at a time since the start of the run, reduced by whole periods [length]."""
        raise NotImplementedError

    def pace(self, t):
        """Return the velocity at that time: the derivative of :meth:`place`."""
        raise NotImplementedError
