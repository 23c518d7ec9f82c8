"""Gravity: a uniform field. Components fly on parabolas, and relative to each other along straight lines."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.errors import InputError
from carom.models.declared_values import Value, check_dimensions, vector
from carom.models.interfaces.memory import parameter
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.particles import Particles
from carom.models.interfaces.walls import landing_on_wall
from carom.models.mathematics.parabolas import HOP, leaving


@dataclass(frozen=True)
class Gravity(Value):
    """A uniform field: the same acceleration for all particles.

    Parameters
    ----------
    g : d floats
        Acceleration along each axis [length / time^2].

    Raises
    ------
    InputError
        If a coordinate is not a finite number.

    Notes
    -----
    All particles have the same acceleration. They therefore meet each other as without the field, and meet
    walls and obstacles on parabolas. An event-driven run has no lasting contacts: a particle that rests on a
    surface rises to 2^-48 of the longest edge after every contact.

    Examples
    --------
    >>> Gravity((0.0, -9.81)).strength
    9.81
    """

    type = "gravity"
    after = " of Gravity"
    straight = False

    g: Annotated[tuple[float, ...], vector]

    @property
    def strength(self) -> float:
        """Magnitude of the acceleration [length / time^2]."""
        return math.hypot(*self.g)

    def check(self, scene: Any) -> None:
        """Raise InputError if the field and the scene differ in dimension."""
        check_dimensions(self.g, scene.box, "g of Gravity")
        if self.strength * scene.diameter > 1e300 or 0.0 < self.strength * scene.diameter < 1e-300:
            raise InputError(
                f"A field of {self.strength:g} and a diameter of {scene.diameter:g} make speeds whose "
                "squares are no doubles; choose another unit of time."
            )

    def conserves(self, axis: int) -> bool:
        """Return whether the field conserves the total momentum along an axis."""
        return self.g[axis] == 0.0

    def pace(self, diameter: float) -> float:
        """Return a typical speed: that after a fall by half a ``diameter`` [length / time]."""
        return math.sqrt(self.strength * diameter)

    def potential_energy(self, masses: np.ndarray, places: np.ndarray, box: tuple[float, ...]) -> float:
        """Return the potential energy of ``masses`` (n,) at unwrapped ``places`` (n, d) [energy].

        It is zero at the end of the ``box`` to which the field pulls, so that it is not negative in the box.
        """
        g, edges = np.array(self.g), np.array(box)
        heights = np.where(g > 0.0, edges - places, places)
        return math.fsum((masses[:, None] * np.abs(g) * heights).ravel())

    def model(self, particles: Particles) -> Falling:
        """Return the model that the engine compiles."""
        g = tuple(float(particles.unit.to_kernel(each, -2)) for each in self.g)
        return Falling(g, math.sqrt(2.0 * HOP * max(particles.box) * math.hypot(*g)))


class Falling(MotionModel):
    """Parabolas of one acceleration."""

    g: Annotated[tuple, parameter(-2)]  # acceleration along each axis
    rest: Annotated[float, parameter(-1)]  # least speed after a contact with a surface

    def position(self, axis, x, v, t):
        return x + (v + 0.5 * self.g[axis] * t) * t

    def velocity(self, axis, v, t):
        return v + self.g[axis] * t

    def exit_time(self, axis, x, v, low, high):
        return leaving(x, v, self.g[axis], low, high)

    def meeting(self, obstacle, x, v, radius, growth, now):
        return obstacle.fall(self.g, x, v, radius, growth, now)

    def wall_meeting(self, walls, x, v, radius, growth):
        return landing_on_wall(walls, self.g, x, v, radius, growth)

    def bend(self):
        square = 0.0
        for axis in range(len(self.g)):
            square += self.g[axis] * self.g[axis]
        return np.sqrt(square)

    def rest_speed(self):
        return self.rest

    def normal_acceleration(self, normal):
        down = 0.0
        for axis in range(len(self.g)):
            down -= self.g[axis] * normal[axis]
        return max(down, 0.0)

    def rebound_speed(self, approach):
        return approach + max(approach, self.rest)
