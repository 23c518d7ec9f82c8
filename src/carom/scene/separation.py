"""Pushing spheres apart pair by pair, by compiled code: for many components."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from carom.jit import compiled


@lru_cache(maxsize=1)
def sweep() -> Any:
    """Return the compiled :func:`_sweep`."""
    from numba import types

    numbers = types.float64[::1]
    rows = types.float64[:, ::1]
    return compiled(
        _sweep, types.int64(rows, types.int64[:, ::1], numbers, numbers, numbers, numbers, types.float64)
    )


def _sweep(positions, pairs, contact, weight, edges, inverse, clearance):
    """Move apart each of ``pairs`` (m, 2) that overlaps, one by one, in place; return how many did.

    The component with less ``weight`` moves more, to ``clearance`` contact distances. ``inverse`` is 0 along
    axes with walls.
    """
    dimension = edges.size
    separation = np.empty(dimension)
    overlaps = 0
    for k in range(pairs.shape[0]):
        i, j = np.uint64(pairs[k, 0]), np.uint64(pairs[k, 1])
        square = 0.0
        for axis in range(dimension):
            x = positions[j, axis] - positions[i, axis]
            x -= edges[axis] * np.rint(x * inverse[axis])
            separation[axis] = x
            square += x * x
        distance = np.sqrt(square)
        if distance < contact[k]:
            overlaps += 1
            if distance > 0.0:
                stretch = clearance * contact[k] / distance - 1.0
                share = stretch * weight[i] / (weight[i] + weight[j])
                for axis in range(dimension):
                    positions[j, axis] += share * separation[axis]
                    positions[i, axis] -= (stretch - share) * separation[axis]
    return overlaps
