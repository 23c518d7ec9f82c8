"""Surfaces of obstacles, as the engine compiles them: their energy loss, or their temperature."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from carom import seeds
from carom.compiling.registry import answering
from carom.models.contacts.losses import Law, Loss, never_touched, restitution_at
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.mathematics.counter_random import normal as draw_normal, uniform
from carom.models.questions import memory, obstacle
from carom.models.questions.memory import MOMENT, kept, parameter, shift_epoch
from carom.models.questions.obstacle import (
    anchor,
    arrival,
    at_time,
    encounter,
    fall,
    is_periodic,
    outward,
    recoil,
    rest_speed,
    surface_speed,
    surface_velocity,
)
from carom.models.questions.particles import Particles


@answering(memory, obstacle)
class Lossy(NamedTuple):
    """A body whose contacts lose energy."""

    body: Any
    """Model of the obstacle."""
    law: Law
    """The restitution."""
    last: Annotated[np.ndarray, MOMENT]
    """Time of the last contact of each component with it, in the epoch, (n + 1,) float64."""
    spared: Annotated[np.ndarray, kept()]
    """Contacts that were elastic, and contacts with a least speed after them, (2,) int64."""

    def shift_epoch(self, duration):
        shift_epoch(self.body, duration)
        for i in range(len(self.last)):
            self.last[i] -= duration

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        law = self.law
        speed = 0.0
        for axis in range(len(v)):
            speed += normal[axis] * v[axis]
        surface = growth + surface_speed(self.body, normal, now)
        approach = max(surface - speed, 0.0)
        is_elastic = approach < law.threshold or now - self.last[i] < law.contact_time
        self.last[i] = now
        left = approach if is_elastic else restitution_at(law, approach) * approach
        least = max(motion.rest_speed(), rest_speed(self.body))
        least = max(
            least,
            0.25 * law.contact_time * motion.normal_acceleration(normal),
            law.restitution * law.threshold,
        )
        self.spared[0] += is_elastic
        self.spared[1] += left < least
        motion.push(surface - speed + max(left, least), v, normal)


@answering(memory, obstacle)
class RoughSurface(NamedTuple):
    """A surface that exchanges momentum along itself, too (``carom.engine.rubbing``)."""

    body: Lossy  # what it does along the normal
    tangential: float  # beta
    friction: float  # largest ratio of the tangential to the normal impulse

    @property
    def spared(self) -> np.ndarray:
        """As of :class:`Lossy`."""
        return self.body.spared


@answering(memory, obstacle)
class Thermostat(NamedTuple):
    """A body that throws components back with the speeds of a temperature."""

    body: Any  # model of the obstacle
    kT: Annotated[float, parameter(-2)]  # temperature
    seed: int  # seed of the random numbers
    drawn: Annotated[np.ndarray, kept()]  # numbers that each component has drawn, (n + 1,) int64

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        hot = math.sqrt(self.kT / mass)
        k = self.drawn[i]
        fast = hot * math.sqrt(-2.0 * math.log(uniform(self.seed, i, k)))
        along = 0.0
        for axis in range(len(v)):
            v[axis] = hot * draw_normal(self.seed, i, k + 1 + 2 * axis)
            along += v[axis] * normal[axis]
        self.drawn[i] = k + 1 + 2 * len(v)
        surface = growth + surface_speed(self.body, normal, now)
        change = surface + max(fast, motion.rest_speed(), rest_speed(self.body)) - along
        drift = 0.0
        for axis in range(len(v)):
            drift += surface_velocity(self.body, axis, now) * normal[axis]
        for axis in range(len(v)):
            v[axis] += change * normal[axis]
            v[axis] += surface_velocity(self.body, axis, now) - drift * normal[axis]


def lossy(body: Any, loss: Loss | Restitution, particles: Particles) -> Any:
    """Return a body whose contacts lose energy by a law."""
    smooth = Lossy(body, loss.law(particles), never_touched(particles), np.zeros(2, np.int64))
    return RoughSurface(smooth, loss.tangential, loss.largest_friction) if isinstance(loss, Rough) else smooth


def hot(body: Any, kT: float, seed: int, particles: Particles) -> Thermostat:
    """Return a body of a temperature."""
    drawn = np.zeros(len(particles.radii) + 1, np.int64)
    return Thermostat(
        body, float(particles.unit.to_kernel(kT, -2)), seeds.word(seed, "thermal surfaces"), drawn
    )


def _of_body(question: Any) -> Any:
    """Return the answer of a surface that is the one of its body."""

    def answer(surface, *asked):
        return question(surface.body, *asked)

    return answer


for _question in (encounter, arrival, fall, outward, is_periodic, anchor, at_time, surface_speed):
    for _kind in (Lossy, RoughSurface, Thermostat):
        _question.register(_kind)(_of_body(_question))
for _question, _kind in ((recoil, RoughSurface), (shift_epoch, RoughSurface), (shift_epoch, Thermostat)):
    _question.register(_kind)(_of_body(_question))
