"""Slabs of a box: which layers belong to whom, and how far an event can touch beyond its own layer."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner, required
from carom.engine.neighbors.grid import bits, coordinate_bits, steps
from carom.engine.neighbors.lists import Lists
from carom.engine.neighbors.sectors import Sectors

LOWER, UPPER, OWN, HEEDED, RIM, RECALLED = 1, 2, 4, 8, 32, 64
"""What a layer is to a part: in the zone of its lower border, in that of its upper border, its own; its own,
and one that others can touch. ``HEEDED`` times one of the first two: an event of somebody there may be in
that zone. ``RECALLED``: what happens there may touch the same as an event in a zone.
"""

ZONES = LOWER | UPPER
ANNOUNCED = HEEDED * ZONES

FINE = 12
"""Layers are 2 to this power where components have reference points."""

STRIPS = 64
"""Strips that a border is divided into, at most."""


class Touch(NamedTuple):
    """How far things reach along an axis, in layers.

    A component has moved at most one sector, or one margin, when it searches. It finds somebody there whose
    partner is elsewhere: two whose contact is scheduled are no further apart than when it was found, but may
    be in other sectors, or in no list of each other's any more. A few are further away than this allows for:
    a part that meets one at a border gives the window up.
    """

    layers: int
    """Layers along the axis."""
    event: int
    """Beyond the layers of those whose event it is."""
    pair: int
    """Between two that collide."""


def touch_of(neighbors: Lists | Sectors, axis: int) -> Touch:
    """Return how far things reach along an axis."""
    if isinstance(neighbors, Sectors):
        return Touch(int(neighbors.shape[axis]), 4, 1)
    span = float(neighbors.grain[axis]) * 2.0 ** coordinate_bits(len(neighbors.grain))
    bounds = neighbors.bounds
    reach = math.sqrt(bounds.square) if hasattr(bounds, "square") else 2.0 * float(bounds.largest.max())
    margin = float(bounds.margin) if hasattr(bounds, "margin") else float(bounds.margins.max())
    cell = max(span / size for size in neighbors.grid.shape[:, axis])
    event = margin + reach + max(reach + margin, cell)
    layer = span / 2.0**FINE
    return Touch(1 << FINE, math.ceil(event / layer) + 1, math.ceil(reach / layer) + 1)


@required
def layer_of(neighbors, i, axis):
    """Return the layer that component i is in along an axis."""


@layer_of.register
def _(neighbors: Sectors, i, axis):
    return np.uint64(neighbors.place[i, np.uint64(axis)])


@layer_of.register
def _(neighbors: Lists, i, axis):
    return np.uint64(steps(neighbors, neighbors.reference[i], axis) >> (bits(neighbors) - FINE))


@inner
def apart_by(layer, other, layers):
    """Return how many layers two are apart, of so many layers that repeat."""
    gap = np.int64(layer) - np.int64(other)
    gap = -gap if gap < 0 else gap
    return min(gap, layers - gap)


class Slabs(NamedTuple):
    """A box in slabs."""

    axis: int
    """Axis across the slabs."""
    along: int
    """Axis along which borders are divided into strips."""
    masks: np.ndarray
    """What each layer is to each part, (parts, layers) uint8."""
    strips: np.ndarray
    """Strip of each layer along the other axis, (layers,) int64."""
    layers: np.ndarray
    """Layers along each axis, (d,) int64."""
    near: np.ndarray
    """Layers between two events up to which they may touch the same, (d,) int64."""


def most_slabs(neighbors: Lists | Sectors, box) -> int:
    """Return how many slabs a box can have: an event may touch the next one, but not the one after it."""
    touch = touch_of(neighbors, int(np.argmax(box)))
    return touch.layers // (2 * touch.event)


def slabs_of(neighbors: Lists | Sectors, box, periodic, parts: int) -> Slabs:
    """Return a box in as many slabs, across its longest axis.

    Raises
    ------
    ValueError
        If there is no room for so many.
    """
    if 1 < parts > most_slabs(neighbors, box):
        raise ValueError(f"There is no room for {parts} slabs.")
    touches = [touch_of(neighbors, axis) for axis in range(len(box))]
    axis = int(np.argmax(box))
    layers, zone = touches[axis].layers, 2 * touches[axis].event
    heeded = zone + touches[axis].pair
    recalled = heeded + zone + 2 * touches[axis].pair
    masks = np.zeros((parts, layers), np.uint8)
    for part in range(parts):
        low, high = (round(k * layers / parts) for k in (part, part + 1))
        masks[part, low:high] |= OWN
        for plane, border in ((low, LOWER), (high, UPPER)):
            if parts > 1 and (periodic[axis] or 0 < plane < layers):
                away = (np.arange(layers) - plane + layers // 2) % layers - layers // 2
                masks[part, (-zone <= away) & (away < zone)] |= border
                masks[part, (-recalled <= away) & (away < recalled)] |= RECALLED
                masks[part, (-zone // 2 <= away) & (away < zone // 2)] |= RIM
                masks[part, (-heeded <= away) & (away < heeded)] |= border * HEEDED
    near = np.array([2 * (touch.event + touch.pair) for touch in touches])
    wide = np.array([touch.layers for touch in touches])
    # In one dimension a border is a point.
    along = max((k for k in range(len(box)) if k != axis), key=lambda k: wide[k] / near[k], default=axis)
    count = max(min(wide[along] // near[along], STRIPS), 1) if along != axis else 1
    strips = np.arange(wide[along]) * count // wide[along]
    return Slabs(axis, along, masks, strips, wide, near)
