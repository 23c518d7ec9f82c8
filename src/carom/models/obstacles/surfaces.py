"""Surfaces of obstacles, as the engine compiles them: their energy loss, or their temperature."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from carom import seeds
from carom.models.contacts.losses import Law, Loss, never_touched, restitution_at
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.interfaces.memory import MOMENT, kept, parameter
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import Particles
from carom.models.mathematics.counter_random import normal as draw_normal, uniform


class Surface(ObstacleModel):
    """The surface of a ``body``, which answers where it is not asked what a contact does."""

    body: Any  # model of the obstacle

    def encounter(self, x, v, radius, growth):
        return self.body.encounter(x, v, radius, growth)

    def arrival(self, x, v, radius, growth, now):
        return self.body.arrival(x, v, radius, growth, now)

    def fall(self, g, x, v, radius, growth, now):
        return self.body.fall(g, x, v, radius, growth, now)

    def outward(self, x, axis):
        return self.body.outward(x, axis)

    def is_periodic(self):
        return self.body.is_periodic()

    def anchor(self, axis):
        return self.body.anchor(axis)

    def at_time(self, now):
        self.body.at_time(now)

    def surface_speed(self, normal, now):
        return self.body.surface_speed(normal, now)

    def shift_epoch(self, duration):
        self.body.shift_epoch(duration)


class Lossy(Surface):
    """A body whose contacts lose energy."""

    law: Law
    """The restitution."""
    last: Annotated[np.ndarray, MOMENT]
    """Time of the last contact of each component with it, in the epoch, (n + 1,) float64."""
    spared: Annotated[np.ndarray, kept()]
    """Contacts that were elastic, and contacts with a least speed after them, (2,) int64."""

    def shift_epoch(self, duration):
        self.body.shift_epoch(duration)
        for i in range(len(self.last)):
            self.last[i] -= duration

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        law = self.law
        speed = 0.0
        for axis in range(len(v)):
            speed += normal[axis] * v[axis]
        surface = growth + self.body.surface_speed(normal, now)
        approach = max(surface - speed, 0.0)
        is_elastic = approach < law.threshold or now - self.last[i] < law.contact_time
        self.last[i] = now
        left = approach if is_elastic else restitution_at(law, approach) * approach
        least = max(motion.rest_speed(), self.body.rest_speed())
        least = max(
            least,
            0.25 * law.contact_time * motion.normal_acceleration(normal),
            law.restitution * law.threshold,
        )
        self.spared[0] += is_elastic
        self.spared[1] += left < least
        motion.push(surface - speed + max(left, least), v, normal)


class RoughSurface(Surface):
    """A surface that exchanges momentum along itself, too (``carom.engine.tangential_impulse``)."""

    body: Lossy  # what it does along the normal
    tangential: float  # beta
    friction: float  # largest ratio of the tangential to the normal impulse

    @property
    def spared(self) -> np.ndarray:
        """As of :class:`Lossy`."""
        return self.body.spared

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        self.body.recoil(motion, i, mass, x, v, normal, growth, now)


class Thermostat(Surface):
    """A body that throws components back with the speeds of a temperature."""

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
        surface = growth + self.body.surface_speed(normal, now)
        change = surface + max(fast, motion.rest_speed(), self.body.rest_speed()) - along
        drift = 0.0
        for axis in range(len(v)):
            drift += self.body.surface_velocity(axis, now) * normal[axis]
        for axis in range(len(v)):
            v[axis] += change * normal[axis]
            v[axis] += self.body.surface_velocity(axis, now) - drift * normal[axis]


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
