"""Obstacles as spheres, segments and triangles, for pictures in 3D.

Any obstacle with ``outline(box, periodic)`` is drawn in 2D, and any with ``surface(box, periodic)`` in 3D,
also those of the user's own classes. ``carom.models.obstacles.outlines`` has the shapes they return.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError
from carom.models.interfaces.obstacle import Obstacle
from carom.models.obstacles import outlines
from carom.models.obstacles.outlines import ROUND

SHARP = 0.9
"""Two facets whose normals have a smaller product meet in an edge that is drawn."""


class Shapes(NamedTuple):
    """What to draw."""

    spheres: np.ndarray  # centers and radii, (s, 4) [length]
    segments: np.ndarray  # both ends, (l, 2, 3) [length]
    triangles: np.ndarray  # corners, (t, 3, 3) [length]


def shapes_of(obstacles: Sequence[Obstacle], box: np.ndarray, periodic: tuple[bool, ...]) -> Shapes:
    """Return the shapes of obstacles in a box of two or three dimensions; in two, z is 0."""
    spheres: list[list[float]] = []
    segments: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    plane = len(box) == 2
    # In 2D, solids are drawn a little beyond the box.
    beyond = 0.04 * float(max(box)) * np.array([1.0, 1.0, 0.0]) if plane else np.zeros(3)
    lower, upper = -beyond, _in_space(box) + beyond
    for shape in outlines.of_all(obstacles, box, periodic):
        if isinstance(shape, outlines.Disk | outlines.SolidSphere):
            x, reach = _in_space(shape.center), shape.radius
            if np.all(x + reach > lower) and np.all(x - reach <= upper):
                spheres.append([*x.tolist(), reach])
        elif isinstance(shape, outlines.Circle):
            segments.append(_circle(_in_space(shape.center), shape.radius, 0, 1))
        elif isinstance(shape, outlines.HollowSphere):
            segments += _globe(_in_space(shape.center), shape.radius)
        elif isinstance(shape, outlines.HollowCylinder):
            segments += _tube(shape, box)
        elif isinstance(shape, outlines.Line):
            ends = np.zeros((1, 2, 3))
            ends[0, :, 1 - shape.axis] = shape.offset
            ends[0, 1, shape.axis] = box[shape.axis]
            segments.append(ends)
        elif isinstance(shape, outlines.HalfPlane):
            corners = [[lower[0], lower[1]], [upper[0], lower[1]], [upper[0], upper[1]], [lower[0], upper[1]]]
            solid = _behind(_flat(corners), _in_space(shape.point), _in_space(shape.normal))
            triangles += _fan(solid)
        elif isinstance(shape, outlines.Hull):
            tips = np.array([_in_space(corner) for corner in shape.corners])
            low, high = tips.min(axis=0) - shape.radius, tips.max(axis=0) + shape.radius
            if (high < lower).any() or (low > upper).any():
                continue
            faces, edges = _hull_in_plane(shape) if plane else _hull(shape)
            for face in faces:
                triangles += _fan(_within(face, lower, upper))
            segments += [_line_within(edge, lower, upper) for edge in edges]
        elif isinstance(shape, outlines.Arc):
            points = _flat(along(shape))
            segments.append(np.stack([points[:-1], points[1:]], axis=1))
        elif isinstance(shape, outlines.SolidBehind):
            face = _face(np.array(shape.point), np.array(shape.normal), np.zeros(3), np.asarray(box))
            triangles += _fan(face)
            segments.append(np.stack([face, np.roll(face, -1, axis=0)], axis=1))
        else:
            raise NotImplementedError(f"{type(shape).__name__} is not drawn.")
    return Shapes(
        np.array(spheres).reshape(-1, 4),
        np.concatenate(segments) if segments else np.empty((0, 2, 3)),
        np.array(triangles).reshape(-1, 3, 3),
    )


def along(arc: outlines.Arc) -> np.ndarray:
    """Return points along an arc, (k, 2) [length]."""
    turns = arc.start + arc.angle * np.linspace(0.0, 1.0, 181)
    return np.array(arc.center) + arc.radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)


def border(hull: outlines.Hull) -> np.ndarray:
    """Return the corners (k, 2) of a hull in the plane, in order; two if it is a line [length]."""
    corners = np.array(hull.corners)[:, :2]
    if hull.radius > 0.0:
        corners = _around(corners, hull.radius)
    return corners if len(corners) < 3 else corners[_convex(corners).vertices]


def _convex(points: np.ndarray) -> Any:
    """Return the convex hull of points."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError:
        raise InputError(
            f"A Hull of {len(points)} corners is flat, and cannot be drawn; expected a line of two corners, "
            "a triangle, corners that span the space, or a radius above 0."
        ) from None


def _around(corners: np.ndarray, radius: float) -> np.ndarray:
    """Return points in all directions around each corner."""
    d = corners.shape[1]
    return (corners[:, None] + radius * outlines.directions(d)).reshape(-1, d)


def _hull_in_plane(shape: outlines.Hull) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the faces (k, 3) and the lines (2, 3) of a hull in the plane."""
    corners = _flat(border(shape))
    return ([corners], []) if len(corners) > 2 else ([], [corners])


def _hull(shape: outlines.Hull) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the faces (k, 3) and the edges (2, 3) of a hull in space."""
    corners = np.array(shape.corners)
    if shape.radius > 0.0:
        corners = _around(corners, shape.radius)
    elif len(corners) < 4:
        if len(corners) < 3:
            return [], [corners]
        return [corners], list(corners[[(0, 1), (1, 2), (2, 0)]])
    hull = _convex(corners)
    normals = hull.equations[:, :3]
    # Neighbor k of a facet is the one opposite to its corner k.
    bend = np.einsum("fx, fkx -> fk", normals, normals[hull.neighbors])
    sharp = (bend < SHARP) & (hull.neighbors > np.arange(len(normals))[:, None])
    edges = [corners[np.delete(hull.simplices[facet], k)] for facet, k in np.argwhere(sharp)]
    return list(corners[hull.simplices]), edges


def _in_space(x: Any) -> np.ndarray:
    """Return the first three coordinates; missing ones are 0."""
    result = np.zeros(3)
    result[: min(len(x), 3)] = x[:3]
    return result


def _flat(corners: Any) -> np.ndarray:
    """Return points of the plane (k, 2) as points in space, (k, 3)."""
    return np.pad(np.array(corners, dtype=float), ((0, 0), (0, 1)))


def _circle(center: np.ndarray, radius: float, a: int, b: int) -> np.ndarray:
    """Return a circle around ``center`` in the plane of the axes a and b, (ROUND, 2, 3)."""
    angles = np.linspace(0.0, 2.0 * math.pi, ROUND + 1)
    points = np.tile(center, (ROUND + 1, 1))
    points[:, a] += radius * np.cos(angles)
    points[:, b] += radius * np.sin(angles)
    return np.stack([points[:-1], points[1:]], axis=1)


def _globe(center: np.ndarray, radius: float) -> list[np.ndarray]:
    """Return circles of latitude and of longitude."""
    rings = []
    for height in (-0.8, -0.5, 0.0, 0.5, 0.8):
        level = center + height * radius * np.eye(3)[2]
        rings.append(_circle(level, radius * math.sqrt(1.0 - height**2), 0, 1))
    meridian = _circle(np.zeros(3), radius, 0, 2)
    for angle in np.linspace(0.0, math.pi, 6, endpoint=False):
        turned = meridian.copy()
        turned[..., 0] = meridian[..., 0] * math.cos(angle)
        turned[..., 1] = meridian[..., 0] * math.sin(angle)
        rings.append(turned + center)
    return rings


def _tube(shape: outlines.HollowCylinder, box: np.ndarray) -> list[np.ndarray]:
    """Return rings along the axis, and lines between them."""
    across = [axis for axis in range(3) if axis != shape.axis]
    parts, rings = [], []
    for level in np.linspace(0.0, float(box[shape.axis]), 5):
        center = _in_space(shape.center)
        center[shape.axis] = level
        rings.append(_circle(center, shape.radius, *across))
    parts += rings
    every = ROUND // 12
    parts.append(np.stack([rings[0][::every, 0], rings[-1][::every, 0]], axis=1))
    return parts


def _behind(polygon: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the part of a convex polygon (k, 3) behind a plane (Sutherland and Hodgman 1974)."""
    kept: list[np.ndarray] = []
    heights = (polygon - point) @ normal
    for k in range(len(polygon)):
        a, b, ha, hb = polygon[k - 1], polygon[k], heights[k - 1], heights[k]
        if (ha <= 0.0) != (hb <= 0.0):
            kept.append(a + (b - a) * ha / (ha - hb))
        if hb <= 0.0:
            kept.append(b)
    return np.array(kept).reshape(-1, 3)


def _face(point: np.ndarray, normal: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the polygon (k, 3) in which a plane cuts a box."""
    reach = 4.0 * float(np.linalg.norm(upper - lower))
    along = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    along /= np.linalg.norm(along)
    other = np.cross(normal, along)
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    polygon = np.array([point + reach * (a * along + b * other) for a, b in signs])
    return _within(polygon, lower, upper)


def _within(polygon: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the part of a convex polygon (k, 3) in a box."""
    # The margin keeps a polygon that lies in a face of the box.
    margin = 1e-9 * float(np.max(upper - lower))
    if (polygon >= lower - margin).all() and (polygon <= upper + margin).all():
        return polygon
    for axis in range(3):
        polygon = _behind(polygon, upper + margin, np.eye(3)[axis])
        polygon = _behind(polygon, lower - margin, -np.eye(3)[axis])
    return polygon


def _line_within(ends: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the part of a line (2, 3) in a box, as none or one of (k, 2, 3)."""
    part = _within(ends, lower, upper)
    if not len(part):
        return np.empty((0, 2, 3))
    order = np.argsort(part @ (ends[1] - ends[0]))
    return part[order[[0, -1]]][None]


def _fan(polygon: np.ndarray) -> list[np.ndarray]:
    """Return the triangles of a convex polygon."""
    return [polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)]
