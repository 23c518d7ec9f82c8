"""Obstacles that move: floors, walls, balls and containers, displaced along a line by a path.

The keyword ``shake`` of an obstacle makes them (``obstacles.properties``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from carom.compiling import registry
from carom.errors import InputError
from carom.models import fields
from carom.models.mathematics.parabolas import HOP, Course, time_to_moving
from carom.models.obstacles.outlines import shapes
from carom.models.obstacles.paths import check_path, pace, place
from carom.models.questions.memory import copy_state, shift_epoch
from carom.models.questions.motion import push, rest_speed
from carom.models.questions.obstacle import (
    anchor,
    arrival,
    at_time,
    encounter,
    fall,
    is_periodic,
    outward,
    recoil,
    surface_speed,
    surface_velocity,
)
from carom.models.questions.particles import Particles
from carom.units import TimeUnit

UNIT = 2.0**-50
"""How much the length of a unit vector may differ from 1 by rounding."""


@dataclass(frozen=True)
class Shaken:
    """An obstacle that oscillates as a whole.

    Parameters
    ----------
    obstacle : obstacle
        A plane, a ball or a container, at displacement zero.
    direction : d floats
        Direction of the motion, a vector of any length but zero.
    path : Path
        Displacement as a function of time: ``Sine``, ``Parabolas`` (``obstacles.paths``) or your own.

    Raises
    ------
    InputError
        If the direction is zero, the path is not a path or has bounds that are not finite, or the obstacle
        moves already or has a surface.

    Notes
    -----
    A plane that gets to a wall of the box stands for that wall, and may dip behind it by the smallest radius.

    Examples
    --------
    >>> from carom.models import Plane, Sine
    >>> Shaken(Plane((0, 1), 0.0, "floor"), (0, 1), Sine(0.2, period=1.5)).name
    'floor'
    """

    obstacle: Any
    direction: tuple[float, ...]
    path: Any

    def __post_init__(self) -> None:
        if hasattr(self.obstacle, "live"):
            raise InputError(
                f"Shaken moves an obstacle at rest without a surface of its own, found "
                f"{type(self.obstacle).__name__}, whose motion or surface would be lost. A surface stands "
                "outside: Surface(Shaken(...), loss) or Thermal(Shaken(...), kT). Two motions are one path."
            )
        direction = fields.vector(self.direction, "direction of shake")
        length = math.hypot(*direction)
        if length == 0.0:
            raise InputError("The direction of shake must not be zero: the obstacle moves along it.")
        # A unit vector stays as it is: a file holds one, and the run must go on with the same bits.
        if abs(length - 1.0) > UNIT:
            direction = tuple(x / length for x in direction)
        object.__setattr__(self, "direction", direction)
        check_path(self.path)

    @property
    def name(self) -> str:
        """Name, for messages and results."""
        return str(self.obstacle.name)

    @property
    def fastest(self) -> float:
        """Typical speed of the obstacle, its largest with a Sine [length / time]."""
        return float(self.path.acceleration * self.path.period / (2.0 * math.pi))

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each component's surface from the obstacle at the start, (n,) [length]."""
        away = place(self.path.model(TimeUnit()), 0.0) * np.array(self.direction)
        return self.obstacle.gap(np.asarray(positions) - away, radii, box, periodic)

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle or its motion does not fit this box."""
        self.obstacle.check(box, periodic)
        fields.check_dimensions(self.direction, box, "direction of shake")
        model = self.obstacle.model()
        if not registry.answers(time_to_moving, type(model)):
            raise InputError(
                "shake moves planes, balls, containers and walls, and obstacles that answer time_to_moving; "
                f"found {type(self.obstacle).__name__}."
            )
        far = max(abs(self.path.lowest), abs(self.path.highest))
        for edge, wraps in zip(box, periodic, strict=True):
            if wraps and is_periodic(model) and 4.0 * far > edge:
                raise InputError(
                    f"{self.name} moves {far:g} far; expected at most a quarter of the periodic edge, "
                    f"{edge:g}."
                )

    def spread(self) -> np.ndarray:
        """Return the widths of all places that the obstacle passes, (d,) [length]."""
        shape = getattr(self.obstacle, "spread", None)
        width = 2.0 * getattr(self.obstacle, "radius", 0.0) if shape is None else shape()
        far = max(abs(self.path.lowest), abs(self.path.highest))
        return width + 2.0 * far * np.abs(self.direction)

    def glides(self, axis: int) -> bool:
        """Return whether the obstacle exchanges no momentum along an axis."""
        return hasattr(self.obstacle, "glides") and self.obstacle.glides(axis)

    def confines(self, normal: Sequence[float]) -> tuple[float, float] | None:
        """Return the least and the greatest offset of the plane that confines components, or None.

        ``normal`` is the unit normal of that plane.
        """
        confines = getattr(self.obstacle, "confines", None)
        offsets = None if confines is None else confines(normal)
        if offsets is None:
            return None
        slant = sum(a * b for a, b in zip(self.direction, normal, strict=True))
        ends = slant * float(self.path.lowest), slant * float(self.path.highest)
        return offsets[0] + min(ends), offsets[1] + max(ends)

    def model(self) -> Any:
        """Return the model of the obstacle without displacement."""
        return self.obstacle.model()

    def live(self, particles: Particles) -> Displaced:
        """Return the model that the engine compiles."""
        path, unit = self.path, particles.unit
        d = len(self.direction)
        course = Course(
            path.model(unit),
            self.direction,
            float(path.lowest),
            float(path.highest),
            float(unit.to_kernel(path.acceleration, -2)),
            float(unit.to_kernel(path.period, 1)),
        )
        return Displaced(
            self.obstacle.model(),
            course,
            (0.0,) * d,
            math.sqrt(2.0 * HOP * max(particles.box) * course.bend),
            np.zeros(1),
            np.zeros(1),
            np.zeros(1, np.int64),
            np.zeros(1),
            np.zeros(d),
        )

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in two dimensions: the obstacle without displacement."""
        return shapes(self.obstacle, "outline", box, periodic)

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in three dimensions: the obstacle without displacement."""
        return shapes(self.obstacle, "surface", box, periodic)


class Displaced(NamedTuple):
    """A body that is displaced along a course."""

    body: Any
    """Model of the obstacle without displacement."""
    course: Course
    """The motion along the line."""
    free: tuple
    """Acceleration of a component without field: zeros."""
    rest: float
    """Least speed, relative to the body, after a contact."""
    begin: np.ndarray
    """Time of the path when the counting of epochs began, (1,) float64."""
    phase: np.ndarray
    """The same at the beginning of this epoch, (1,) float64."""
    epochs: np.ndarray
    """Epochs counted, (1,) int64."""
    away: np.ndarray
    """Displacement at the contact that is asked about, (1,) float64."""
    shifted: np.ndarray
    """Room for a position, (d,)."""


@shift_epoch.register
def _(obstacle: Displaced, duration):
    # Products and remainders are exact: the phase does not drift, however many epochs there are.
    obstacle.epochs[0] += 1
    period = obstacle.course.period
    elapsed = (np.float64(obstacle.epochs[0]) * duration) % period
    obstacle.phase[0] = (obstacle.begin[0] + elapsed) % period


@copy_state.register
def _(obstacle: Displaced, before, instant, passed, slower):
    obstacle.begin[0] = obstacle.phase[0] = float(instant % Fraction(obstacle.course.period))
    obstacle.epochs[0] = 0


@encounter.register
def _(obstacle: Displaced, x, v, radius, growth):
    return arrival(obstacle, x, v, radius, growth, 0.0)


@arrival.register
def _(obstacle: Displaced, x, v, radius, growth, now):
    return fall(obstacle, obstacle.free, x, v, radius, growth, now)


@fall.register
def _(obstacle: Displaced, g, x, v, radius, growth, now):
    return time_to_moving(obstacle.body, obstacle.course, obstacle.phase[0] + now, g, x, v, radius, growth)


@is_periodic.register
def _(obstacle: Displaced):
    return is_periodic(obstacle.body)


@anchor.register
def _(obstacle: Displaced, axis):
    return anchor(obstacle.body, axis)


@at_time.register
def _(obstacle: Displaced, now):
    obstacle.away[0] = place(obstacle.course.path, obstacle.phase[0] + now)


@outward.register
def _(obstacle: Displaced, x, axis):
    for k in range(len(obstacle.shifted)):
        obstacle.shifted[k] = x[k] - obstacle.course.direction[k] * obstacle.away[0]
    return outward(obstacle.body, obstacle.shifted, axis)


@surface_speed.register
def _(obstacle: Displaced, normal, now):
    along = 0.0
    for axis in range(len(obstacle.course.direction)):
        along += normal[axis] * obstacle.course.direction[axis]
    return along * pace(obstacle.course.path, obstacle.phase[0] + now)


@surface_velocity.register
def _(obstacle: Displaced, axis, now):
    return obstacle.course.direction[axis] * pace(obstacle.course.path, obstacle.phase[0] + now)


@rest_speed.register
def _(obstacle: Displaced):
    return obstacle.rest


@recoil.register
def _(obstacle: Displaced, motion, i, mass, x, v, normal, growth, now):
    approach = growth + surface_speed(obstacle, normal, now)
    for axis in range(len(v)):
        approach -= normal[axis] * v[axis]
    approach = max(approach, 0.0)
    push(motion, approach + max(approach, rest_speed(motion), obstacle.rest), v, normal)
