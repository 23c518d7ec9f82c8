"""What the engine asks of a model: every question, with its default where there is one.

A model is a ``NamedTuple`` of numbers, tuples and arrays: what the compiler sees. A question is answered for
its type with ``@question.register``. The value that users write makes the model (:class:`Interaction`,
:class:`Motion`, :class:`Impact`, and :class:`carom.models.obstacles.Obstacle` for what is fixed).

Arrays with one item a component have n + 1 items: the last is for a ghost, which nobody meets
(:meth:`Particles.with_ghost`). Times and speeds are in the engine's unit of time (:meth:`Particles.speed`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from carom.compiling.registry import optional, required
from carom.units import TimeUnit

M = TypeVar("M")

NEVER = np.inf
"""Time of what does not happen (the paper's + infinity)."""


@dataclass(frozen=True)
class Particles:
    """What a value may need to make its model: the components, in the engine's unit of time.

    Attributes
    ----------
    box : tuple of d floats
        Edges [length].
    radii, masses : (n,) float64 arrays
        Of each component [length], [mass].
    species : (n,) int64 array or None
        Species of each component.
    rates : (n,) float64 array or None
        Radius that each gains a time, where diameters grow.
    equal : bool
        Whether all have one diameter and one mass.
    unit : TimeUnit
        The engine's unit of time.
    """

    box: tuple[float, ...]
    radii: np.ndarray
    masses: np.ndarray
    species: np.ndarray | None
    rates: np.ndarray | None
    equal: bool
    unit: TimeUnit

    def with_ghost(self, values: Any, dtype: Any = np.float64) -> np.ndarray:
        """Return one value a component as an array with one item more, which is like the first."""
        values = np.asarray(values)
        return np.concatenate([values, values[:1]]).astype(dtype)

    def speed(self, value: Any) -> Any:
        """Return a speed in the engine's unit of time: exact, since units differ by a power of two."""
        return self.unit.to_kernel(value, -1)


class Interaction(Protocol):
    """A pair interaction as users write it.

    It may also have ``check(scene)``, which raises :class:`carom.InputError` where the scene cannot be
    simulated; ``penetrable = True``, where components may be nearer than the mean of their diameters (a scene
    refuses that otherwise); and ``by_radii = True``, where no two act on each other from further apart than
    the sum of their radii, or ``contact``, so that neighbours may be found by their sizes.
    """

    def reach(self, scene: Any) -> float:
        """Return the largest distance at which two components act on each other [length]."""

    def model(self, particles: Particles) -> Any:
        """Return what the engine compiles."""


class Motion(Protocol):
    """A motion as users write it.

    It may also have ``check(scene)``; ``conserves(axis)``, whether it leaves the total momentum along an axis
    as it is (true if left out); and ``straight = False``, where components do not fly straight and uniformly
    between two events.
    """

    def model(self, particles: Particles) -> Any:
        """Return what the engine compiles."""


class Impact(Protocol):
    """What a contact of two components loses, as users write it; it may also have ``check(scene)``."""

    def model(self, particles: Particles) -> Any:
        """Return what the engine compiles, or None where contacts are elastic."""


def lanes(*names: str) -> Callable[[type[M]], type[M]]:
    """Name the fields, arrays of one value a component, that ``interaction_time`` reads of candidate j.

    A class decorator. The search loads them for eight candidates at a time; fields that are not named are
    loaded one by one, which is slower and gives the same bits.
    """

    def decorate(model: type[M]) -> type[M]:
        model.lanes = names  # type: ignore[attr-defined]
        return model

    return decorate


# Of a pair interaction.


@required
def interaction_time(pair, i, j, rr, rv, vv, now):
    """Time from now until components i and j interact, or NEVER.

    Parameters
    ----------
    pair : model
        The pair interaction.
    i, j : int
        The components: indices of the model's arrays.
    rr, rv, vv : float
        r.r [length^2], r.v and v.v of j relative to i, both at the time ``now``.
    now : float
        Time since the beginning of the epoch.

    Notes
    -----
    Compiled, this stands in the loop over candidates. The loop is vectorised if the function has no branch
    and no store, and if :func:`lanes` names the fields that it reads of j. A pair that touches and
    approaches interacts now: 0 (Lubachevsky 1991, sec. 6).
    """


@required
def jump(pair, i, j, rr, rv, now):
    """Return what an elastic contact adds to the velocities: ``v_i += a r``, ``v_j -= b r`` with r from i to
    j.

    Returns
    -------
    a, b : float
        The factors of r [1 / time].
    virial : float
        ``r . dp`` of the contact [mass length^2 / time].
    """


@optional
def contact_time(pair, i, j, rr, rv, vv, now):
    """Time from now until i and j interact, where ``interaction_time`` said that they do.

    The two times are rounded differently, so a grazing contact may look like a miss here. It then counts as
    a contact at the closest approach.

    Returns
    -------
    t : float
        Time until contact, not negative.
    clamped : bool
        Whether a negative root was replaced by zero (the paper's sec. 6).
    """
    t = interaction_time(pair, i, j, rr, rv, vv, now)
    return t if t < NEVER else max(-rv / vv, 0.0), False


@optional
def core_square(pair, i, j, now):
    """Return the square of the distance that i and j keep [length^2]; 0 where they may overlap.

    The deepest overlap of a run is measured with it.
    """
    return 0.0


@optional
def radius(pair, i, now):
    """Return the radius of component i at obstacles at the time now; by default ``pair.radii[i]``."""
    return pair.radii[i]


@optional
def growth(pair, i):
    """Return the rate at which the radius of component i grows; by default 0."""
    return 0.0


@optional
def mass(pair, i):
    """Return the mass of component i; by default ``pair.masses[i]``."""
    return pair.masses[i]


@optional
def age(pair, duration):
    """Bring arrays that depend on time from the start of an epoch to that of the next; default: nothing."""
    return


# Of a motion. Relative to each other, two components must move along a straight line, uniformly.


@required
def position(motion, axis, x, v, t):
    """Return the coordinate a time ``t`` after it was ``x`` with the velocity ``v``; ``t`` may be
    negative.
    """


@required
def velocity(motion, axis, v, t):
    """Return the velocity's coordinate a time ``t`` after it was ``v``."""


@optional
def exit_time(motion, axis, x, v, low, high):
    """Return the time until a coordinate leaves the interval from ``low`` to ``high``, and whether it is at
    the upper end.

    Parameters
    ----------
    motion : model
        The motion.
    axis : int
        The axis.
    x, v : float
        Coordinate and velocity now; x is in the interval, but for rounding.
    low, high : float
        The ends [length].

    Returns
    -------
    t : float
        Not negative; NEVER if it stays.
    up : int
        1 or 0.

    Notes
    -----
    The default is that of straight, uniform motion: only the end ahead can be reached. A motion that bends
    answers for both, and its value says ``straight = False``.
    """
    up = np.int64(v > 0.0)
    end = high if up else low
    return max((end - x) / v, 0.0) if v != 0.0 else NEVER, up


# Of an impact.


@required
def transfer(impact, rr, rv):
    """Return the part of an elastic contact's momentum that is exchanged: ``(1 + e) / 2``.

    Parameters
    ----------
    impact : model or None
        The contact law.
    rr, rv : float
        r.r [length^2] and r.v of the surfaces; ``rv^2 / rr`` is the normal speed squared.
    """


@transfer.register
def _(impact: None, rr, rv):
    return 1.0


# Of an obstacle.


@runtime_checkable
class Obstacle(Protocol):
    """What an obstacle must have.

    It may also have ``glides(axis)``, whether it takes up no momentum along an axis; ``area(box)``, its
    surface [length^(d-1)]; ``inside(box)``, the width of the room in a container [length]; ``outline(box,
    periodic)`` and ``surface(box, periodic)``, shapes to draw in two and in three dimensions: see
    :mod:`carom.models.outlines`.
    """

    @property
    def name(self) -> str:
        """What to call it in messages and results."""

    def gap(
        self, positions: np.ndarray, radii: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
    ) -> np.ndarray:
        """Return how far each component's surface is from the obstacle's (n,), negative inside [length].

        Parameters
        ----------
        positions : (n, d) array
            Centres [length].
        radii : (n,) array
            [length].
        box : sequence of d floats
            Edges [length].
        periodic : sequence of d bools
            Which axes are.
        """

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle cannot stand in this box."""

    def model(self) -> Any:
        """Return what the engine compiles: a NamedTuple for whose type questions are answered."""


@required
def encounter(obstacle, x, v, radius, growth):
    """Return the time until a component touches the obstacle, not negative, or NEVER.

    Parameters
    ----------
    obstacle : model
        The obstacle.
    x, v : (d,) float64 arrays
        Position of the centre [length] and velocity.
    radius, growth : float
        Radius [length], and the rate at which it grows.

    Notes
    -----
    A component that touches and approaches, or is a hair inside by rounding and goes deeper, touches now; one
    that moves away does not.
    """


@required
def outward(obstacle, x, axis):
    """Return a coordinate of the unit vector along which a component at x that touches is thrown back."""


@optional
def repeated(obstacle):
    """Tell whether the obstacle stands in every image of the box; by default it does not."""
    return False


@optional
def anchor(obstacle, axis):
    """Return a coordinate of the centre by whose images those of the obstacle are told apart."""
    return 0.0


# Of a crowd: what the static method ``together`` of a model's type makes of many obstacles.


@required
def members(crowd):
    """Return how many obstacles a crowd has."""


@required
def member(crowd, k):
    """Return obstacle k of a crowd."""


# Of the walls of the box.


@required
def soonest_wall(walls, x, v, radius, growth):
    """Return the time until a component touches a wall of the box, or NEVER, and the number of that wall.

    The lower wall of an axis has the number ``2 axis``, the upper one the next. Parameters as of
    :func:`encounter`.
    """


@required
def wall_normal(walls, number, axis):
    """Return a coordinate of the unit vector from a wall into the box; 0 for the number of another
    obstacle.
    """
