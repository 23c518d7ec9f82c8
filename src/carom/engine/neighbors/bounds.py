"""Bounds: spheres around reference points that the surfaces of components do not leave.

Two models, chosen by type (one diameter, several or growing ones), give their radii, how far each component
may move inside (its *skin*), the room of its list, and its level.
"""

from __future__ import annotations

import numpy as np

from carom.compiling.lanes import pack
from carom.compiling.registry import Questions


class Bounds(Questions):
    """What bounds answer."""

    def list_range_sq(self, i, j):
        """Return the squared distance of reference points up to which i and j are listed."""
        raise NotImplementedError

    def pack_bounds(self, found, k, sizes):
        """Put the bounds of eight of those found, from the k-th on, side by side into ``sizes``."""
        raise NotImplementedError

    def list_range_sq_found(self, i, k, sizes):
        """Return ``list_range_sq`` of i and the k-th of those whose ``sizes`` are side by side."""
        raise NotImplementedError

    def skin_at(self, i, now):
        """Return how far from its reference point component i may be, and how fast that shrinks."""
        raise NotImplementedError

    def start(self, i):
        """Return where the list of component i begins; that of i + 1 begins where its room ends."""
        raise NotImplementedError

    def size_class(self, i):
        """Return the level of component i."""
        raise NotImplementedError

    def max_range_sq(self, i, size_class):
        """Return the largest ``list_range_sq`` of i and those of a level."""
        raise NotImplementedError

    def class_count(self):
        """Return how many levels there are."""
        raise NotImplementedError


class EqualBounds(Bounds):
    """Bounds of components that are all of one diameter."""

    square: float  # square of the distance of reference points up to which two components are listed
    skin: float  # distance from its reference point that a component may reach [length]
    capacity: int  # neighbors a list can hold

    def list_range_sq(self, i, j):
        return self.square

    def pack_bounds(self, found, k, sizes):
        return None

    def list_range_sq_found(self, i, k, sizes):
        return self.square

    def skin_at(self, i, now):
        return self.skin, 0.0

    def start(self, i):
        return i * self.capacity

    def size_class(self, i):
        return 0

    def max_range_sq(self, i, size_class):
        return self.square

    def class_count(self):
        return 1


class UnequalBounds(Bounds):
    """Bounds of components of several diameters."""

    bounds: np.ndarray  # radius of each bound, (n + 1,) float64 [length]
    skins: np.ndarray
    """Distance from its reference point that each may reach, (n + 1,) float64 [length]; not if it grows."""
    starts: np.ndarray  # where each list begins, and where the last one ends, (n + 1,) int64
    size_classes: np.ndarray  # level of each component, (n + 1,) uint8
    grids: int  # how many levels there are
    largest: np.ndarray  # the largest bound in each, (grids,) float64
    radii: np.ndarray | None = None
    """Radii of components that grow, at the beginning of the epoch: the array of the cores themselves."""
    rates: np.ndarray | None = None  # rates at which they grow, theirs too
    slack: float = 0.0  # part of the margin that they use

    def list_range_sq(self, i, j):
        both = self.bounds[i] + self.bounds[j]
        return both * both

    def pack_bounds(self, found, k, sizes):
        pack(self.bounds, found, k, 0, sizes, k)

    def list_range_sq_found(self, i, k, sizes):
        both = self.bounds[i] + sizes[k]
        return both * both

    def skin_at(self, i, now):
        return _skin_of(self.rates, self, i, now)

    def start(self, i):
        return self.starts[i]

    def size_class(self, i):
        return self.size_classes[i]

    def max_range_sq(self, i, size_class):
        both = self.bounds[i] + self.largest[size_class]
        return both * both

    def class_count(self):
        return self.grids


def _skin_of(rates, bounds, i, now):
    if rates is None:
        return bounds.skins[i], 0.0
    bound = bounds.bounds[i]
    left = bound - bounds.radii[i] - rates[i] * now
    return max(left, bound * 2.0**-100) * bounds.slack, rates[i]  # not nothing: times are divided by it
