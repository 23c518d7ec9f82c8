"""The visible spheres of a picture: among very many spheres, the few in front."""

from __future__ import annotations

import math

import numpy as np

FINE = 6.0
"""Grid points per radius. In a picture of 10^5 spheres, parts between the points are smaller than a pixel."""

MOST_POINTS = 2e7
"""Largest number of points in all discs together, for some half a second; beyond it, the grid is coarser."""

FEW = 5000
"""Number of discs up to which all are drawn, which takes little time."""


def visible(centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return which discs (n,), the last on top, show on a fine grid, or are too small for its points."""
    n = len(radii)
    if n <= FEW:
        return np.ones(n, dtype=bool)
    side = max(float(np.median(radii)) / FINE, math.sqrt(math.pi * float(np.sum(radii**2)) / MOST_POINTS))
    x = (centers - (centers - radii[:, None]).min(axis=0)) / side
    near = np.rint(x).astype(np.int64)
    # Offset of the center from the nearest point, and radius, in units of the grid.
    off, r = near - x, radii / side
    margin = int(r.max()) + 2
    row = int(near[:, 1].max()) + 2 * margin
    place = (near[:, 0] + margin) * row + near[:, 1] + margin
    last = np.full((int(near[:, 0].max()) + 2 * margin) * row, -1, dtype=np.int64)
    # Discs of about one size together, as each size covers another range of grid steps.
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
