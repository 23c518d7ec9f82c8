"""Free flight: components move uniformly along straight lines between their events."""

from __future__ import annotations

from dataclasses import dataclass

from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.particles import Particles


@dataclass(frozen=True)
class FreeFlight:
    """Uniform motion along straight lines."""

    def model(self, particles: Particles) -> Inertial:
        """Return the model that the engine compiles."""
        return Inertial()


class Inertial(MotionModel):
    """Uniform motion along straight lines."""

    inertial: bool = True
    """Always true: the frame of reference is inertial (an empty tuple would count as false)."""

    def position(self, axis, x, v, t):
        return x + v * t

    def velocity(self, axis, v, t):
        return v
