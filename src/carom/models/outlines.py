"""Shapes of obstacles for pictures: what ``outline`` (in the plane) and ``surface`` (in space) return.

Both are optional methods of an obstacle, ``outline(box, periodic)`` and ``surface(box, periodic)``.
"""

from __future__ import annotations

from typing import NamedTuple


class HalfPlane(NamedTuple):
    """Everything behind a line is solid."""

    point: tuple[float, float]
    """On the line [length]."""
    normal: tuple[float, float]
    """Unit vector to the free side."""


class Disk(NamedTuple):
    """The inside of a circle is solid."""

    center: tuple[float, float]
    radius: float


class Circle(NamedTuple):
    """The inside of a circle is free."""

    center: tuple[float, float]
    radius: float


class Line(NamedTuple):
    """A line along an axis."""

    axis: int
    offset: float
    """The other coordinate [length]."""


class Polygon(NamedTuple):
    """The inside of a polygon is solid."""

    corners: tuple[tuple[float, ...], ...]
    """In order [length]."""


class Stadium(NamedTuple):
    """All places within a distance of a segment are solid; a line where that is zero."""

    start: tuple[float, ...]
    end: tuple[float, ...]
    radius: float


class Arc(NamedTuple):
    """A piece of a circle, without thickness."""

    center: tuple[float, ...]
    radius: float
    start: float
    """Angle from the first axis [radians]."""
    angle: float
    """How far it goes from there, counterclockwise [radians]."""


class SolidBehind(NamedTuple):
    """In space: everything behind a plane is solid."""

    point: tuple[float, ...]
    """On the plane [length]."""
    normal: tuple[float, ...]
    """Unit vector to the free side."""


class SolidSphere(NamedTuple):
    """In space: the inside of a sphere is solid."""

    center: tuple[float, ...]
    radius: float


class HollowSphere(NamedTuple):
    """In space: the inside of a sphere is free."""

    center: tuple[float, ...]
    radius: float


class HollowCylinder(NamedTuple):
    """In space: the inside of a cylinder along an axis is free."""

    axis: int
    center: tuple[float, ...]
    radius: float
