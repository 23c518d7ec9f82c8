"""Convex bodies with rounded edges: segments and capped cylinders, boxes, triangles, in any dimension.

A body says which of its points is closest. All of it lies behind the plane through that point across the
line to it, at every other time too: what has not come to that plane has not touched the body. So the search
goes from the contact with one plane to that with the next, which are known in closed form on parabolas and
bracketed where the body moves. In straight flight that is Newton's method. It never passes the first contact:
it reaches the last bit, or finds a miss.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom import checks
from carom.compiling.instructions import room_for
from carom.compiling.registry import answers, optional
from carom.errors import InputError
from carom.models import fields
from carom.models.mathematics.parabolas import first_landing, time_to_moving, time_to_plane
from carom.models.obstacles.cells import in_every_image
from carom.models.obstacles.outlines import Hull, directions, images
from carom.models.obstacles.properties import Properties
from carom.models.questions.obstacle import anchor, closest, encounter, fall, is_periodic, outward, rounding
from carom.models.questions.particles import NEVER
from carom.texts import axis_name

SAME_POINT = 2.0**-20
"""Edges of the box within which two points are one."""

FAR = 2.0**20
"""Boxes from which a body is looked at for its corners."""


@optional
def as_place(body, x):
    """Return what is as long as a place; where it is a tuple, loops over axes are unrolled."""
    return x


def away(body, x, axis):
    """Return a coordinate of the unit vector from a convex body to x: the answer of ``outward``."""
    rr = 0.0
    for k in range(len(as_place(body, x))):
        r = x[k] - closest(body, x, k)
        rr += r * r
    return (x[axis] - closest(body, x, axis)) / np.sqrt(rr)


def plane_after_plane(body, course, start, g, x, v, radius, growth):
    """Return when a sphere touches a convex body, or NEVER.

    ``course`` is None where the body rests, ``g`` where the sphere flies straight.
    """
    dimension = len(as_place(body, x))
    there = room_for(x)  # relative to the body
    limit = NEVER
    if course is not None:
        moves = growth != 0.0
        for axis in range(dimension):
            moves = moves or v[axis] != 0.0 or g[axis] != 0.0
        limit = NEVER if moves else course.period
    t = 0.0
    while t <= limit and t < NEVER:
        shift = 0.0 if course is None else course.path.place(start + t)
        for axis in range(dimension):
            bend = 0.0 if g is None else 0.5 * g[axis] * t
            there[axis] = x[axis] + (v[axis] + bend) * t
            if course is not None:
                there[axis] -= course.direction[axis] * shift
        rr = 0.0
        speed = 0.0
        acceleration = 0.0
        slant = 0.0
        for axis in range(dimension):
            r = there[axis] - closest(body, there, axis)
            rr += r * r
            if g is None:
                speed += r * v[axis]
            else:
                speed += r * (v[axis] + g[axis] * t)
                acceleration += r * g[axis]
            if course is not None:
                slant += r * course.direction[axis]
        distance = np.sqrt(rr)
        height = distance - rounding(body) - radius - growth * t
        speed = speed / distance - growth
        if course is not None:
            acceleration /= distance
            slant /= distance
            step = time_to_plane(course, start + t, slant, height + slant * shift, speed, acceleration)
        elif g is not None:
            step = first_landing(height, speed, acceleration / distance)
        elif speed < 0.0:
            step = max(height, 0.0) / -speed
        else:
            step = NEVER
        if t + step == t:
            return t
        t += step
    return NEVER


def fly_to(body, x, v, radius, growth):
    """Return the time until a sphere in straight flight touches a convex body, as ``encounter`` asks."""
    return plane_after_plane(body, None, 0.0, None, x, v, radius, growth)


def fall_on(body, g, x, v, radius, growth, now):
    """Return the same for a sphere on a parabola: the answer of ``fall``."""
    return plane_after_plane(body, None, 0.0, g, x, v, radius, growth)


FOLLOWS = {encounter: fly_to, outward: away, fall: fall_on, time_to_moving: plane_after_plane}
"""What a convex body answers that knows its closest point and its rounding."""


def round_about(kind: Any) -> Any:
    """Let a type of models that answers ``closest`` answer all that follows from it, if it does not yet."""
    for question, answer in FOLLOWS.items():
        if not answers(question, kind):
            question.register(kind)(answer)
    return kind


def convex(kind: Any) -> Any:
    """Let a type with ``closest``, ``anchor`` and ``round`` be one of convex bodies: a class decorator."""
    rounding.register(kind)(lambda body: body.round)
    as_place.register(kind)(lambda body, x: body.anchor)
    return in_every_image(round_about(kind))


def gap_of(value: Any, positions: Any, radii: Any, box: Any, periodic: Any) -> np.ndarray:
    """Return the distance of each surface from the nearest image of what says its closest point [length]."""
    body, d = value.model(), len(box)
    radius = checks.number(rounding(body), f"rounding() of {type(value).__name__}", low=0.0)
    for x in positions[:8].tolist():  # what keeps away from every x is flown to for ever
        near = tuple(checks.answer(closest, body, tuple(x), axis)[0] for axis in range(d))
        again = tuple(checks.answer(closest, body, near, axis)[0] for axis in range(d))
        if max(map(abs, np.subtract(again, near))) > SAME_POINT * max(box):
            raise InputError(
                f"closest() of {type(value).__name__} must return a point of the obstacle, which is closest "
                f"to itself; found {again} as closest to {near}."
            )
    repeats = np.logical_and(periodic, is_periodic(body))
    # The anchor may lie in another box.
    home = [np.floor(anchor(body, axis) / box[axis]) if repeats[axis] else 0.0 for axis in range(d)]
    nearest = np.full(len(positions), np.inf)
    for turn in itertools.product(*[(-1, 0, 1) if wraps else (0,) for wraps in repeats]):
        for k, each in enumerate(positions + (home + np.array(turn)) * np.array(box)):
            x = tuple(each.tolist())
            r = [x[axis] - closest(body, x, axis) for axis in range(d)]
            nearest[k] = min(nearest[k], float(np.linalg.norm(r)))
    return nearest - radius - radii


def outline_of(value: Any, box: Sequence[float], periodic: Sequence[bool]) -> list[Hull]:
    """Return the shapes to draw of what says its closest point: a hull of points seen from far away."""
    body, d, edges = value.model(), len(box), np.array(box, dtype=float)
    center = 0.5 * edges
    found = {
        tuple(closest(body, tuple((center + FAR * edges.max() * each).tolist()), axis) for axis in range(d))
        for each in directions(d)
    }
    corners = np.unique(np.round(np.array([*found]) / edges.max(), 9), axis=0) * edges.max()
    rank = np.linalg.matrix_rank(corners - corners[0], tol=1e-6 * edges.max())
    if rank == 1:
        corners = corners[[0, -1]]  # they are sorted
    elif len(corners) > rank + 1 and rank < d and rounding(body) == 0.0:
        return []  # a flat sheet of many corners is no hull
    repeats = [wraps and bool(is_periodic(body)) for wraps in periodic]
    shifts = images(corners.mean(axis=0), box, repeats)
    return [Hull(tuple(map(tuple, (corners + shift).tolist())), float(rounding(body))) for shift in shifts]


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
        fields.check_dimensions(tuple(self.corners()[0]), box, f"corners of {self.name}")
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
