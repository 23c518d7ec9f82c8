"""Segments and capped cylinders in any dimension, and polygons made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import Opt, described, number
from carom.densities import unit_ball_volume
from carom.errors import InputError
from carom.models.declared_values import Name, Vector, vector
from carom.models.obstacles.cells import crowded
from carom.models.obstacles.convex import Body, Rounded, check_points


@described
@dataclass(frozen=True, repr=False)
class Segment(Body):
    """A straight line between two points, thickened to a capped cylinder: a stick for d = 2.

    Raises
    ------
    InputError
        If the points are the same, or a number is out of range.
    """

    type = "segment"
    start: Annotated[Vector, Opt("One end [length].")]
    end: Annotated[Vector, Opt("The other end [length].")]
    radius: Annotated[
        float,
        number(low=0.0),
        Opt(
            "Distance of the surface from the line [length]. With 0 the segment is a thin wall, which "
            "particles hit from both sides."
        ),
    ] = 0.0
    name: Name = "segment"

    def complete(self) -> None:
        """Raise InputError where the ends are the same."""
        check_points((self.start, self.end), "ends of a segment")

    def corners(self) -> np.ndarray:
        """Return the two ends, (2, d) [length]."""
        return np.array([self.start, self.end])

    def model(self) -> Stick:
        """Return the model that the engine compiles."""
        start, end = self.corners()
        along = end - start
        return Stick(
            tuple((0.5 * (start + end)).tolist()),
            self.radius,
            self.start,
            tuple(along.tolist()),
            float(along @ along),
        )

    def area(self, box: Sequence[float]) -> float:
        """Return the surface area, for a thin wall that of both sides [length^(d-1)]."""
        d, length = len(box), float(np.linalg.norm(np.subtract(self.end, self.start)))
        ball = d * unit_ball_volume(d) * self.radius ** (d - 1)
        return ball + length * (d - 1) * unit_ball_volume(d - 1) * self.radius ** (d - 2) if d > 1 else 2.0


@crowded
class Stick(Rounded):
    """All places within a distance of a segment."""

    start: tuple
    along: tuple  # from start to end [length]
    square: float  # length squared [length^2]

    def extent(self: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates of each, (k, d) [length]."""
        thick, end = self.round[:, None], self.start + self.along
        return np.minimum(self.start, end) - thick, np.maximum(self.start, end) + thick

    def closest(self, x, axis):
        part = 0.0
        for k in range(len(self.along)):
            part += (x[k] - self.start[k]) * self.along[k]
        return self.start[axis] + min(max(part / self.square, 0.0), 1.0) * self.along[axis]


def polygon(
    corners: Any,
    *,
    radius: float = 0.0,
    closed: bool = True,
    name: str = "polygon",
    **properties: Any,
) -> list[Segment]:
    """Return the sides of a polygon in two dimensions, or a line of segments in any.

    Parameters
    ----------
    corners : (k, d) array_like
        Corners in order [length].
    radius : float
        Thickness of each side, as for :class:`Segment` [length].
    closed : bool
        Whether the last corner is joined to the first.
    name : str
        Name of the polygon; that of side k is "name, side k".
    **properties
        Keywords of all its sides, such as ``impact`` or ``kT``.

    Raises
    ------
    InputError
        If there are too few corners, or two in a row are the same.
    """
    points = [vector(each, "corners of a polygon") for each in corners]
    if len(points) < (3 if closed else 2):
        raise InputError(f"A polygon needs three corners, and a line two; found {len(points)}.")
    ends = points[1:] + points[:1] if closed else points[1:]
    starts = points if closed else points[:-1]
    return [
        Segment(start, end, radius, f"{name}, side {k}", **properties)
        for k, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]
