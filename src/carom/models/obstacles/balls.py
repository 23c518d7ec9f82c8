"""Balls: fixed and solid, met under all their periodic images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import Opt, described, positive
from carom.densities import sphere_area
from carom.models.declared_values import Center, Name, check_dimensions
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.contact import MOST_DIAMETERS
from carom.models.mathematics.parabolas import Gap, at_rest, first_touch, straight_growth
from carom.models.obstacles.cells import crowded
from carom.models.obstacles.outlines import Disk, SolidSphere, images
from carom.models.obstacles.properties import Properties


@described
@dataclass(frozen=True, repr=False)
class Ball(Properties):
    """A fixed solid ball (a disk for d = 2), with all its periodic images.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    type = "ball"
    center: Center
    radius: Annotated[float, positive, Opt("Radius [length].")]
    name: Name = "ball"

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each surface from the nearest image of the ball, (n,) [length]."""
        edges = np.where(periodic, box, np.inf)
        separation = positions - np.array(self.center)
        # A product with infinity would be no number along axes that are not periodic.
        separation -= np.where(periodic, box, 0.0) * np.rint(separation / edges)
        return np.linalg.norm(separation, axis=1) - self.radius - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension."""
        check_dimensions(self.center, box, f"center of {self.name}")

    def model(self) -> SolidBall:
        """Return the model that the engine compiles."""
        return SolidBall(self.center, self.radius)

    def area(self, box: Sequence[float]) -> float:
        """Return the surface area of the ball [length^(d-1)]."""
        return sphere_area(len(box), self.radius)

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Disk]:
        """Return the shapes to draw in two dimensions: all images that may reach into the box."""
        return [Disk((x, y), radius) for (x, y, *_), radius in self.surface(box, periodic)]

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[SolidSphere]:
        """Return the shapes to draw in three dimensions, in the same way."""
        places = np.array(self.center) + images(self.center, box, periodic)
        return [SolidSphere(tuple(place.tolist()), self.radius) for place in places]


@crowded
class SolidBall(ObstacleModel):
    """A solid ball, which stands in every image of the box."""

    center: Any  # d floats
    radius: float

    def extent(self: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates of each, (k, d) [length]."""
        return self.center - self.radius[:, None], self.center + self.radius[:, None]

    def encounter(self, x, v, radius, growth):
        start = 0.0
        for _ in range(2):
            contact = self.radius + radius + growth * start
            c = -contact * contact
            b = -contact * growth
            a = -growth * growth
            for axis in range(len(self.center)):
                r = x[axis] + v[axis] * start - self.center[axis]
                c += r * r
                b += r * v[axis]
                a += v[axis] * v[axis]
            discriminant = b * b - a * c
            if discriminant < 0.0 or (b >= 0.0 and a >= 0.0):
                return NEVER
            t = start + c / (np.sqrt(discriminant) - b)
            far = MOST_DIAMETERS * contact
            if start > 0.0 or c < far * far or a <= 0.0:
                break
            start = max(t - 2.0 * contact / np.sqrt(a), 0.0)  # with the digits that are lost from so far away
        return max(t, 0.0)

    def fall(self, g, x, v, radius, growth, now):
        if straight_growth(g, -1, growth):
            return self.encounter(x, v, radius, growth)
        return self.time_to_moving(at_rest(g), 0.0, g, x, v, radius, growth)

    def time_to_moving(self, course, start, g, x, v, radius, growth):
        return first_touch(Gap(course, start, 1.0, -1, self.center, self.radius + radius, growth, g, x, v))

    def outward(self, x, axis):
        rr = 0.0
        for k in range(len(self.center)):
            rr += (x[k] - self.center[k]) * (x[k] - self.center[k])
        return (x[axis] - self.center[axis]) / np.sqrt(rr)

    def is_periodic(self):
        return True

    def anchor(self, axis):
        return self.center[axis]
