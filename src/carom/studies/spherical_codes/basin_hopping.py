"""From one jammed code to a better one: a few points move into holes, then all climb again."""

from __future__ import annotations

import numpy as np

from carom.studies.spherical_codes.contacts import ROUNDING
from carom.studies.spherical_codes.linear_programs import climb

MOVED = 3
"""Points that a hop moves, at most."""

TRIED = 64
"""Random places, of which a moved point takes the one furthest from all others. It is not always the deepest
hole, so that hops lead to different codes."""


def improve(points: np.ndarray, hops: int, rng: np.random.Generator) -> np.ndarray:
    """Return the best code of a walk over local optima (Wales and Doye, J. Phys. Chem. A 101 (1997) 5111).

    A hop from a jammed configuration (n, k) is kept if its smallest angle is not smaller.
    """
    for _ in range(hops):
        there = climb(_scattered(points, rng))
        if largest_product(there) <= largest_product(points) + ROUNDING:
            points = there
    return points


def _scattered(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return points (n, k) of which one to three have been moved into holes between the others."""
    x = np.array(points)
    n, k = x.shape
    for i in rng.permutation(n)[: rng.integers(1, MOVED + 1)]:
        places = rng.standard_normal((TRIED, k))
        places /= np.linalg.norm(places, axis=1)[:, None]
        products = places @ np.delete(x, i, axis=0).T
        x[i] = places[np.argmin(products.max(axis=1))]
    return x


def largest_product(points: np.ndarray) -> float:
    """Return the cosine of the smallest angle between two of the points."""
    return float((points @ points.T)[np.triu_indices(len(points), 1)].max())
