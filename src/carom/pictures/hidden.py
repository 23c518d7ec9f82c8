"""Which spheres of a picture can be seen: of very many, those in front, which are few."""

from __future__ import annotations

import math

import numpy as np

FINE = 6.0
"""Points of the grid in a radius. What shows less than a point of 10^5 spheres is smaller than a pixel."""

MOST_POINTS = 2e7
"""Points that all discs take together, at most, some half a second; beyond, the grid is coarser."""

FEW = 5000
"""Discs up to which all are drawn: they are large, and soon drawn."""


def visible(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return which discs (n,) bool can be seen on a grid of points that is finer than they are.

    Parameters
    ----------
    centres : (n, 2) array
        In the picture [length], in the order in which they are drawn: the last one lies on top.
    radii : (n,) array
        [length], positive.

    Notes
    -----
    Each point gets the number of the last disc that it lies in; a disc without a point is hidden, or shows
    less than the grid can tell. A disc smaller than the distance of two points is kept.
    """
    n = len(radii)
    if n <= FEW:
        return np.ones(n, dtype=bool)
    side = max(float(np.median(radii)) / FINE, math.sqrt(math.pi * float(np.sum(radii**2)) / MOST_POINTS))
    x = (centres - (centres - radii[:, None]).min(axis=0)) / side
    near = np.rint(x).astype(np.int64)
    # From the centre to the nearest point, and the radius, in distances of two points.
    off, r = near - x, radii / side
    margin = int(r.max()) + 2
    row = int(near[:, 1].max()) + 2 * margin
    place = (near[:, 0] + margin) * row + near[:, 1] + margin
    last = np.full((int(near[:, 0].max()) + 2 * margin) * row, -1, dtype=np.int64)
    # Discs of about one size at a time: each size has steps of its own.
    sizes = np.ceil(np.log2(r) * 2.0)
    for size in np.unique(sizes):
        members = np.flatnonzero(sizes == size)
        reach = int(r[members].max() + 1.0)
        for i in range(-reach, reach + 1):
            across = r[members] ** 2 - (off[members, 0] + i) ** 2
            for j in range(-reach, reach + 1):
                if max(abs(i) - 0.5, 0.0) ** 2 + max(abs(j) - 0.5, 0.0) ** 2 > reach**2:
                    continue
                inside = members[(off[members, 1] + j) ** 2 <= across]
                np.maximum.at(last, place[inside] + (i * row + j), inside)
    seen = r < 1.0
    seen[last[last >= 0]] = True
    return seen
