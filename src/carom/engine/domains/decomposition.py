"""Slabs of a box: which layers belong to whom, and how far an event can touch beyond its own layer."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.neighbors.lists import FINE, NeighborLists
from carom.engine.neighbors.sectors import Sectors

BORDER_BELOW, BORDER_ABOVE, OWN, MAY_REACH_BORDER, READ_HALO, HISTORY, WRITE_HALO = 1, 2, 4, 8, 32, 64, 128
"""What a layer is to a process: in the zone of its lower border, in that of its upper border, its own.
``MAY_REACH_BORDER`` times one of the first two: an event of somebody there may be in that zone.
``READ_HALO``: an event of the process beyond the border may look there. ``WRITE_HALO``: an event of that
process may touch somebody's partner there. ``HISTORY``: what happens there may touch the same as an event in
a zone.
"""

BORDERS = BORDER_BELOW | BORDER_ABOVE
ANNOUNCED = MAY_REACH_BORDER * BORDERS

PATCHES = 256  # patches that a border is divided into, at most


class InteractionRange(NamedTuple):
    """How far things reach along an axis, in layers.

    A component that searches has moved one sector or margin at most. Two whose contact is scheduled are no
    further apart than when it was found, but may be in other sectors or no longer in each other's lists. A
    few are further away than allowed for: a process that meets one at a border gives the window up.
    """

    layers: int  # layers along the axis
    read: int  # beyond the layers of those whose event it is: whom they may meet
    write: int  # the same: partners of these
    pair: int  # between two that collide

    @property
    def zone(self) -> int:
        """Depth of a zone on either side of its border, in layers: events there may touch the same."""
        return self.read + self.write

    @property
    def conflict_range(self) -> int:
        """Layers between two components up to which their events may touch the same."""
        return self.zone + 2 * self.pair


def interaction_range(neighbors: NeighborLists | Sectors, axis: int) -> InteractionRange:
    """Return how far things reach along an axis."""
    if isinstance(neighbors, Sectors):
        return InteractionRange(int(neighbors.shape[axis]), 2, 4, 1)
    span = float(neighbors.grid_step[axis]) * 2.0 ** coordinate_bits(len(neighbors.grid_step))
    bounds = neighbors.bounds
    list_range = math.sqrt(bounds.square) if hasattr(bounds, "square") else 2.0 * float(bounds.largest.max())
    skin = float(bounds.skin) if hasattr(bounds, "skin") else float(bounds.skins.max())
    cell = max(span / size for size in neighbors.grid.shape[:, axis])
    # Who is in one cell shares it: between two there is always room for a cell.
    read = skin + max(list_range, 0.5 * cell)
    lengths = read, read + list_range, list_range
    return InteractionRange(1 << FINE, *(math.ceil(length * 2.0**FINE / span) + 1 for length in lengths))


def layers_apart(layer, other, layers):
    """Return how many layers two are apart, of so many layers that repeat."""
    gap = layer - other
    gap = -gap if gap < 0 else gap
    return min(gap, layers - gap)


class Slabs(NamedTuple):
    """A box in slabs."""

    axis: int  # axis across the slabs
    masks: np.ndarray  # what each layer is to each process, (processes, layers) uint8
    along: np.ndarray  # two axes along which borders are divided into patches, (2,) int64
    patches: np.ndarray  # into how many, along each of them, (2,) int64
    rows: np.ndarray  # the row of patches that each layer along each of them is in, (2, layers) int64
    layers: np.ndarray  # layers along each axis, (d,) int64
    conflict_range: np.ndarray  # layers between two events up to which they may touch the same, (d,) int64


def most_slabs(neighbors: NeighborLists | Sectors, box) -> int:
    """Return how many slabs a box can have: an event may touch the next one, but not the one after it."""
    axis_range = interaction_range(neighbors, int(np.argmax(box)))
    return axis_range.layers // axis_range.zone


def slabs_of(neighbors: NeighborLists | Sectors, box, periodic, processes: int) -> Slabs:
    """Return a box in as many slabs, across its longest axis."""
    if 1 < processes > most_slabs(neighbors, box):
        raise ValueError(f"There is no room for {processes} slabs.")
    ranges = [interaction_range(neighbors, axis) for axis in range(len(box))]
    axis = int(np.argmax(box))
    layers, axis_range = ranges[axis].layers, ranges[axis]
    reach_depth = axis_range.zone + axis_range.pair
    conflict_range = np.array([axis_range.conflict_range for axis_range in ranges])
    wide = np.array([axis_range.layers for axis_range in ranges])
    masks = np.zeros((processes, layers), np.uint8)
    for process in range(processes):
        low, high = (round(k * layers / processes) for k in (process, process + 1))
        masks[process, low:high] |= OWN
        for plane, border in ((low, BORDER_BELOW), (high, BORDER_ABOVE)):
            if processes > 1 and (periodic[axis] or 0 < plane < layers):
                away = (np.arange(layers) - plane + layers // 2) % layers - layers // 2
                depth = np.where(away < 0, -away - 1, away)
                masks[process, depth < axis_range.read] |= READ_HALO
                masks[process, depth < axis_range.write] |= WRITE_HALO
                masks[process, depth < axis_range.zone] |= border
                masks[process, depth < reach_depth] |= border * MAY_REACH_BORDER
                masks[process, depth < reach_depth + axis_range.conflict_range] |= HISTORY
    along, patches = patches_of(wide // conflict_range, axis)
    rows = np.zeros((2, wide.max()), np.int64)
    for k in range(2):
        rows[k, : wide[along[k]]] = np.arange(wide[along[k]]) * patches[k] // wide[along[k]]
    return Slabs(axis, masks, along, patches, rows, wide, conflict_range)


def patches_of(most, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two axes along a border, and the patches along each, at most ``most``; 1 where none is left."""
    sides = sorted((k for k in range(len(most)) if k != axis), key=lambda k: -most[k])[:2]
    along, patches = np.full(2, axis), np.ones(2, np.int64)
    for k, side in enumerate(sides):
        along[k] = side
        patches[k] = max(min(most[side], round(PATCHES ** (1 / len(sides)))), 1)
    return along, patches
