"""Arcs: pieces of circles in two dimensions, met from inside, from outside and at their ends.

With segments they make the tables of billiards: stadium, mushroom, Sinai's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import Opt, described, number, positive
from carom.errors import InputError
from carom.models.declared_values import Name, Vector, check_dimensions
from carom.models.interfaces.particles import NEVER
from carom.models.obstacles.balls import SolidBall
from carom.models.obstacles.cells import InEveryImage, crowded
from carom.models.obstacles.outlines import Arc as Drawn, images
from carom.models.obstacles.properties import Properties
from carom.texts import axis_name


@described
@dataclass(frozen=True, repr=False)
class Arc(Properties):
    """A piece of a circle in two dimensions, without thickness, with all its periodic images.

    Raises
    ------
    InputError
        If a number is out of range. The angle must be above 0 and at most 360.
    """

    type = "arc"
    center: Annotated[Vector, Opt("Center of the circle [length].")]
    radius: Annotated[float, positive, Opt("Radius of the circle [length].")]
    start: Annotated[
        float,
        number(low=-360.0, high=360.0),
        Opt("Direction in which the arc begins, from the first axis [degrees]."),
    ] = 0.0
    angle: Annotated[
        float, number(low=0.0, high=360.0, open_low=True), Opt("Its extent, counterclockwise [degrees].")
    ] = 360.0
    name: Name = "arc"

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the box is not two-dimensional, or if a periodic edge would cut the arc."""
        check_dimensions(self.center, box, f"center of {self.name}")
        if len(box) != 2:
            raise InputError(f"{self.name} is for two dimensions, and the box has {len(box)}.")
        for axis, (edge, repeats) in enumerate(zip(box, periodic, strict=True)):
            if repeats and not self.radius < self.center[axis] < edge - self.radius:
                raise InputError(
                    f"The circle of {self.name} crosses the edge of the box along {axis_name(axis)}, which "
                    "is periodic. Give that axis walls, or move it."
                )

    def _middle(self) -> float:
        return math.radians(self.start + 0.5 * self.angle)

    def model(self) -> Bow:
        """Return the model that the engine compiles."""
        middle, half = self._middle(), math.radians(0.5 * self.angle)
        ends = tuple(
            self.center[k] + self.radius * opening(middle + sense * half)
            for sense in (-1.0, 1.0)
            for k, opening in enumerate((math.cos, math.sin))
        )
        # A whole circle has no ends: whatever the direction, its cosine is not below -2.
        cosine_limit = -2.0 if self.angle == 360.0 else math.cos(half)
        low, high = self.extent()
        midpoint = tuple((0.5 * (low + high)).tolist())
        direction = math.cos(middle), math.sin(middle)
        return Bow(midpoint, self.center, self.radius, direction, cosine_limit, ends)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates on the arc [length]."""
        quarters = (0.25 * math.tau * k for k in range(4))
        start, opening = math.radians(self.start), math.radians(self.angle)
        on = [start, start + opening, *(q for q in quarters if (q - start) % math.tau <= opening)]
        points = np.array([(math.cos(q), math.sin(q)) for q in on])
        center = np.array(self.center)
        return center + self.radius * points.min(axis=0), center + self.radius * points.max(axis=0)

    def spread(self) -> np.ndarray:
        """Return the widths of the arc, (2,) [length]; zeros for a whole circle, whose images differ."""
        low, high = self.extent()
        return np.zeros(2) if self.angle == 360.0 else high - low

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each surface from the nearest image of the arc, (n,) [length]."""
        shifts = images(self.center, box, periodic)
        return np.min([self._distance(positions - shift) for shift in shifts], axis=0) - radii

    def _distance(self, positions: np.ndarray) -> np.ndarray:
        """Return the distance of each position from the arc, (n,) [length]."""
        bow = self.model()
        r = positions - np.array(self.center)
        distance = np.linalg.norm(r, axis=1)
        along = r @ np.array(bow.middle) >= bow.cosine_limit * distance
        ends = np.array(bow.ends).reshape(2, 2)
        to_ends = np.linalg.norm(positions[:, None] - ends, axis=2).min(axis=1)
        return np.where(along, np.abs(distance - self.radius), to_ends)

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Any]:
        """Return the shapes to draw."""
        return [Drawn(self.center, self.radius, math.radians(self.start), math.radians(self.angle))]


@crowded
class Bow(InEveryImage):
    """A piece of a circle."""

    center: tuple
    radius: float
    middle: tuple  # unit vector from the center to the middle of the arc
    cosine_limit: float  # cosine of the angle between the middle and an end
    ends: tuple  # coordinates of the first end, then of the second

    def extent(self: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates of each, (k, d) [length]."""
        return self.center - self.radius[:, None], self.center + self.radius[:, None]

    def encounter(self, x, v, radius, growth):
        x0, x1 = x[0] - self.center[0], x[1] - self.center[1]
        inside = x0 * x0 + x1 * x1 < self.radius * self.radius
        best = NEVER
        start = 0.0
        if not inside:
            start = SolidBall(self.center, self.radius).encounter(x, v, radius, growth)
            if start < NEVER and _on_arc(self, x, v, start):
                best = start
        room = self.radius - radius - growth * start
        if best == NEVER and start < NEVER and room > 0.0:
            # From inside: now, or after coming in through where there is no arc.
            t = start + _out_of(x0 + v[0] * start, x1 + v[1] * start, v[0], v[1], room, growth)
            if t < NEVER and (inside or t > 0.0) and _on_arc(self, x, v, t):
                best = t
        if self.cosine_limit >= -1.0:
            for end in range(2):
                tip = SolidBall((self.ends[2 * end], self.ends[2 * end + 1]), 0.0)
                best = min(best, tip.encounter(x, v, radius, growth))
        return best

    def outward(self, x, axis):
        r0, r1 = x[0] - self.center[0], x[1] - self.center[1]
        distance = np.sqrt(r0 * r0 + r1 * r1)
        if r0 * self.middle[0] + r1 * self.middle[1] >= self.cosine_limit * distance:
            sense = 1.0 if distance > self.radius else -1.0
            return sense * (r0 if axis == 0 else r1) / distance
        first0, first1 = x[0] - self.ends[0], x[1] - self.ends[1]
        second0, second1 = x[0] - self.ends[2], x[1] - self.ends[3]
        first_square, second_square = first0 * first0 + first1 * first1, second0 * second0 + second1 * second1
        if first_square <= second_square:
            return (first0 if axis == 0 else first1) / np.sqrt(first_square)
        return (second0 if axis == 0 else second1) / np.sqrt(second_square)


def _on_arc(bow, x, v, t):
    """Tell whether a component will be beside the arc itself, not beyond its ends, after a time t."""
    along = 0.0
    rr = 0.0
    for axis in range(2):
        r = x[axis] + v[axis] * t - bow.center[axis]
        along += r * bow.middle[axis]
        rr += r * r
    return along >= bow.cosine_limit * np.sqrt(rr)


def _out_of(x0, x1, v0, v1, distance, growth):
    """Return the time until a place that moves is as far away as a distance, which shrinks, or NEVER."""
    c = x0 * x0 + x1 * x1 - distance * distance
    b = x0 * v0 + x1 * v1 + distance * growth
    a = v0 * v0 + v1 * v1 - growth * growth
    if c >= 0.0 and b > 0.0:
        return 0.0
    discriminant = b * b - a * c
    if discriminant < 0.0:
        return NEVER
    root = np.sqrt(discriminant)
    if b > 0.0:
        return max(-c / (b + root), 0.0)
    return max((root - b) / a, 0.0) if a > 0.0 else NEVER
