"""Shapes of obstacles for pictures: what ``outline`` (in the plane) and ``surface`` (in space) return.

Both are optional methods of an obstacle, ``outline(box, periodic)`` and ``surface(box, periodic)``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError

ROUND = 96
"""Segments of a circle."""

DIRECTIONS = 150
"""Points of a sphere: of the rounded corners of solids in space."""


class HalfPlane(NamedTuple):
    """Everything behind a line is solid."""

    point: tuple[float, float]  # on the line [length]
    normal: tuple[float, float]  # unit vector to the free side


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
    offset: float  # the other coordinate [length]


class Hull(NamedTuple):
    """In the plane and in space: all places within a distance of the convex hull of points are solid."""

    corners: tuple[tuple[float, ...], ...]  # the points, in any order [length]
    radius: float = 0.0  # the distance [length]


class Arc(NamedTuple):
    """A piece of a circle, without thickness."""

    center: tuple[float, ...]
    radius: float
    start: float  # angle from the first axis [radians]
    angle: float  # how far it goes from there, counterclockwise [radians]


class SolidBehind(NamedTuple):
    """In space: everything behind a plane is solid."""

    point: tuple[float, ...]  # on the plane [length]
    normal: tuple[float, ...]  # unit vector to the free side


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


PLANE: tuple[type, ...] = (HalfPlane, Disk, Circle, Line, Hull, Arc)  # shapes that ``outline`` may return

SPACE: tuple[type, ...] = (SolidBehind, SolidSphere, HollowSphere, HollowCylinder, Hull)
"""Shapes that ``surface`` may return."""


def shapes(obstacle: Any, name: str, box: Any, periodic: Sequence[bool]) -> list[Any]:
    """Return what the method ``name`` of an obstacle returns; nothing if it has none."""
    method = getattr(obstacle, name, None)
    return [] if method is None else list(method(box, periodic))


def of_all(obstacles: Sequence[Any], box: Any, periodic: Sequence[bool]) -> list[Any]:
    """Return the shapes of all obstacles that say how they are drawn, in two or three dimensions."""
    name, known = ("outline", PLANE) if len(box) == 2 else ("surface", SPACE)
    found = []
    for obstacle in obstacles:
        if hasattr(obstacle, "check"):  # what is only drawn needs none
            # Files may have lost which axes have walls: any box of this dimension will do.
            obstacle.check(tuple(box), (False,) * len(box))
        for shape in shapes(obstacle, name, box, periodic):
            if not isinstance(shape, known):
                raise InputError(
                    f"{name} of {type(obstacle).__name__} returned a {type(shape).__name__}, which cannot be "
                    "drawn; expected shapes of carom.models.obstacles.outlines: "
                    f"{', '.join(kind.__name__ for kind in known)}."
                )
            found.append(shape)
    return found


def images(center: Sequence[float], box: Sequence[float], periodic: Sequence[bool]) -> np.ndarray:
    """Return offsets, (m, d) [length], of images around ``center`` in the box and along periodic axes."""
    edges = np.array(box, dtype=float)
    home = np.where(periodic, np.floor(np.array(center) / edges), 0.0)
    turns = itertools.product(*[(-1, 0, 1) if repeats else (0,) for repeats in periodic])
    return (np.array(list(turns)) - home) * edges


def directions(d: int) -> np.ndarray:
    """Return unit vectors, (m, d), all around in the plane or in space, else along the axes."""
    if d == 2:
        turns = np.linspace(0.0, 2.0 * math.pi, ROUND, endpoint=False)
        return np.stack([np.cos(turns), np.sin(turns)], axis=1)
    if d != 3:
        return np.concatenate([np.eye(d), -np.eye(d)])
    # Points on a spiral from pole to pole are spread evenly.
    heights = np.linspace(-1.0, 1.0, DIRECTIONS)
    spiral = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(DIRECTIONS)
    across = np.sqrt(1.0 - heights**2)
    return np.stack([across * np.cos(spiral), across * np.sin(spiral), heights], axis=1)
