"""What the engine asks of an obstacle, at rest or moving, and of a motion that meets it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from carom.compiling.registry import optional, required
from carom.models.questions.memory import copy_state, shift_epoch


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
        """Return the model that the engine compiles: a NamedTuple whose type answers the questions."""


@required
def encounter(obstacle, x, v, radius, growth):
    """Return the time until a particle touches the obstacle, not negative, or NEVER.

    Parameters
    ----------
    obstacle : model
        The obstacle.
    x, v : (d,) float64 arrays
        Position of the center [length] and velocity.
    radius, growth : float
        Radius [length], and the rate at which it grows.

    Notes
    -----
    The time is 0 for a particle that touches and approaches, or that is inside by rounding and goes deeper.
    A particle that moves away does not touch.
    """


@required
def outward(obstacle, x, axis):
    """Return a coordinate of the unit normal, away from the obstacle, where a particle at x touches it."""


@required
def closest(obstacle, x, axis):
    """Return a coordinate of the point of a convex obstacle that is closest to x, (d,).

    Distance, contacts on all flights, normal and pictures of a class of one's own follow from it.
    """


@optional
def rounding(obstacle):
    """Return how far around that point an obstacle is solid [length]; by default not at all."""
    return 0.0


@optional
def is_periodic(obstacle):
    """Return whether the ``obstacle`` stands in every image of the box; by default it does not."""
    return False


@optional
def anchor(obstacle, axis):
    """Return a coordinate of the obstacle's center, whose periodic image is that of the obstacle."""
    return 0.0


def members(crowd):
    """Return how many obstacles a crowd has: one a row of its first array."""
    return len(crowd[0])


@required
def member(crowd, k):
    """Return obstacle k of a crowd."""


@optional
def arrival(obstacle, x, v, radius, growth, now):
    """Return :func:`encounter` at the time ``now`` of the epoch, in straight flight; asked of the obstacle.

    By default the obstacle does not move.
    """
    return encounter(obstacle, x, v, radius, growth)


@required
def fall(obstacle, g, x, v, radius, growth, now):
    """Return :func:`encounter` on a parabola: every particle has the acceleration ``g``, d floats."""


@optional
def recoil(obstacle, motion, i, mass, x, v, normal, growth, now):
    """Set ``v``, (d,) float64, to the velocity of particle i after the contact.

    By default the contact is elastic in the frame of the obstacle (:func:`surface_speed`).

    Parameters
    ----------
    obstacle, motion : models
        The obstacle, and the motion of the particles.
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
    approach = growth + surface_speed(obstacle, normal, now)
    for axis in range(len(v)):
        approach -= normal[axis] * v[axis]
    motion.push(motion.rebound_speed(approach), v, normal)


@optional
def surface_speed(obstacle, normal, now):
    """Return the velocity of an obstacle along the unit ``normal`` at the time ``now``; by default 0."""
    return 0.0


@optional
def surface_velocity(obstacle, axis, now):
    """Return a coordinate of the velocity of an obstacle's surface at the time ``now``; by default 0.

    Of it a thermal surface (``obstacles.surfaces``) uses the part along the surface. What is along the
    normal is asked with :func:`surface_speed`.
    """
    return 0.0


@optional
def rest_speed(obstacle):
    """Return the least speed at which a particle leaves an obstacle after a contact; by default 0."""
    return 0.0


@optional
def at_time(obstacle, now):
    """Set the time of the contact for the next calls of :func:`outward` and :func:`anchor`."""
    return


LIVE = (recoil, surface_speed, at_time, shift_epoch, copy_state)
"""What is asked only of obstacles that move, lose energy or have a memory."""
