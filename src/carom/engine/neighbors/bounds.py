"""Bounds: spheres around reference points that the surfaces of components do not leave.

A model of bounds gives their radii, the distance that each component may move inside its bound, the room of
its list, and its level. There are three models, chosen by type: for one diameter, for several diameters, and
for growing components.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.columns import line_up
from carom.compiling.registry import required


class EqualBounds(NamedTuple):
    """Bounds of components that are all of one diameter."""

    square: float
    """Square of the distance of reference points up to which two components are listed."""
    margin: float
    """Distance from its reference point that a component may reach [length]."""
    room: int
    """Neighbours a list can hold."""


class UnequalBounds(NamedTuple):
    """Bounds of components of several diameters."""

    bounds: np.ndarray
    """Radius of each bound, (n + 1,) float64 [length]."""
    margins: np.ndarray
    """Distance from its reference point that a component may reach, (n + 1,) float64 [length]."""
    starts: np.ndarray
    """Where each list begins, and where the last one ends, (n + 1,) int64."""
    levels: np.ndarray
    """Level of each component, (n + 1,) uint8."""
    grids: int
    """How many levels there are."""
    largest: np.ndarray
    """The largest bound in each, (grids,) float64."""


class GrowingBounds(NamedTuple):
    """Bounds of components that grow inside them."""

    bounds: np.ndarray
    """Radius of each bound, (n + 1,) float64 [length]."""
    radii: np.ndarray
    """Radii of the components at the beginning of the epoch: the array of the cores themselves."""
    rates: np.ndarray
    """Rates at which they grow, theirs too."""
    starts: np.ndarray
    """Where each list begins, and where the last one ends, (n + 1,) int64."""
    levels: np.ndarray
    """Level of each component, (n + 1,) uint8."""
    grids: int
    """How many levels there are."""
    largest: np.ndarray
    """The largest bound in each, (grids,) float64."""
    slack: float
    """Part of the margin that is used."""


@required
def touching(bounds, i, j):
    """Return the squared distance of reference points up to which i and j are listed."""


@touching.register
def _(bounds: EqualBounds, i, j):
    return bounds.square


@touching.register
def _(bounds: UnequalBounds | GrowingBounds, i, j):
    both = bounds.bounds[i] + bounds.bounds[j]
    return both * both


@required
def line_up_bounds(bounds, found, k, sizes):
    """Put the bounds of eight of those found, from the k-th on, side by side into ``sizes``."""


@line_up_bounds.register
def _(bounds: EqualBounds, found, k, sizes):
    return None


@line_up_bounds.register
def _(bounds: UnequalBounds | GrowingBounds, found, k, sizes):
    line_up(bounds.bounds, found, k, np.int64(0), sizes, k)


@required
def touching_found(bounds, i, k, sizes):
    """Return ``touching`` of i and the k-th of those whose ``sizes`` are side by side."""


@touching_found.register
def _(bounds: EqualBounds, i, k, sizes):
    return bounds.square


@touching_found.register
def _(bounds: UnequalBounds | GrowingBounds, i, k, sizes):
    both = bounds.bounds[i] + sizes[k]
    return both * both


@required
def margin(bounds, i, now):
    """Return how far from its reference point component i may be, and how fast that shrinks."""


@margin.register
def _(bounds: EqualBounds, i, now):
    return bounds.margin, 0.0


@margin.register
def _(bounds: UnequalBounds, i, now):
    return bounds.margins[i], 0.0


@margin.register
def _(bounds: GrowingBounds, i, now):
    left = bounds.bounds[i] - bounds.radii[i] - bounds.rates[i] * now
    return max(left, 0.0) * bounds.slack, bounds.rates[i]


@required
def start(bounds, i):
    """Return where the list of component i begins; that of i + 1 begins where its room ends."""


@start.register
def _(bounds: EqualBounds, i):
    return i * np.uint64(bounds.room)


@start.register
def _(bounds: UnequalBounds | GrowingBounds, i):
    return np.uint64(bounds.starts[i])


@required
def level(bounds, i):
    """Return the level of component i."""


@level.register
def _(bounds: EqualBounds, i):
    return np.uint64(0)


@level.register
def _(bounds: UnequalBounds | GrowingBounds, i):
    return np.uint64(bounds.levels[i])


@required
def widest(bounds, i, level):
    """Return the largest of the distances of ``touching`` between i and those of a level, squared."""


@widest.register
def _(bounds: EqualBounds, i, level):
    return bounds.square


@widest.register
def _(bounds: UnequalBounds | GrowingBounds, i, level):
    both = bounds.bounds[i] + bounds.largest[level]
    return both * both


@required
def levels(bounds):
    """Return how many levels there are."""


@levels.register
def _(bounds: EqualBounds):
    return 1


@levels.register
def _(bounds: UnequalBounds | GrowingBounds):
    return bounds.grids
