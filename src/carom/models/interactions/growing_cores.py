"""Growing cores: diameters grow linearly in time (Lubachevsky and Stillinger; the paper's sec. 9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.memory import parameter, present
from carom.models.interfaces.particles import NEVER, Particles, lanes
from carom.models.mathematics.contact import contact_time_known, elastic


@dataclass(frozen=True)
class Growing:
    """Hard cores that grow at the rates of the components."""

    by_radii = True
    """No two act on each other from further apart than their radii, or ``contact``, say."""

    def reach(self, scene: Any) -> float:
        """Return the largest diameter, now [length]."""
        return float(scene.diameter)

    def model(self, particles: Particles) -> GrowingCores:
        """Return the model that the engine compiles."""
        return GrowingCores(
            particles.with_padding(particles.radii),
            particles.with_padding(particles.rates),
            particles.with_padding(particles.masses),
        )


@lanes("radii", "rates")
class GrowingCores(PairModel):
    """Hard cores that touch at the sum of radii that grow."""

    radii: Annotated[np.ndarray, present()]  # at the beginning of the epoch, (n + 1,) float64 [length]
    rates: Annotated[np.ndarray, parameter(-1)]  # radius gained a time, (n + 1,) float64
    masses: np.ndarray  # (n + 1,) float64

    def interaction_time(self, i, j, rr, rv, vv, now):
        radii, rate = self.radii[i] + self.radii[j], self.rates[i] + self.rates[j]
        c, b, a = growing(radii, rate, rr, rv, vv, now)
        discriminant = b * b - a * c
        t = c / (np.sqrt(max(discriminant, 0.0)) - b)
        # a < 0: the cores grow faster than their centers part. A candidate that is i itself never meets i.
        meets = ((b < 0.0) | (a < 0.0)) & (discriminant >= 0.0) & (i != j)
        return max(t, 0.0) if meets else NEVER

    def contact_time(self, i, j, rr, rv, vv, now):
        radii, rate = self.radii[i] + self.radii[j], self.rates[i] + self.rates[j]
        c, b, a = growing(radii, rate, rr, rv, vv, now)
        return contact_time_known(c, b, a)

    def jump(self, i, j, rr, rv, now):
        # Elastic in the frame of the surfaces, which approach faster than the centers: no pair sticks.
        return elastic(self, i, j, rr, rv - np.sqrt(rr) * (self.rates[i] + self.rates[j]))

    def core_square(self, i, j, now):
        contact = self.radius_of(i, now) + self.radius_of(j, now)
        return contact * contact

    def radius_of(self, i, now):
        return self.radii[i] + self.rates[i] * now

    def growth_of(self, i):
        return self.rates[i]

    def shift_epoch(self, duration):
        for i in range(len(self.radii)):
            self.radii[i] += self.rates[i] * duration


def growing(radii, rate, rr, rv, vv, now):
    """Return c, b, a of ``c + 2 b t + a t^2 = 0`` at the contact, of the sums of radii and rates."""
    contact = radii + rate * now
    return rr - contact * contact, rv - contact * rate, vv - rate * rate
