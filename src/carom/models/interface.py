"""What the engine asks of a model: every question, with its default where there is one.

A model is a ``NamedTuple`` of numbers, tuples and arrays: what the compiler sees. A question is answered for
its type with ``@question.register``. The value that users write makes the model (:class:`Interaction`,
:class:`Motion`, :class:`Impact`, and :class:`Obstacle` for what is fixed).

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

    It may also have ``check(scene)``, which raises :class:`carom.errors.InputError` where the scene cannot be
    simulated; ``penetrable = True``, where components may be nearer than the mean of their diameters (a scene
    refuses that otherwise); and ``by_radii = True``, where no two act on each other from further apart than
    the sum of their radii, or ``contact``, so that neighbours may be found by their sizes.

    One whose pairs have steps (:func:`step_time`) also has ``steps(particles)``, which returns how many there
    are and, for every pair of species, on which one they are beyond each other's reach, (K, K) ints; and
    ``steps_of(pairs, distances, species, diameter)``, the steps of pairs (m, 2) at the start. Its model has
    ``energy``, of a pair on each step, and ``events``, (steps, 4) int64, in which the engine counts the kinds
    of events on each.
    """

    def reach(self, scene: Any) -> float:
        """Return the largest distance at which two components act on each other [length]."""

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class Motion(Protocol):
    """A motion as users write it.

    It may also have ``check(scene)``; ``conserves(axis)``, whether it leaves the total momentum along an axis
    as it is (true if left out); and ``straight = False``, where components do not fly straight and uniformly
    between two events; ``curved = True``, where they do not even do so relative to each other.
    """

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class Impact(Protocol):
    """What a contact of two components loses, as users write it.

    It may also have ``check(scene)``; and ``elastic = True``, where no contact loses energy.
    """

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


# Of a pair interaction with steps, instead of the two above: the engine stores the step of every pair.

CORE, IN, OUT, BOUNCE = 0, 1, 2, 3
"""Kinds of events: thrown back at the inner end of a step, across it, across the outer end, thrown back."""


def step_bits(count: int) -> int:
    """Return the number of bits that number ``count`` steps: at least 2, which the kinds of events need."""
    return max((count - 1).bit_length(), 2)


@required
def step_time(pair, i, j, step, rr, rv, vv, now):
    """Time from now until components i and j, which are on a step, reach one of its ends, or NEVER.

    As :func:`interaction_time`, and the loop over candidates wants the same of it.

    Parameters
    ----------
    step : int
        The step that the pair is on: an index of the model's arrays, which have ``2**step_bits(count)`` items
        for so many steps.
    """


@required
def step_jump(pair, i, j, step, rr, rv, now):
    """Return what reaching the end of a step does to a pair.

    Returns
    -------
    a, b, virial : float
        As :func:`jump` does.
    step : int
        The step that the pair is on from now on.
    kind : int
        CORE, IN, OUT or BOUNCE.
    """


@optional
def step_core_square(pair, step):
    """Return the square of a step's inner end, where a pair is thrown back there; else 0 [length^2].

    The deepest overlap of a run is measured with it.
    """
    return 0.0


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
def taken_up(pair, i, j, momentum):
    """Take note of the momentum that a contact of i and j exchanged [mass length / time]; by default of
    nothing.
    """
    return


@optional
def age(pair, duration):
    """Bring arrays that depend on time from the start of an epoch to that of the next; default: nothing."""
    return


@optional
def begin(pair, pairs, steps):
    """Take note of the step (m,) on which each of the pairs (m, 2) within reach starts; called from Python.

    The lists may be built several times before the first event. By default there is nothing to note.
    """
    return


@optional
def complaint(pair):
    """Return why the run cannot go on, a sentence, or None; called from Python, some times a second."""
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


# Of a curved motion, by which two components do not fly straight relative to each other.


@optional
def carry(motion, x, v, t, there, then):
    """Move all coordinates of a component at once, where they depend on each other.

    Parameters
    ----------
    motion : model
        The motion.
    x, v : (d,) arrays
        Position [length] and velocity.
    t : float
        Time.
    there, then : (d,) arrays
        Where a curved motion writes position and velocity after that time; they may be x and v.

    Returns
    -------
    x, v, t
        From where :func:`position` and :func:`velocity` go on, axis by axis, and for how long. By default
        nothing has moved; a curved motion returns ``there, then, 0.0``.
    """
    return x, v, t


@optional
def thrust(motion, axis, x, r, rr):
    """Return a coordinate of the direction in which a contact pushes a component.

    Parameters
    ----------
    motion : model
        The motion.
    axis : int
        The axis.
    x : float
        The component's coordinate [length].
    r : float
        That of the vector to the other [length], whose direction it is by default.
    rr : float
        Square of that vector [length^2].
    """
    return r


@optional
def meeting_time(motion, me, other, now, contact, rate, limit, span):
    """Return the time from now until two components touch that do not fly straight relative to each other.

    Parameters
    ----------
    motion : model
        The motion.
    me, other : records
        Their old events: fields x and v, (d,), and t.
    now : float
        Time since the beginning of the epoch.
    contact, rate : float
        The distance of contact now [length], and its growth a time.
    limit : float
        A contact later than that is of no interest; NEVER may be said for it.
    span : float
        How far to look, the same in all calls, so that a contact has the same bits in all.

    Returns
    -------
    t : float
        Not negative, or NEVER.
    clamped : bool
        Whether the two are in contact already, by rounding.
    """
    return NEVER, False


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


@optional
def exchanged_part(impact, i, j, rr, rv, now):
    """Return :func:`transfer` for the components i and j at the time ``now`` of the epoch.

    For a contact law that remembers; by default it does not depend on who meets when. Asked once a contact.
    """
    return transfer(impact, rr, rv)


# Of an obstacle.


@runtime_checkable
class Obstacle(Protocol):
    """The interface of an obstacle.

    It may also have ``glides(axis)``, whether it takes up no momentum along an axis; ``area(box)``, its
    surface [length^(d-1)]; ``inside(box)``, the width of the room in a container [length]; ``outline(box,
    periodic)`` and ``surface(box, periodic)``, shapes to draw in two and in three dimensions: see
    ``carom.models.outlines``; and ``live(particles)``, which then takes the place of ``model()`` in the
    engine, for an obstacle that moves, loses energy or remembers.
    """

    @property
    def name(self) -> str:
        """Name in messages and results."""

    def gap(
        self, positions: np.ndarray, radii: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
    ) -> np.ndarray:
        """Return each component's distance from the obstacle, surface to surface, (n,); negative inside
        [length].

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
        """Raise InputError if the obstacle does not fit this box."""

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
    """Return a coordinate of the unit normal, away from the obstacle, where a component at x touches it."""


@optional
def repeated(obstacle):
    """Tell whether the obstacle stands in every image of the box; by default it does not."""
    return False


@optional
def anchor(obstacle, axis):
    """Return a coordinate of the obstacle's centre, by whose periodic image the obstacle's is named."""
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


# Of a motion or an obstacle, where flights bend or obstacles move.


@optional
def meeting(motion, obstacle, x, v, radius, growth, now):
    """Return :func:`encounter` for components in this motion; asked of the motion.

    Parameters
    ----------
    motion, obstacle : models
        The motion, and an obstacle.
    x, v, radius, growth
        As of :func:`encounter`.
    now : float
        Time since the beginning of the epoch.
    """
    return arrival(obstacle, x, v, radius, growth, now)


@optional
def arrival(obstacle, x, v, radius, growth, now):
    """Return :func:`encounter` at the time ``now`` of the epoch, in straight flight; asked of the obstacle.

    By default the obstacle does not move.
    """
    return encounter(obstacle, x, v, radius, growth)


@required
def fall(obstacle, g, x, v, radius, growth, now):
    """Return :func:`encounter` on a parabola: everybody has the acceleration ``g``, d floats."""


@optional
def wall_meeting(motion, walls, x, v, radius, growth):
    """Return :func:`soonest_wall` for components in this motion; asked of the motion."""
    return soonest_wall(walls, x, v, radius, growth)


@optional
def rest_speed(model):
    """Return the least speed at which a component leaves what it touches; by default 0.

    Asked of the motion, and of obstacles. In a uniform field, or on what accelerates, one that rests would
    touch for ever, and a contact that goes on has no next event.
    """
    return 0.0


@optional
def pull(motion, normal):
    """Return the acceleration against a unit vector, (d,) float64: onto the surface with that normal."""
    return 0.0


@optional
def thrown(motion, approach):
    """Return the normal velocity that an elastic contact adds, for a speed of approach."""
    return 2.0 * approach


@optional
def push(motion, change, v, normal):
    """Add ``change`` along a unit normal to the velocity ``v``, in place.

    A motion that has to keep energy over very many bounces does it in more digits: see
    ``carom.models.gravity``.

    Parameters
    ----------
    motion : model
        The motion.
    change : float
        What the contact adds to the velocity along the normal.
    v, normal : sequences of d floats
        Velocity before the contact, and the normal.
    """
    for axis in range(len(normal)):
        v[axis] += change * normal[axis]


@optional
def recoil(obstacle, motion, i, mass, x, v, normal, growth, now):
    """Set ``v``, (d,) float64, to the velocity of component i after the contact.

    By default the contact is elastic and the obstacle rests.

    Parameters
    ----------
    obstacle, motion : models
        The obstacle, and the motion of the components.
    i : int
        The component.
    mass : float
        Its mass.
    x, v : (d,) float64 arrays
        Position of its centre, and velocity.
    normal : (d,) float64 array
        Unit vector along which it is thrown back.
    growth, now : float
        Rate at which its radius grows; time since the beginning of the epoch.
    """
    approach = growth
    for axis in range(len(v)):
        approach -= normal[axis] * v[axis]
    push(motion, thrown(motion, approach), v, normal)


@optional
def surface_speed(obstacle, normal, now):
    """Return how fast an obstacle moves along a unit vector, (d,) float64, at a time of the epoch; or 0."""
    return 0.0


@optional
def at_time(obstacle, now):
    """Set the time of the contact for the next calls of :func:`outward` and :func:`anchor`."""
    return


@optional
def take_over(model, before, instant, passed, slower):
    """Copy what ``before``, the model of the same type that is replaced, remembers; called from Python.

    Parameters
    ----------
    model, before : models
        Of an obstacle or an impact: the new one, and the one whose place it takes.
    instant : Fraction
        The present since the start of the run [time of the new one]: its epochs begin there.
    passed : float
        The present in the epoch of the other [its time].
    slower : int
        The unit of time of the new one is longer by ``2**slower``.
    """
    return
