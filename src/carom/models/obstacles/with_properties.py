"""Obstacles that move, lose energy or have a temperature: what keywords make of a shape."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.compiling import registry
from carom.declared import SEED, Declared
from carom.errors import InputError
from carom.models import declared_values
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.interfaces.particles import Particles
from carom.models.obstacles.moving import displaced
from carom.models.obstacles.outlines import shapes
from carom.models.obstacles.paths import check_path
from carom.models.obstacles.properties import TEMPERATURE, Properties, properties_of
from carom.models.obstacles.surfaces import hot, lossy
from carom.units import TimeUnit

ONE = TimeUnit()  # the scene's own unit of time

UNIT = 2.0**-50  # how much the length of a unit vector may differ from 1 by rounding


@dataclass(frozen=True)
class Dressed(Declared):
    """A shape with a motion along a line, and a surface that loses energy or has a temperature.

    :func:`dressed` makes it of an obstacle with keywords; :func:`Shaken`, :func:`Surface` and :func:`Thermal`
    of one that has none, such as the user's own. In the frame of a lossy surface a component leaves so fast
    that it flies for half of ``contact_time``, or at ``restitution * elastic_below`` at least: small hops of
    what rests. From a hot one the normal speed u has the density ``u exp(-m u^2 / 2 kT)`` of effusion, the
    others are Maxwell's.
    """

    after = " of Thermal"

    obstacle: Any  # where it is not displaced
    direction: tuple[float, ...] | None = None  # of the motion, any vector but zero
    path: Annotated[Any, check_path] = None  # displacement over time
    loss: Loss | Restitution | None = None  # of a contact
    kT: Annotated[float | None, TEMPERATURE] = None  # of the gas behind the surface [energy]
    seed: Annotated[int, SEED] = 0  # every component has its own stream

    def complete(self) -> None:
        """Give the direction of what moves the length 1."""
        if self.path is not None:
            direction = declared_values.vector(self.direction, "direction of shake")
            length = math.hypot(*direction)
            if length == 0.0:
                raise InputError("The direction of shake must not be zero: the obstacle moves along it.")
            # A unit vector stays as it is: a file holds one, and the run must go on with the same bits.
            if abs(length - 1.0) > UNIT:
                direction = tuple(x / length for x in direction)
            self._put("direction", direction)

    @property
    def name(self) -> str:
        """Name, for messages and results."""
        return str(self.obstacle.name)

    @property
    def fastest(self) -> float:
        """Typical speed of the obstacle, its largest with a Sine [length / time]."""
        if self.path is None:
            return float(getattr(self.obstacle, "fastest", 0.0))
        return float(self.path.acceleration * self.path.period / (2.0 * math.pi))

    @property
    def ends(self) -> np.ndarray:
        """The ends of the displacement of what moves, (2, d) [length]."""
        assert self.direction is not None
        return np.multiply.outer((self.path.lowest, self.path.highest), self.direction)

    def gap(self, positions, radii, box, periodic, times=0.0, unit=ONE):
        """Return the distance of each surface from the obstacle at ``times``, (n,) [length]."""
        away: Any = 0.0
        if self.path is not None:
            path, period = self.path.model(unit), Fraction(float(unit.to_kernel(self.path.period, 1)))
            along = [path.place(float(Fraction(t) % period)) for t in np.atleast_1d(times).tolist()]
            away = np.array(along)[:, None] * np.array(self.direction)
        return self.obstacle.gap(np.asarray(positions) - away, radii, box, periodic)

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle or its motion does not fit this box."""
        self.obstacle.check(box, periodic)
        if self.path is None:
            return
        assert self.direction is not None
        declared_values.check_dimensions(self.direction, box, "direction of shake")
        model = self.obstacle.model()
        if not registry.answers("time_to_moving", type(model)):
            raise InputError(
                "shake moves all obstacles but arcs, and those of one's own that answer closest or "
                f"time_to_moving; found {type(self.obstacle).__name__}."
            )
        far = max(abs(self.path.lowest), abs(self.path.highest))
        for edge, wraps in zip(box, periodic, strict=True):
            if wraps and model.is_periodic() and 4.0 * far > edge:
                raise InputError(
                    f"{self.name} moves {far:g} far; expected at most a quarter of the periodic edge, "
                    f"{edge:g}."
                )

    def spread(self) -> Any:
        """Return the widths of all places passed, (d,) [length]; None if it rests and has no answer."""
        shape = getattr(self.obstacle, "spread", None)
        if self.path is None:
            return None if shape is None else shape()
        wide = getattr(self.obstacle, "widths", shape)  # sides of a block that face each other have moved
        width = 2.0 * getattr(self.obstacle, "radius", 0.0) if wide is None else wide()
        far = max(abs(self.path.lowest), abs(self.path.highest))
        return width + 2.0 * far * np.abs(np.array(self.direction))

    def glides(self, axis: int) -> bool:
        """Return whether the obstacle exchanges no momentum along an axis."""
        along = self.kT is not None or isinstance(self.loss, Rough)
        return not along and hasattr(self.obstacle, "glides") and self.obstacle.glides(axis)

    def confines(self, normal: Sequence[float]) -> tuple[float, float] | None:
        """Return the least and greatest offset of the plane (unit ``normal``) that confines, or None."""
        confines = getattr(self.obstacle, "confines", None)
        offsets = None if confines is None else confines(normal)
        if offsets is None or self.path is None:
            return offsets
        slant = sum(a * b for a, b in zip(self.direction or (), normal, strict=True))
        ends = slant * float(self.path.lowest), slant * float(self.path.highest)
        return offsets[0] + min(ends), offsets[1] + max(ends)

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in two dimensions; none if the obstacle has no outline."""
        return shapes(self.obstacle, "outline", box, periodic)

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in three dimensions; none if the obstacle has no surface."""
        return shapes(self.obstacle, "surface", box, periodic)

    def at(self, speed: float) -> Dressed:
        """Return the obstacle with the threshold of its restitution, for a thermal ``speed``."""
        return replace(self, loss=self.loss.at(speed)) if isinstance(self.loss, Restitution) else self

    def drawing_apart(self, before: Sequence[Any], given: Sequence[Any]) -> Dressed:
        """Return a hot obstacle with a seed of its own, or one that none ``before`` or ``given`` has."""
        used_seeds = _seeds(before)
        if self.kT is None or self.seed not in used_seeds:
            return self
        used_seeds |= _seeds(given)
        return replace(self, seed=next(k for k in itertools.count() if k not in used_seeds))

    def model(self) -> Any:
        """Return the model of the obstacle without displacement."""
        return self.obstacle.model()

    def live(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""
        value = self.obstacle
        if self.path is not None:
            assert self.direction is not None
            body = displaced(value.model(), self.direction, self.path, particles)
        else:
            body = value.live(particles) if hasattr(value, "live") else value.model()
        if self.kT is not None:
            return hot(body, self.kT, self.seed, particles)
        return body if self.loss is None else lossy(body, self.loss, particles)


def _seeds(obstacles: Sequence[Any]) -> set[int]:
    return {each.seed for each in obstacles if isinstance(each, Dressed) and each.kT is not None}


def Shaken(obstacle: Any, direction: Any, path: Any) -> Dressed:
    """Return an obstacle that oscillates as a whole; it has no surface yet."""
    if hasattr(obstacle, "live"):
        raise InputError(
            f"Shaken moves an obstacle at rest without a surface of its own, found "
            f"{type(obstacle).__name__}, whose motion or surface would be lost. A surface stands "
            "outside: Surface(Shaken(...), loss) or Thermal(Shaken(...), kT). Two motions are one path."
        )
    return Dressed(obstacle, direction, 0 if path is None else path)


def Surface(obstacle: Any, loss: Loss | Restitution) -> Dressed:
    """Return an obstacle whose contacts lose energy."""
    if not isinstance(loss, Loss | Restitution):
        raise InputError(
            f"The loss of a Surface must be a Loss or a Restitution, found {checks.describe(loss)}."
        )
    return replace(_uncovered(obstacle, "Surface"), loss=loss)


def Thermal(obstacle: Any, kT: float, seed: int = 0) -> Dressed:
    """Return an obstacle that reflects components as if they came from a gas behind it."""
    return replace(_uncovered(obstacle, "Thermal"), kT=kT, seed=seed)


def _uncovered(obstacle: Any, mine: str) -> Dressed:
    """Return an obstacle without a surface of its own, dressed."""
    if not isinstance(obstacle, Dressed):
        return Dressed(obstacle)
    if obstacle.loss is not None or obstacle.kT is not None:
        other = "Surface" if obstacle.kT is None else "Thermal"
        raise InputError(
            f"{mine} encloses an obstacle without a surface of its own, found {other}, which would "
            f"be lost. Choose one of the two; what moves stands inside: {mine}(Shaken(...), ...)."
        )
    return obstacle


def dressed(obstacle: Any) -> Any:
    """Return the obstacle that the engine knows: without properties, and dressed in what stands for them."""
    if not isinstance(obstacle, Properties) or not properties_of(obstacle):
        return obstacle
    body: Any = replace(obstacle, shake=None, direction=None, impact=None, kT=None, seed=0)
    direction, impact = obstacle.direction, obstacle.impact
    if obstacle.shake is not None and direction is None:
        direction = obstacle.natural_direction
        if direction is None:
            raise InputError(
                f"shake of {obstacle.name} needs direction=, one number an axis: a "  # type: ignore[attr-defined]
                f"{type(obstacle).__name__} has no normal."
            )
    loss = impact if isinstance(impact, Loss | Restitution) else None
    if isinstance(loss, Restitution) and loss.elastic:
        loss = None
    if obstacle.shake is None and obstacle.kT is None and loss is None:
        return body
    return Dressed(body, direction, obstacle.shake, loss, obstacle.kT, obstacle.seed)
