"""Surfaces of obstacles: their energy loss, or their temperature.

The keywords ``impact`` and ``kT`` of an obstacle make them (``obstacles.properties``).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from carom import checks, seeds
from carom.errors import InputError
from carom.models.contacts.losses import Law, Loss, never_touched, restitution_at
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.mathematics.counter_random import normal as draw_normal, uniform
from carom.models.obstacles.outlines import shapes
from carom.models.questions.memory import copy_state, shift_epoch
from carom.models.questions.motion import normal_acceleration, push, rest_speed
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


class _Covered:
    """What an obstacle with a surface of its own has of the obstacle itself."""

    obstacle: Any

    @property
    def name(self) -> str:
        """Name, for messages and results."""
        return str(self.obstacle.name)

    @property
    def fastest(self) -> float:
        """Typical speed at which it moves [length / time]."""
        return float(getattr(self.obstacle, "fastest", 0.0))

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each component's surface from it at the start, (n,) [length]."""
        return self.obstacle.gap(positions, radii, box, periodic)

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle cannot stand in this box."""
        self.obstacle.check(box, periodic)

    def confines(self, normal: Sequence[float]) -> tuple[float, float] | None:
        """Return what the obstacle answers; None if it has no such answer."""
        confines = getattr(self.obstacle, "confines", None)
        return None if confines is None else confines(normal)

    def model(self) -> Any:
        """Return the obstacle where it rests, as it is compiled."""
        return self.obstacle.model()

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in two dimensions; none if the obstacle has no outline."""
        return shapes(self.obstacle, "outline", box, periodic)

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw in three dimensions; none if the obstacle has no surface."""
        return shapes(self.obstacle, "surface", box, periodic)

    def _body(self, particles: Particles) -> Any:
        value = self.obstacle
        return value.live(particles) if hasattr(value, "live") else value.model()

    def _refuse_covered(self) -> None:
        """Raise InputError if the obstacle has a surface of its own, which would be lost."""
        if isinstance(self.obstacle, _Covered):
            mine, other = type(self).__name__, type(self.obstacle).__name__
            raise InputError(
                f"{mine} encloses an obstacle without a surface of its own, found {other}, which would "
                f"be lost. Choose one of the two; what moves stands inside: {mine}(Shaken(...), ...)."
            )


@dataclass(frozen=True)
class Surface(_Covered):
    """An obstacle whose contacts lose energy.

    Parameters
    ----------
    obstacle : obstacle
        A plane, a ball, a container, or one that is ``carom.models.obstacles.shaken.Shaken``.
    loss : Loss or Restitution
        What a contact loses, in the frame of the surface.

    Raises
    ------
    InputError
        If ``loss`` is neither, or the obstacle has a surface already.

    Notes
    -----
    A component leaves the surface so fast that it flies for half of ``contact_time``, or at least at
    ``restitution * elastic_below``. A resting component makes such small hops.

    Examples
    --------
    >>> from carom.models import Plane
    >>> Surface(Plane((0, 1), 0.0, "floor"), Loss(0.8, contact_time=1e-3)).name
    'floor'
    """

    obstacle: Any
    loss: Loss | Restitution

    def __post_init__(self) -> None:
        if not isinstance(self.loss, Loss | Restitution):
            raise InputError(
                f"The loss of a Surface must be a Loss or a Restitution, found {checks.describe(self.loss)}."
            )
        self._refuse_covered()

    @property
    def rough(self) -> bool:
        """Whether contacts turn particles."""
        return isinstance(self.loss, Rough)

    def glides(self, axis: int) -> bool:
        """Return whether the obstacle exchanges no momentum along an axis."""
        return not self.rough and hasattr(self.obstacle, "glides") and self.obstacle.glides(axis)

    def at(self, speed: float) -> Surface:
        """Return the surface with the threshold of its restitution, for a thermal ``speed``."""
        return replace(self, loss=self.loss.at(speed)) if isinstance(self.loss, Restitution) else self

    def live(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""
        body = Lossy(
            self._body(particles), self.loss.law(particles), never_touched(particles), np.zeros(2, np.int64)
        )
        if not isinstance(self.loss, Rough):
            return body
        return RoughSurface(body, self.loss.tangential, self.loss.largest_friction)


@dataclass(frozen=True)
class Thermal(_Covered):
    """An obstacle that reflects components as if they came from a gas behind it.

    Parameters
    ----------
    obstacle : obstacle
        As for :class:`Surface`.
    kT : float
        Temperature of that gas [energy].
    seed : int
        Seed of its random numbers; every component has its own stream. In a scene, a later surface with
        the seed of another gets a new one.

    Raises
    ------
    InputError
        If the temperature is not positive, the seed is not an integer of at least 0, or the obstacle has a
        surface already.

    Notes
    -----
    The normal speed u has the density ``u exp(-m u^2 / 2 kT)`` of effusion; speeds along the surface are
    Maxwell's. Both are in the frame of the surface.

    Examples
    --------
    >>> from carom.models import Plane
    >>> Thermal(Plane((0, 1), 0.0, "floor"), kT=2.0, seed=1).name
    'floor'
    """

    obstacle: Any
    kT: float
    seed: int = 0

    def __post_init__(self) -> None:
        kT = checks.number(self.kT, "kT of Thermal", low=0.0, high=checks.HOTTEST, open_low=True)
        object.__setattr__(self, "kT", kT)
        seed = checks.integer(self.seed, "seed of Thermal", low=0, high=2**63 - 1)
        object.__setattr__(self, "seed", seed)
        self._refuse_covered()

    def drawing_apart(self, before: Sequence[Any], given: Sequence[Any]) -> Thermal:
        """Return the surface with a seed that none of the obstacles ``before`` it has.

        That is its own where possible, and else one that no obstacle of all those ``given`` has. Otherwise
        two surfaces would throw a component with the same random numbers.
        """
        used_seeds = {each.seed for each in before if isinstance(each, Thermal)}
        if self.seed not in used_seeds:
            return self
        used_seeds |= {each.seed for each in given if isinstance(each, Thermal)}
        return replace(self, seed=next(k for k in itertools.count() if k not in used_seeds))

    def live(self, particles: Particles) -> Thermostat:
        """Return the model that the engine compiles."""
        return Thermostat(
            self._body(particles),
            float(particles.unit.to_kernel(self.kT, -2)),
            seeds.word(self.seed, "thermal surfaces"),
            np.zeros(len(particles.radii) + 1, np.int64),
        )


class Lossy(NamedTuple):
    """A body whose contacts lose energy."""

    body: Any
    """Model of the obstacle."""
    law: Law
    """The restitution."""
    last: np.ndarray
    """Time of the last contact of each component with it, in the epoch, (n + 1,) float64."""
    spared: np.ndarray
    """Contacts that were elastic, and contacts with a least speed after them, (2,) int64."""


class RoughSurface(NamedTuple):
    """A surface that exchanges momentum along itself, too (``carom.engine.rubbing``)."""

    body: Lossy
    """What it does along the normal."""
    tangential: float
    """beta."""
    friction: float
    """Largest ratio of the tangential to the normal impulse."""

    @property
    def spared(self) -> np.ndarray:
        """As of :class:`Lossy`."""
        return self.body.spared


class Thermostat(NamedTuple):
    """A body that throws components back with the speeds of a temperature."""

    body: Any
    """Model of the obstacle."""
    kT: float
    """Temperature."""
    seed: int
    """Seed of the random numbers."""
    drawn: np.ndarray
    """Numbers that each component has drawn, (n + 1,) int64."""


def _passed_on(kind: type) -> None:
    """Register answers of a surface that are those of its body."""

    @encounter.register(kind)
    def _(obstacle, x, v, radius, growth):
        return encounter(obstacle.body, x, v, radius, growth)

    @arrival.register(kind)
    def _(obstacle, x, v, radius, growth, now):
        return arrival(obstacle.body, x, v, radius, growth, now)

    @fall.register(kind)
    def _(obstacle, g, x, v, radius, growth, now):
        return fall(obstacle.body, g, x, v, radius, growth, now)

    @outward.register(kind)
    def _(obstacle, x, axis):
        return outward(obstacle.body, x, axis)

    @is_periodic.register(kind)
    def _(obstacle):
        return is_periodic(obstacle.body)

    @anchor.register(kind)
    def _(obstacle, axis):
        return anchor(obstacle.body, axis)

    @at_time.register(kind)
    def _(obstacle, now):
        at_time(obstacle.body, now)

    @surface_speed.register(kind)
    def _(obstacle, normal, now):
        return surface_speed(obstacle.body, normal, now)


_passed_on(Lossy)
_passed_on(RoughSurface)
_passed_on(Thermostat)


@shift_epoch.register
def _(obstacle: RoughSurface, duration):
    shift_epoch(obstacle.body, duration)


@copy_state.register
def _(obstacle: RoughSurface, before, instant, passed, slower):
    copy_state(obstacle.body, before.body, instant, passed, slower)


@recoil.register
def _(obstacle: RoughSurface, motion, i, mass, x, v, normal, growth, now):
    recoil(obstacle.body, motion, i, mass, x, v, normal, growth, now)


@shift_epoch.register
def _(obstacle: Lossy, duration):
    shift_epoch(obstacle.body, duration)
    for i in range(len(obstacle.last)):
        obstacle.last[i] -= duration


@shift_epoch.register
def _(obstacle: Thermostat, duration):
    shift_epoch(obstacle.body, duration)


@copy_state.register
def _(obstacle: Lossy, before, instant, passed, slower):
    copy_state(obstacle.body, before.body, instant, passed, slower)
    obstacle.last[:] = np.ldexp(before.last - passed, -slower)
    obstacle.spared[:] = before.spared


@copy_state.register
def _(obstacle: Thermostat, before, instant, passed, slower):
    copy_state(obstacle.body, before.body, instant, passed, slower)
    obstacle.drawn[:] = before.drawn


@recoil.register
def _(obstacle: Lossy, motion, i, mass, x, v, normal, growth, now):
    law = obstacle.law
    speed = 0.0
    for axis in range(len(v)):
        speed += normal[axis] * v[axis]
    surface = growth + surface_speed(obstacle.body, normal, now)
    approach = max(surface - speed, 0.0)
    is_elastic = approach < law.threshold or now - obstacle.last[i] < law.contact_time
    obstacle.last[i] = now
    left = approach if is_elastic else restitution_at(law, approach) * approach
    least = max(rest_speed(motion), rest_speed(obstacle.body))
    least = max(
        least, 0.25 * law.contact_time * normal_acceleration(motion, normal), law.restitution * law.threshold
    )
    obstacle.spared[0] += np.int64(is_elastic)
    obstacle.spared[1] += np.int64(left < least)
    push(motion, surface - speed + max(left, least), v, normal)


@recoil.register
def _(obstacle: Thermostat, motion, i, mass, x, v, normal, growth, now):
    hot = math.sqrt(obstacle.kT / mass)
    k = obstacle.drawn[i]
    fast = hot * math.sqrt(-2.0 * math.log(uniform(obstacle.seed, i, k)))
    along = 0.0
    for axis in range(len(v)):
        v[axis] = hot * draw_normal(obstacle.seed, i, k + 1 + 2 * axis)
        along += v[axis] * normal[axis]
    obstacle.drawn[i] = k + 1 + 2 * len(v)
    surface = growth + surface_speed(obstacle.body, normal, now)
    change = surface + max(fast, rest_speed(motion), rest_speed(obstacle.body)) - along
    drift = 0.0
    for axis in range(len(v)):
        drift += surface_velocity(obstacle.body, axis, now) * normal[axis]
    for axis in range(len(v)):
        v[axis] += change * normal[axis]
        v[axis] += surface_velocity(obstacle.body, axis, now) - drift * normal[axis]
