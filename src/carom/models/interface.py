"""What the engine asks of a model: every question, with its default where there is one.

A model is a ``NamedTuple`` of numbers, tuples and arrays: what the compiler sees. A question is answered for
its type with ``@question.register``. The value that users write makes the model (:class:`Interaction`,
:class:`Motion`, :class:`Impact`, and :class:`Obstacle` for what is fixed).

Arrays with one item a component have n + 1 items: the last is for a ghost, which nobody meets
(:meth:`Particles.with_ghost`). Times and speeds are in the engine's unit of time (:meth:`Particles.speed`).

These parameters mean the same everywhere:

pair, motion, impact, obstacle, walls, model : model
    The model that is asked.
i, j : int
    Components: indices of the model's arrays.
rr, rv, vv : float
    r.r [length^2], r.v and v.v of j relative to i, at the time ``now``.
now : float
    Time since the beginning of the epoch.
axis : int
    Number of an axis, from 0. A vector is asked for one coordinate at a time.
x, v : float or (d,) float64 arrays
    Position of a centre [length] and velocity: one coordinate or all of them.
t : float
    Time from now.
radius, growth : float
    Radius of a component [length], and the rate at which it grows.
normal : (d,) float64 array
    Unit vector.
scene : Scene
    The scene, already checked but for this value.
particles : Particles
    The components.
positions, radii : (n, d) and (n,) arrays
    Centres and radii [length].
box : sequence of d floats
    Edges [length].
periodic : sequence of d bools
    Which axes are periodic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from carom.compiling.registry import optional, required
from carom.errors import InputError
from carom.units import TimeUnit

M = TypeVar("M")

NEVER = np.inf
"""Time of what does not happen (the paper's + infinity)."""


@dataclass(frozen=True)
class Particles:
    """The components, from which a value makes its model, in the engine's unit of time.

    Attributes
    ----------
    box : tuple of d floats
        Edges [length].
    radii, masses : (n,) float64 arrays
        Radius [length] and mass of each component.
    species : (n,) int64 array or None
        Species of each component.
    rates : (n,) float64 array or None
        Rate at which each radius grows, where diameters grow [length / time].
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
        """Return ``values``, one a component, as an array of ``dtype`` that ends with a copy of the first."""
        values = np.asarray(values)
        return np.concatenate([values, values[:1]]).astype(dtype)

    def speed(self, value: Any) -> Any:
        """Return a speed ``value`` in the engine's unit of time: exact, as units differ by a power of two."""
        return self.unit.to_kernel(value, -1)


class Interaction(Protocol):
    """A pair interaction as users write it.

    It may also have:

    - ``check(scene)``, which raises :class:`carom.errors.InputError` if the scene cannot be simulated;
    - ``penetrable = True``, if components may be nearer than the mean of their diameters, which a scene
      refuses otherwise;
    - ``by_radii = True``, if no two components act on each other beyond the sum of their radii, or
      ``contact``. Neighbours are then found by their sizes;
    - ``conserves(diameter)``, whether its jumps keep the energy (true if left out), with which
      :func:`carom.check` compares them;
    - ``keeps_momentum = False``, if its jumps do not keep the total momentum, nor the energy.

    An interaction whose pairs have steps (:func:`step_time`) also has:

    - ``steps(particles)``, which returns the number of steps, and the step of pairs beyond each other's reach
      for every pair of species, (K, K) ints;
    - ``steps_of(pairs, distances, species, diameter)``, the steps of pairs (m, 2) at the start.

    Its model has ``energy``, the energy of a pair on each step. It also has ``events``, (steps, 4) int64, in
    which the engine counts the kinds of events on each step.
    """

    def reach(self, scene: Any) -> float:
        """Return the largest distance at which two components act on each other [length]."""

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class Motion(Protocol):
    """A motion as users write it.

    It may also have:

    - ``check(scene)``, as an :class:`Interaction`;
    - ``conserves(axis)``, whether it conserves the total momentum along an axis (true if left out);
    - ``straight = False``, if components do not fly straight and uniformly between two events;
    - ``curved = True``, if they do not fly straight relative to each other either.
    """

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""


class Impact(Protocol):
    """What a contact of two components loses, as users write it.

    It may also have ``check(scene)``, as an :class:`Interaction`, ``elastic = True``, if no contact loses
    energy, and ``adds_energy = True``, if contacts may add some, of which a simulation warns otherwise.
    """

    def model(self, particles: Particles) -> Any:
        """Return what the engine compiles, or None where contacts are elastic."""


def lanes(*names: str) -> Callable[[type[M]], type[M]]:
    """Name the fields that ``interaction_time`` reads of candidate j: arrays of one value a component.

    This is a class decorator; ``names`` are names of fields. The search loads these fields for eight
    candidates at a time. Other fields are loaded one by one, which is slower and gives the same bits.

    Raises
    ------
    InputError
        If the class has no such field.
    """

    def decorate(model: type[M]) -> type[M]:
        for name in names:
            if name not in model._fields:  # type: ignore[attr-defined]
                known = ", ".join(model._fields)  # type: ignore[attr-defined]
                raise InputError(f"{model.__name__} has no field {name!r} for a lane; known are {known}.")
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
    The compiled function stands in the loop over candidates. The loop is vectorised if the function has no
    branch and no store, and if :func:`lanes` names the fields that it reads of j. The time is 0 for a pair
    that touches and approaches (Lubachevsky 1991, sec. 6).
    """


@required
def jump(pair, i, j, rr, rv, now):
    """Return what an elastic contact adds to the velocities: ``v_i += a r``, ``v_j -= b r``.

    The vector r points from i to j.

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
    """Return the number of bits that ``count`` steps need: at least 2, for the four kinds of events."""
    return max((count - 1).bit_length(), 2)


@required
def step_time(pair, i, j, step, rr, rv, vv, now):
    """Time from now until components i and j, which are on ``step``, reach one of its ends, or NEVER.

    The step is an index of the model's arrays, which have ``2**step_bits(count)`` items for ``count`` steps.
    The other parameters, and the conditions for a vectorised loop, are those of :func:`interaction_time`.
    """


@required
def step_jump(pair, i, j, step, rr, rv, now):
    """Return what happens to a pair that reaches an end of its ``step``.

    Returns
    -------
    a, b, virial : float
        As from :func:`jump`.
    step : int
        The step that the pair is on from now on.
    kind : int
        CORE, IN, OUT or BOUNCE.
    """


@optional
def step_core_square(pair, step):
    """Return the square of the inner end of ``step`` if it is a hard core, else 0 [length^2].

    The deepest overlap of a run is measured with it.
    """
    return 0.0


@optional
def contact_time(pair, i, j, rr, rv, vv, now):
    """Time from now until i and j interact, after ``interaction_time`` found that they do.

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
    """Record the ``momentum`` that a contact of i and j exchanged [mass length / time].

    By default nothing is recorded.
    """
    return


@optional
def age(pair, duration):
    """Refer arrays that depend on time to the start of the next epoch, ``duration`` later.

    By default there are none.
    """
    return


@optional
def start_steps(pair, pairs, steps):
    """Record ``steps`` (m,), on which the ``pairs`` (m, 2) within reach start; called from Python.

    The lists may be built several times before the first event. By default nothing is recorded.
    """
    return


@optional
def complaint(pair):
    """Return a sentence that says why the run cannot continue, or None; called often from Python."""
    return


# Of a motion. Relative to each other, two components must move along a straight line, uniformly.


@required
def position(motion, axis, x, v, t):
    """Return the coordinate at a time ``t`` after it was ``x`` with the velocity ``v``.

    The time may be negative.
    """


@required
def velocity(motion, axis, v, t):
    """Return the velocity's coordinate at a time ``t`` after it was ``v``."""


@optional
def exit_time(motion, axis, x, v, low, high):
    """Return the time until a coordinate leaves the interval from ``low`` to ``high``, and at which end.

    Parameters
    ----------
    motion : model
        The motion.
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
    The default is for straight, uniform motion, where only the end ahead can be reached. A motion on curved
    paths answers for both ends, and its value has ``straight = False``.
    """
    up = np.int64(v > 0.0)
    end = high if up else low
    return max((end - x) / v, 0.0) if v != 0.0 else NEVER, up


# Of a curved motion, by which two components do not fly straight relative to each other.


@optional
def carry(motion, x, v, t, there, then):
    """Move all coordinates of a component at once, if they depend on each other.

    Parameters
    ----------
    motion : model
        The motion.
    x, v : (d,) arrays
        Position [length] and velocity.
    t : float
        Duration of the motion.
    there, then : (d,) arrays
        A curved motion writes position and velocity after that time into them; they may be x and v.

    Returns
    -------
    x, v, t
        State from which :func:`position` and :func:`velocity` continue, axis by axis, and the remaining
        time. By default nothing has moved; a curved motion returns ``there, then, 0.0``.
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
        Coordinate of the component [length].
    r : float
        Coordinate of the vector to the other component [length]; by default the direction is that of r.
    rr : float
        Square of the length of that vector [length^2].
    """
    return r


@optional
def meeting_time(motion, me, other, now, contact, rate, limit, span):
    """Return the time from now until two components touch, for paths that are curved relative to each other.

    Parameters
    ----------
    motion : model
        The motion.
    me, other : records
        The old events of both: fields x and v, (d,), and t.
    now : float
        Time since the beginning of the epoch.
    contact, rate : float
        Distance of contact now [length], and the rate at which it grows.
    limit : float
        Latest time of interest. For a later contact NEVER may be returned.
    span : float
        Time up to which to search. It is the same in all calls, so that a contact has the same bits in all.

    Returns
    -------
    t : float
        The time, not negative, or NEVER.
    clamped : bool
        Whether the two are already in contact, by rounding.
    """
    return NEVER, False


# Of an impact.


@optional
def transfer(impact, rr, rv):
    """Return the part of an elastic contact's momentum that is exchanged: ``(1 + e) / 2``.

    Parameters
    ----------
    impact : model or None
        The contact law.
    rr, rv : float
        r.r [length^2] and r.v of the surfaces; ``rv^2 / rr`` is the normal speed squared.
    """
    return 1.0


@optional
def exchanged_part(impact, i, j, rr, rv, now):
    """Return :func:`transfer` for the components i and j at the time ``now`` of the epoch.

    It is for contact laws with memory, and is asked once per contact. By default it does not depend on i, j
    and ``now``.
    """
    return transfer(impact, rr, rv)


# Of an obstacle.


@runtime_checkable
class Obstacle(Protocol):
    """The interface of an obstacle.

    It may also have:

    - ``glides(axis)``, whether it takes up no momentum along an axis;
    - ``area(box)``, its surface area [length^(d-1)];
    - ``inside(box)``, the inner width of a container [length];
    - ``confines(normal)``, the least and the greatest offset, at rest or while it moves, of the plane with
      this unit normal behind which it lets no surface of a component; None if there is none. Where that is
      the plane of a wall of the box, the obstacle stands for the wall;
    - ``outline(box, periodic)`` and ``surface(box, periodic)``, shapes to draw in two and in three dimensions
      (``carom.models.outlines``);
    - ``live(particles)``, which replaces ``model()`` in the engine, for an obstacle that moves, loses energy
      or has a memory;
    - ``adds_energy = True``, if contacts add a part of the energy that a component has, of which a simulation
      warns otherwise.
    """

    @property
    def name(self) -> str:
        """Name in messages and results."""

    def gap(
        self, positions: np.ndarray, radii: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
    ) -> np.ndarray:
        """Return each component's distance from the obstacle, surface to surface, (n,) [length].

        It is negative for components that overlap the obstacle.

        Parameters
        ----------
        positions : (n, d) array
            Centres [length].
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
    The time is 0 for a component that touches and approaches, or that is inside by rounding and goes deeper.
    A component that moves away does not touch.
    """


@required
def outward(obstacle, x, axis):
    """Return a coordinate of the unit normal, away from the obstacle, where a component at x touches it."""


@optional
def repeated(obstacle):
    """Return whether the ``obstacle`` stands in every image of the box; by default it does not."""
    return False


@optional
def anchor(obstacle, axis):
    """Return a coordinate of the obstacle's centre, whose periodic image is that of the obstacle."""
    return 0.0


# Of a crowd: what the static method ``together`` of a model's type makes of many obstacles.


@required
def members(crowd):
    """Return how many obstacles a crowd has."""


@required
def member(crowd, k):
    """Return obstacle k of a crowd."""


# Of the walls of the box.


@optional
def soonest_wall(walls, x, v, radius, growth):
    """Return the time until a component touches a wall of the box, or NEVER, and the number of that wall.

    The lower wall of an axis has the number ``2 axis``, the upper one ``2 axis + 1``.
    """
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


# Of a motion or an obstacle, where flights bend or obstacles move.


@optional
def meeting(motion, obstacle, x, v, radius, growth, now):
    """Return :func:`encounter` for components in this motion; asked of the motion.

    Parameters
    ----------
    motion, obstacle : models
        The motion, and an obstacle.
    x, v, radius, growth
        As for :func:`encounter`.
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
    """Return :func:`encounter` on a parabola: every component has the acceleration ``g``, d floats."""


@optional
def wall_meeting(motion, walls, x, v, radius, growth):
    """Return :func:`soonest_wall` for components in this motion; asked of the motion."""
    return soonest_wall(walls, x, v, radius, growth)


@optional
def rest_speed(model):
    """Return the least speed at which a component leaves an obstacle after a contact; by default 0.

    It is asked of the motion, and of obstacles. In a uniform field, or on an obstacle that accelerates, a
    component at rest would stay in contact, and a lasting contact has no next event.
    """
    return 0.0


@optional
def pull(motion, normal):
    """Return the acceleration towards a surface with the unit ``normal``."""
    return 0.0


@optional
def thrown(motion, approach):
    """Return the normal velocity that an elastic contact adds, for a normal speed ``approach`` before it."""
    return 2.0 * approach


@optional
def push(motion, change, v, normal):
    """Add ``change`` along a unit normal to the velocity ``v``, in place.

    A motion that conserves energy over very many bounces adds with more digits (``carom.models.gravity``).

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

    By default the contact is elastic in the frame of the obstacle (:func:`surface_speed`).

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
        Unit vector along which the component is thrown back.
    growth, now : float
        Rate at which its radius grows, and time since the beginning of the epoch.
    """
    approach = growth + surface_speed(obstacle, normal, now)
    for axis in range(len(v)):
        approach -= normal[axis] * v[axis]
    push(motion, thrown(motion, approach), v, normal)


@optional
def surface_speed(obstacle, normal, now):
    """Return the velocity of an obstacle along the unit ``normal`` at the time ``now``; by default 0."""
    return 0.0


@optional
def surface_velocity(obstacle, axis, now):
    """Return a coordinate of the velocity of an obstacle's surface at the time ``now``; by default 0.

    Of it a thermal surface (``carom.models.surfaces``) uses the part along the surface. What is along the
    normal is asked with :func:`surface_speed`.
    """
    return 0.0


@optional
def at_time(obstacle, now):
    """Set the time of the contact for the next calls of :func:`outward` and :func:`anchor`."""
    return


@optional
def take_over(model, before, instant, passed, slower):
    """Copy the memory of ``before``, a model of the same type that is replaced; called from Python.

    :meth:`carom.Simulation.rescale` and growing diameters replace models. A model that answers :func:`age` or
    :func:`taken_up` has to answer this, too.

    Parameters
    ----------
    model, before : models
        The new model of a pair interaction, an impact or an obstacle, and the model that it replaces.
    instant : Fraction
        Present time since the start of the run, in the unit of the new model. Its epochs begin then.
    passed : float
        Present time since the beginning of the epoch, in the unit of the old model.
    slower : int
        The unit of time of the new model is longer by ``2**slower``.
    """
    return
