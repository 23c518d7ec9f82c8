"""Planes: flat walls in any orientation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from carom.declared import Opt, described, number
from carom.errors import InputError
from carom.models.declared_values import Name, Vector, check_dimensions
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.parabolas import first_landing, time_to_plane
from carom.models.obstacles.box_walls import sides, wall_name
from carom.models.obstacles.outlines import HalfPlane, SolidBehind
from carom.models.obstacles.properties import Properties
from carom.texts import axis_name

UNIT = 2.0**-50  # how much a coordinate of a unit vector may be off by rounding


@described
@dataclass(frozen=True, repr=False)
class Plane(Properties):
    """A flat wall in any orientation: surfaces stay where ``normal.x >= offset``.

    Raises
    ------
    InputError
        If the normal is zero, or a number is not finite.
    """

    type = "plane"
    normal: Annotated[
        Vector, Opt("Vector to the allowed side, of any length. It must be zero along periodic axes.")
    ]
    offset: Annotated[
        float,
        number(),
        Opt(
            "``normal . x`` of the points x on the plane, with this normal: the distance of the plane from "
            "the origin [length] times the length of the normal."
        ),
    ]
    name: Name = "plane"

    def complete(self) -> None:
        """Raise InputError where the normal has no direction."""
        if not any(self.normal):
            raise InputError("The normal of a plane must not be zero: it points to the allowed side.")

    @property
    def natural_direction(self) -> tuple[float, ...]:
        """The normal: a plane is shaken along it unless another direction is given."""
        return self.normal

    def _unit(self) -> tuple[tuple[float, ...], float]:
        """Return the normal of length 1, and the plane's distance from the origin along it."""
        length = math.hypot(*self.normal)
        return tuple(x / length for x in self.normal), self.offset / length

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each particle's surface from the plane, (n,) [length]."""
        normal, distance = self._unit()
        return positions @ np.array(normal) - distance - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the normal has another dimension, or a particle along a periodic axis."""
        check_dimensions(self.normal, box, f"normal of {self.name}")
        for axis, (component, repeats) in enumerate(zip(self.normal, periodic, strict=True)):
            if component and repeats:
                raise InputError(
                    f"The normal of {self.name} has a component along {axis_name(axis)}, which is periodic: "
                    "the plane would end at the box. Give that axis walls."
                )

    def confines(self, normal: Sequence[float]) -> tuple[float, float] | None:
        """Return the offset of the plane with a unit ``normal``, twice; None if its own is another."""
        unit, distance = self._unit()
        same = max(abs(a - b) for a, b in zip(unit, normal, strict=True)) <= UNIT
        return (distance, distance) if same else None

    def model(self) -> HalfSpace:
        """Return the model that the engine compiles."""
        return HalfSpace(*self._unit())

    def glides(self, axis: int) -> bool:
        """Return whether the plane exchanges no momentum along an axis."""
        return self.normal[axis] == 0.0

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[HalfPlane]:
        """Return the shapes to draw in two dimensions."""
        ((point, normal),) = self.surface(box, periodic)
        return [HalfPlane((point[0], point[1]), (normal[0], normal[1]))]

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[SolidBehind]:
        """Return the shapes to draw in three dimensions."""
        normal, distance = self._unit()
        center = 0.5 * np.asarray(box)
        point = center - (np.dot(normal, center) - distance) * np.asarray(normal)
        return [SolidBehind(tuple(point.tolist()), normal)]


def walls(box: Sequence[float], periodic: Sequence[bool]) -> tuple[Plane, ...]:
    """Return the hard walls of the axes that are not periodic: at 0, then at the edge, axis after axis."""
    result = []
    for axis, side in sides(periodic):
        normal = tuple((-1.0) ** side * (k == axis) for k in range(len(box)))
        result.append(Plane(normal, -box[axis] if side else 0.0, wall_name(axis, side)))
    return tuple(result)


class HalfSpace(ObstacleModel):
    """The half space ``normal . x >= offset`` is free."""

    normal: tuple  # unit vector into the free side
    offset: float  # distance from the origin along the normal [length]

    def encounter(self, x, v, radius, growth):
        height = -self.offset - radius
        approach = growth
        for axis in range(len(self.normal)):
            height += self.normal[axis] * x[axis]
            approach -= self.normal[axis] * v[axis]
        return max(height / approach, 0.0) if approach > 0.0 else NEVER

    def fall(self, g, x, v, radius, growth, now):
        height, speed, acceleration = _height_above(self, g, x, v, radius, growth)
        return first_landing(height, speed, acceleration)

    def time_to_moving(self, course, start, g, x, v, radius, growth):
        height, speed, acceleration = _height_above(self, g, x, v, radius, growth)
        slant = 0.0
        for axis in range(len(self.normal)):
            slant += self.normal[axis] * course.direction[axis]
        return time_to_plane(course, start, slant, height, speed, acceleration)

    def outward(self, x, axis):
        return self.normal[axis]


def _height_above(plane, g, x, v, radius, growth):
    """Return height above a plane, its rate and its acceleration."""
    height = -plane.offset - radius
    speed = -growth
    acceleration = 0.0
    for axis in range(len(plane.normal)):
        height += plane.normal[axis] * x[axis]
        speed += plane.normal[axis] * v[axis]
        acceleration += plane.normal[axis] * g[axis]
    return height, speed, acceleration
