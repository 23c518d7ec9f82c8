"""Free flight: components move uniformly along straight lines between their events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from carom.models.questions.motion import position, velocity
from carom.models.questions.particles import Particles


@dataclass(frozen=True)
class FreeFlight:
    """Uniform motion along straight lines."""

    def model(self, particles: Particles) -> Inertial:
        """Return the model that the engine compiles."""
        return Inertial()


class Inertial(NamedTuple):
    """Uniform motion along straight lines."""

    inertial: bool = True
    """Always true: the frame of reference is inertial (Numba has no empty tuples of its own class)."""


@position.register
def _(motion: Inertial, axis, x, v, t):
    return x + v * t


@velocity.register
def _(motion: Inertial, axis, v, t):
    return v
