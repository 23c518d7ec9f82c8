"""Neighbors by the Voronoi tessellation of a box: those that share a face.

SciPy (Qhull) tessellates the particles together with their images near the box. A wall cuts cells off in its
plane, as the mirror images of the particles behind it do.
"""

from __future__ import annotations

import math

import numpy as np

from carom.geometry.overlaps import Geometry

FIRST = 3.0  # depth of the first layer of images around the box [mean spacing]

NARROW = float(np.finfo(float).eps) ** 0.625
"""Width of a face [length of its bond] below which it makes no neighbors. In a square lattice, two cells at
opposite corners of a third share a point, which rounding may turn into a face.
"""

DIGIT = 4.0
"""Width of a face [last digit of the coordinates] up to which rounding may have made it: in crystals it makes
faces of up to two. They make no neighbors, unless another is up to eight times as wide, as in a fluid.
"""


def voronoi_bonds(room: Geometry, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (particle, neighbor) of each bond from both ends, (m, 2), and its vector, (m, d) [length].

    The empty sphere around a corner touches the cell's particle: images are needed up to its diameter.
    """
    n, d = places.shape
    depth = FIRST * (math.prod(room.box) / n) ** (1.0 / d)
    while True:
        points, who = _with_images(room, places, depth)
        ridges, widest = _faces(points, n, DIGIT * _last_digit(places))
        if widest <= depth:
            break
        # A little more, because rounding varies with the number of images.
        depth = 2.0 * depth if math.isinf(widest) else 1.001 * widest
    both = np.concatenate([ridges, ridges[:, ::-1]])
    both = both[(both[:, 0] < n) & (who[both[:, 1]] >= 0)]
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    bonds = points[both[:, 1]] - points[both[:, 0]]
    return np.stack([both[:, 0], who[both[:, 1]]], axis=1), bonds


def _with_images(room: Geometry, places: np.ndarray, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places and their images up to ``depth`` beyond the box, and whose they are (-1: mirrored)."""
    points, who = room.images(places, depth)
    for axis in np.flatnonzero(~room.periodic):
        edge, x = room.box[axis], points[:, axis]
        parts, owners = [points], [who]
        for there in (-x, 2.0 * edge - x):
            near = (there >= -depth) & (there <= edge + depth)
            image = points[near]
            image[:, axis] = there[near]
            parts.append(image)
            owners.append(np.full(len(image), -1))
        points, who = np.concatenate(parts), np.concatenate(owners)
    return points, who


def _last_digit(places: np.ndarray) -> float:
    """Return the last decimal of coordinates, or their rounding to single precision [length]; or else 0."""
    most, single = float(places.max()), float(np.finfo(np.float32).eps)
    if not most > 0.0:
        return 0.0
    last = math.floor(math.log10(most))
    leading = places[places >= 10.0**last]  # those with the fewest decimals, if digits were counted
    for decimals in range(2 - last, 12 - last):
        steps = leading * 10.0**decimals
        rounding = single if decimals <= 4 - last else 4.0 * float(np.finfo(float).eps)
        if np.mean(np.abs(steps - np.rint(steps)) <= rounding * steps) > 0.9:
            return 10.0**-decimals
    steps = places * 2.0 ** (30 - math.frexp(most)[1])
    return single * most if np.mean(steps == np.rint(steps)) > 0.9 else 0.0


def _faces(points: np.ndarray, n: int, limit: float) -> tuple[np.ndarray, float]:
    """Return the pairs (m, 2) with a face wider than ``limit``, and the width of the widest empty sphere."""
    from scipy.spatial import QhullError, Voronoi

    try:
        found = Voronoi(points)
    except (QhullError, ValueError):  # too few points, or all in one plane
        return np.empty((0, 2), np.int64), math.inf
    mine = np.flatnonzero(found.ridge_points.min(axis=1) < n)
    pairs = found.ridge_points[mine].astype(np.int64)
    corners = [found.ridge_vertices[k] for k in mine]
    counts = np.array([len(each) for each in corners])
    widths, lengths, widest = np.zeros(len(mine)), np.zeros(len(mine)), 0.0
    for count in np.unique(counts):
        rows = np.flatnonzero(counts == count)
        indices = np.array([corners[k] for k in rows])
        if (indices < 0).any():
            return pairs[:0], math.inf
        places, ends = found.vertices[indices], points[pairs[rows]]
        spheres = np.linalg.norm(places - ends[:, :1], axis=2)
        widest = max(widest, 2.0 * float(spheres.max()))
        if count >= points.shape[1]:
            spread = places - places.mean(axis=1, keepdims=True)
            widths[rows] = np.linalg.svd(spread, compute_uv=False)[:, points.shape[1] - 2]
            lengths[rows] = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    limit *= not ((widths > limit) & (widths <= 8.0 * limit)).any()
    return pairs[widths > np.maximum(NARROW * lengths, limit)], widest
