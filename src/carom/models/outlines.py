"""Shapes of obstacles in two dimensions, for pictures: what ``outline(box, periodic)`` returns a list of."""

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
