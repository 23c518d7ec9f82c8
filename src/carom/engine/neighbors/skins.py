"""Bounds: spheres around reference points that the surfaces of components do not leave.

Three models, chosen by type (one diameter, several, growing ones), give their radii, how far each component
may move inside (its *skin*), the room of its list, and its level.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import required
from carom.compiling.simd import pack


class EqualBounds(NamedTuple):
    """Bounds of components that are all of one diameter."""

    square: float  # square of the distance of reference points up to which two components are listed
    skin: float  # distance from its reference point that a component may reach [length]
    capacity: int  # neighbours a list can hold


class UnequalBounds(NamedTuple):
    """Bounds of components of several diameters."""

    bounds: np.ndarray  # radius of each bound, (n + 1,) float64 [length]
    skins: np.ndarray
    """Distance from its reference point that a component may reach, (n + 1,) float64 [length]."""
    starts: np.ndarray  # where each list begins, and where the last one ends, (n + 1,) int64
    size_classes: np.ndarray  # level of each component, (n + 1,) uint8
    grids: int  # how many levels there are
    largest: np.ndarray  # the largest bound in each, (grids,) float64


class GrowingBounds(NamedTuple):
    """Bounds of components that grow inside them."""

    bounds: np.ndarray  # radius of each bound, (n + 1,) float64 [length]
    radii: np.ndarray
    """Radii of the components at the beginning of the epoch: the array of the cores themselves."""
    rates: np.ndarray  # rates at which they grow, theirs too
    starts: np.ndarray  # where each list begins, and where the last one ends, (n + 1,) int64
    size_classes: np.ndarray  # level of each component, (n + 1,) uint8
    grids: int  # how many levels there are
    largest: np.ndarray  # the largest bound in each, (grids,) float64
    slack: float  # part of the margin that is used


@required
def list_range_sq(bounds, i, j):
    """Return the squared distance of reference points up to which i and j are listed."""


@list_range_sq.register
def _(bounds: EqualBounds, i, j):
    return bounds.square


@list_range_sq.register
def _(bounds: UnequalBounds | GrowingBounds, i, j):
    both = bounds.bounds[i] + bounds.bounds[j]
    return both * both


@required
def pack_bounds(bounds, found, k, sizes):
    """Put the bounds of eight of those found, from the k-th on, side by side into ``sizes``."""


@pack_bounds.register
def _(bounds: EqualBounds, found, k, sizes):
    return None


@pack_bounds.register
def _(bounds: UnequalBounds | GrowingBounds, found, k, sizes):
    pack(bounds.bounds, found, k, np.int64(0), sizes, k)


@required
def list_range_sq_found(bounds, i, k, sizes):
    """Return ``list_range_sq`` of i and the k-th of those whose ``sizes`` are side by side."""


@list_range_sq_found.register
def _(bounds: EqualBounds, i, k, sizes):
    return bounds.square


@list_range_sq_found.register
def _(bounds: UnequalBounds | GrowingBounds, i, k, sizes):
    both = bounds.bounds[i] + sizes[k]
    return both * both


@required
def skin(bounds, i, now):
    """Return how far from its reference point component i may be, and how fast that shrinks."""


@skin.register
def _(bounds: EqualBounds, i, now):
    return bounds.skin, 0.0


@skin.register
def _(bounds: UnequalBounds, i, now):
    return bounds.skins[i], 0.0


@skin.register
def _(bounds: GrowingBounds, i, now):
    left = bounds.bounds[i] - bounds.radii[i] - bounds.rates[i] * now
    return max(left, 0.0) * bounds.slack, bounds.rates[i]


@required
def start(bounds, i):
    """Return where the list of component i begins; that of i + 1 begins where its room ends."""


@start.register
def _(bounds: EqualBounds, i):
    return i * np.uint64(bounds.capacity)


@start.register
def _(bounds: UnequalBounds | GrowingBounds, i):
    return np.uint64(bounds.starts[i])


@required
def size_class(bounds, i):
    """Return the level of component i."""


@size_class.register
def _(bounds: EqualBounds, i):
    return np.uint64(0)


@size_class.register
def _(bounds: UnequalBounds | GrowingBounds, i):
    return np.uint64(bounds.size_classes[i])


@required
def max_range_sq(bounds, i, size_class):
    """Return the largest of the distances of ``list_range_sq`` between i and those of a level, squared."""


@max_range_sq.register
def _(bounds: EqualBounds, i, size_class):
    return bounds.square


@max_range_sq.register
def _(bounds: UnequalBounds | GrowingBounds, i, size_class):
    both = bounds.bounds[i] + bounds.largest[size_class]
    return both * both


@required
def size_classes(bounds):
    """Return how many levels there are."""


@size_classes.register
def _(bounds: EqualBounds):
    return 1


@size_classes.register
def _(bounds: UnequalBounds | GrowingBounds):
    return bounds.grids
