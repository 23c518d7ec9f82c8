"""Convex bodies with rounded edges: segments and capped cylinders, boxes, triangles, in any dimension."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import declared_values
from carom.models.interfaces.convex import ConvexModel
from carom.models.obstacles.cells import InEveryImage
from carom.models.obstacles.outlines import Hull, directions, images
from carom.models.obstacles.properties import Properties
from carom.texts import axis_name

SAME_POINT = 2.0**-20
"""Edges of the box within which two points are one."""

FAR = 2.0**20
"""Boxes from which a body is looked at for its corners."""


class Rounded(ConvexModel, InEveryImage):
    """One that is solid around its closest point."""

    round: float  # how far [length]

    def rounding(self):
        return self.round

    def as_place(self, x):
        return self.midpoint


def gap_of(value: Any, positions: Any, radii: Any, box: Any, periodic: Any) -> np.ndarray:
    """Return the distance of each surface from the nearest image of what says its closest point [length]."""
    body, d = value.model(), len(box)
    radius = checks.number(body.rounding(), f"rounding() of {type(value).__name__}", low=0.0)
    for x in positions[:8].tolist():  # what keeps away from every x is flown to for ever
        near = tuple(checks.answer("closest", body, tuple(x), axis)[0] for axis in range(d))
        again = tuple(checks.answer("closest", body, near, axis)[0] for axis in range(d))
        if max(map(abs, np.subtract(again, near))) > SAME_POINT * max(box):
            raise InputError(
                f"closest() of {type(value).__name__} must return a point of the obstacle, which is closest "
                f"to itself; found {again} as closest to {near}."
            )
    repeats = np.logical_and(periodic, body.is_periodic())
    # The anchor may lie in another box.
    home = [np.floor(body.anchor(axis) / box[axis]) if repeats[axis] else 0.0 for axis in range(d)]
    nearest = np.full(len(positions), np.inf)
    for turn in itertools.product(*[(-1, 0, 1) if wraps else (0,) for wraps in repeats]):
        for k, each in enumerate(positions + (home + np.array(turn)) * np.array(box)):
            x = tuple(each.tolist())
            r = [x[axis] - body.closest(x, axis) for axis in range(d)]
            nearest[k] = min(nearest[k], float(np.linalg.norm(r)))
    return nearest - radius - radii


def outline_of(value: Any, box: Sequence[float], periodic: Sequence[bool]) -> list[Hull]:
    """Return the shapes to draw of what says its closest point: a hull of points seen from far away."""
    body, d, edges = value.model(), len(box), np.array(box, dtype=float)
    center = 0.5 * edges
    found = {
        tuple(body.closest(tuple((center + FAR * edges.max() * each).tolist()), axis) for axis in range(d))
        for each in directions(d)
    }
    corners = np.unique(np.round(np.array([*found]) / edges.max(), 9), axis=0) * edges.max()
    rank = np.linalg.matrix_rank(corners - corners[0], tol=1e-6 * edges.max())
    if rank == 1:
        corners = corners[[0, -1]]  # they are sorted
    elif len(corners) > rank + 1 and rank < d and body.rounding() == 0.0:
        return []  # a flat sheet of many corners is no hull
    repeats = [wraps and bool(body.is_periodic()) for wraps in periodic]
    shifts = images(corners.mean(axis=0), box, repeats)
    return [Hull(tuple(map(tuple, (corners + shift).tolist())), float(body.rounding())) for shift in shifts]


class Body(Properties, ABC):
    """What all convex bodies have in common; each has ``corners()``, ``model()`` and ``radius``."""

    name: str
    radius: float

    @abstractmethod
    def corners(self) -> np.ndarray:
        """Return the corners (k, d) of the body without its rounding."""

    @abstractmethod
    def model(self) -> Any:
        """Return the model that the engine compiles."""

    def outline(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Hull]:
        """Return the shapes to draw in two dimensions: all images that may reach into the box."""
        return self.surface(box, periodic)

    def surface(self, box: Sequence[float], periodic: Sequence[bool]) -> list[Hull]:
        """Return the shapes to draw in three dimensions, in the same way."""
        corners = self.corners()
        shifts = images(corners.mean(axis=0), box, periodic)
        return [Hull(tuple(map(tuple, (corners + shift).tolist())), self.radius) for shift in shifts]

    gap = gap_of

    def widths(self) -> np.ndarray:
        """Return the widths of the body, (d,) [length]."""
        return np.ptp(self.corners(), axis=0) + 2.0 * self.radius

    def spread(self) -> np.ndarray:
        """Return the widths of the body along axes on which they tell its images apart, (d,) [length]."""
        return self.widths()

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the body has another dimension, or is wider than half of a periodic box."""
        declared_values.check_dimensions(tuple(self.corners()[0]), box, f"corners of {self.name}")
        widths = self.widths()
        for axis, (edge, repeats) in enumerate(zip(box, periodic, strict=True)):
            if repeats and not widths[axis] <= 0.5 * edge:
                raise InputError(
                    f"{self.name} is {widths[axis]:.6g} wide along {axis_name(axis)}, which is periodic with "
                    f"{edge:.6g}; it must fit into half of that, or its images could not be told apart."
                )


def check_points(points: tuple[tuple[float, ...], ...], what: str) -> None:
    """Raise InputError where points are not of one dimension, or one is like another."""
    if len({len(point) for point in points}) > 1:
        raise InputError(f"{what} must have one number of coordinates, found {points}.")
    if len(set(points)) < len(points):
        raise InputError(f"{what} must differ, found {points}.")
