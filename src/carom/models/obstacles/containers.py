"""Containers: hollow spheres and cylinders around everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from carom import checks
from carom.declared import Opt, described, integer, positive
from carom.densities import sphere_area
from carom.errors import InputError
from carom.models.declared_values import Center, Name, Vector, check_dimensions
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.mathematics.contact import exit_sphere
from carom.models.mathematics.parabolas import Gap, at_rest, first_touch, straight_growth
from carom.models.obstacles.outlines import Circle, HollowCylinder, HollowSphere, Line
from carom.models.obstacles.properties import Properties
from carom.texts import axis_name

InnerRadius = Annotated[float, positive, Opt("Inner radius [length].")]


@described
@dataclass(frozen=True, repr=False)
class SphericalContainer(Properties):
    """A hollow sphere around everything; no axis may be periodic.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    type = "sphere"
    center: Center
    radius: InnerRadius
    name: Name = "sphere"

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each particle's surface from the container's, (n,) [length]."""
        return self.radius - np.linalg.norm(positions - np.array(self.center), axis=1) - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension, or an axis is periodic."""
        check_dimensions(self.center, box, f"center of {self.name}")
        if any(periodic):
            raise InputError(
                f"Around {self.name}, a spherical container, no axis may be periodic, found "
                f"{axis_name(list(periodic).index(True))}. Give all axes walls, walls=True; a solid "
                'sphere in the box is a Ball, in a file type = "ball".'
            )

    def confines(self, normal: Sequence[float]) -> tuple[float, float]:
        """Return the offset of the plane with a unit ``normal`` that touches the container, twice."""
        offset = sum(a * b for a, b in zip(self.center, normal, strict=True)) - self.radius
        return offset, offset

    def model(self) -> Inside:
        """Return the model that the engine compiles."""
        return Inside(-1, self.center, self.radius)

    def inside(self, box: Sequence[float]) -> float:
        """Return the inner width [length]."""
        return 2.0 * self.radius

    def area(self, box: Sequence[float]) -> float:
        """Return the inner surface area [length^(d-1)]."""
        return sphere_area(len(box), self.radius)

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Circle]:
        """Return the shapes to draw in two dimensions."""
        return [Circle((self.center[0], self.center[1]), self.radius)]

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[HollowSphere]:
        """Return the shapes to draw in three dimensions."""
        return [HollowSphere(tuple(self.center), self.radius)]


@described
@dataclass(frozen=True, repr=False)
class CylindricalContainer(Properties):
    """A hollow cylinder around everything, along one of the axes; the others may not be periodic.

    Raises
    ------
    InputError
        If there is no such axis, a number is out of range, or the space has one dimension only.
    """

    type = "cylinder"
    axis: Annotated[int, integer(low=0), Opt("Direction of the cylinder: the number of an axis.")]
    center: Annotated[Vector, Opt("Any point on the cylinder's axis [length].")]
    radius: InnerRadius
    name: Name = "cylinder"

    def complete(self) -> None:
        """Raise InputError where there is no such axis, or none across it."""
        checks.integer(self.axis, "axis of a cylinder", low=0, high=len(self.center) - 1)
        if len(self.center) < 2:
            raise InputError("A cylindrical container needs two dimensions or more, found one.")

    def gap(self, positions, radii, box, periodic):
        """Return the distance of each particle's surface from the container's, (n,) [length]."""
        across = np.delete(positions - np.array(self.center), self.axis, axis=1)
        return self.radius - np.linalg.norm(across, axis=1) - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension, or another axis is periodic."""
        check_dimensions(self.center, box, f"center of {self.name}")
        for axis, repeats in enumerate(periodic):
            if repeats and axis != self.axis:
                raise InputError(
                    f"Across {self.name}, a cylindrical container along {axis_name(self.axis)}, no axis may "
                    f"be periodic, found {axis_name(axis)}. Give that axis walls."
                )

    def confines(self, normal: Sequence[float]) -> tuple[float, float] | None:
        """Return the offset of the plane across the cylinder that touches it, twice, or None.

        ``normal`` is the unit normal of that plane.
        """
        if normal[self.axis] != 0.0:
            return None
        offset = sum(a * b for a, b in zip(self.center, normal, strict=True)) - self.radius
        return offset, offset

    def model(self) -> Inside:
        """Return the model that the engine compiles."""
        return Inside(self.axis, self.center, self.radius)

    def inside(self, box: Sequence[float]) -> float:
        """Return the inner width [length]."""
        return 2.0 * self.radius

    def glides(self, axis: int) -> bool:
        """Return whether the cylinder exchanges no momentum along an axis."""
        return axis == self.axis

    def area(self, box: Sequence[float]) -> float:
        """Return the inner surface area [length^(d-1)]."""
        return sphere_area(len(box) - 1, self.radius) * box[self.axis]

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Line]:
        """Return the shapes to draw in two dimensions."""
        middle = self.center[1 - self.axis]
        return [Line(self.axis, middle + side * self.radius) for side in (-1, 1)]

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[HollowCylinder]:
        """Return the shapes to draw in three dimensions."""
        return [HollowCylinder(self.axis, tuple(self.center), self.radius)]


class Inside(ObstacleModel):
    """The inside of a sphere, or of a cylinder along an axis, is free."""

    axis: int  # the coordinate along which a cylinder extends, -1 for a sphere
    center: tuple  # the center, or a point on the axis
    radius: float

    def encounter(self, x, v, radius, growth):
        free_radius = self.radius - radius
        c = -free_radius * free_radius
        b = free_radius * growth
        a = -growth * growth
        for axis in range(len(self.center)):
            if axis != self.axis:
                r = x[axis] - self.center[axis]
                c += r * r
                b += r * v[axis]
                a += v[axis] * v[axis]
        return exit_sphere(c, b, a)

    def fall(self, g, x, v, radius, growth, now):
        if straight_growth(g, self.axis, growth):
            return self.encounter(x, v, radius, growth)
        return self.time_to_moving(at_rest(g), 0.0, g, x, v, radius, growth)

    def time_to_moving(self, course, start, g, x, v, radius, growth):
        free_radius = self.radius - radius
        return first_touch(Gap(course, start, -1.0, self.axis, self.center, free_radius, -growth, g, x, v))

    def outward(self, x, axis):
        if axis == self.axis:
            return 0.0
        rr = 0.0
        for k in range(len(self.center)):
            if k != self.axis:
                rr += (x[k] - self.center[k]) * (x[k] - self.center[k])
        return (self.center[axis] - x[axis]) / np.sqrt(rr)
