"""Reference points: fractions of the box along each axis, in integers side by side in one word of 64 bits.

Differences then are the nearest image's by themselves, and exact. ``lists`` is a ``Lists``, of which only the
steps of its points are needed here.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import inner


@inner
def coordinate_bits(dimension):
    """Return how many bits of a reference point are for one axis."""
    return min(32, 64 // dimension)


@inner
def bits(lists):
    """Return how many bits of a reference point are for one axis."""
    return np.int64(coordinate_bits(len(lists.grid_step)))


@inner
def grid_coordinate(lists, point, axis):
    """Return the coordinate of a reference point along an axis, in steps."""
    size = bits(lists)
    return np.int64(np.uint64(point) >> np.uint64(size * axis)) & ((np.int64(1) << size) - 1)


@inner
def grid_difference(lists, to, since, axis):
    """Return the component along an axis of the way between two reference points, of the nearest image."""
    shift = np.uint64(bits(lists) * axis)
    half = np.int64(1) << (bits(lists) - 1)
    # The bits of other axes, above, are cut off with those of the wrap.
    way = np.int64(np.uint64(to) >> shift) - np.int64(np.uint64(since) >> shift)
    return np.int32(((way + half) & (2 * half - 1)) - half) * lists.grid_step[axis]
