"""Triangles: the pieces of which surfaces are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import Opt, described, number
from carom.errors import InputError
from carom.models.declared_values import Name, Vector
from carom.models.obstacles.cells import crowded
from carom.models.obstacles.convex import Body, Rounded, check_points

Corner = Annotated[Vector, Opt("A corner [length].")]


@described
@dataclass(frozen=True, repr=False)
class Triangle(Body):
    """A flat triangle, thickened if it has a radius: the piece of which surfaces are made.

    Raises
    ------
    InputError
        If the corners lie on a line, or a number is out of range.
    """

    type = "triangle"
    a: Corner
    b: Corner
    c: Corner
    radius: Annotated[
        float,
        number(low=0.0),
        Opt("Thickness added on all sides [length]; 0 is a thin wall in three dimensions."),
    ] = 0.0
    name: Name = "triangle"

    def complete(self) -> None:
        """Raise InputError where the corners lie on a line."""
        check_points((self.a, self.b, self.c), "corners of a triangle")
        u, v = np.subtract(self.b, self.a), np.subtract(self.c, self.a)
        if not (u @ u) * (v @ v) - (u @ v) ** 2 > 1e-12 * (u @ u) * (v @ v):
            raise InputError(f"The corners of {self.name} lie on a line: give a Segment.")

    def corners(self) -> np.ndarray:
        """Return the three corners, (3, d) [length]."""
        return np.array([self.a, self.b, self.c])

    def model(self) -> Facet:
        """Return the model that the engine compiles."""
        corners = self.corners()
        a, b, c = corners
        u, v = b - a, c - a
        middle = tuple((0.5 * (corners.min(axis=0) + corners.max(axis=0))).tolist())
        sides = tuple(u.tolist()), tuple(v.tolist())
        return Facet(middle, self.radius, self.a, *sides, float(u @ u), float(u @ v), float(v @ v))


@crowded
class Facet(Rounded):
    """All places within a distance of a triangle."""

    corner: tuple
    u: tuple  # from the first corner to the second [length]
    v: tuple  # from the first corner to the third [length]
    uu: float
    uv: float
    vv: float

    def extent(self: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates of each, (k, d) [length]."""
        corners = np.stack([self.corner, self.corner + self.u, self.corner + self.v])
        return corners.min(axis=0) - self.round[:, None], corners.max(axis=0) + self.round[:, None]

    def closest(self, x, axis):
        a, b = _barycentric(self, x)
        return self.corner[axis] + a * self.u[axis] + b * self.v[axis]


def _barycentric(body, x):
    """Return how far along u and v the point of a triangle lies that is closest to x."""
    pu = 0.0
    pv = 0.0
    for k in range(len(body.midpoint)):
        r = x[k] - body.corner[k]
        pu += r * body.u[k]
        pv += r * body.v[k]
    # Inside, or the closest of the three sides.
    determinant = body.uu * body.vv - body.uv * body.uv
    a = (pu * body.vv - pv * body.uv) / determinant
    b = (pv * body.uu - pu * body.uv) / determinant
    if a >= 0.0 and b >= 0.0 and a + b <= 1.0:
        return a, b
    best_a = min(max(pu / body.uu, 0.0), 1.0)
    best_b = 0.0
    best = body.uu * best_a * best_a - 2.0 * best_a * pu
    other = min(max(pv / body.vv, 0.0), 1.0)
    square = body.vv * other * other - 2.0 * other * pv
    if square < best:
        best, best_a, best_b = square, 0.0, other
    length = body.uu - 2.0 * body.uv + body.vv
    part = min(max((pv - pu + body.uu - body.uv) / length, 0.0), 1.0)
    complement = 1.0 - part
    square = complement * complement * body.uu + 2.0 * complement * part * body.uv + part * part * body.vv
    square -= 2.0 * (complement * pu + part * pv)
    if square < best:
        best_a, best_b = complement, part
    return best_a, best_b
