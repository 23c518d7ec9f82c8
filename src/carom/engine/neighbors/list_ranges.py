"""How far neighbour lists may reach, and how far they do: margins that neither vanish nor meet an image."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.densities import unit_ball_volume
from carom.engine.neighbors.points import coordinate_bits
from carom.engine.neighbors.size_classes import spans_of
from carom.engine.system import System

NEIGHBORS = (5, 10, 14, 26, 40, 60)
"""Length of the lists that ran fastest in d = 1 to 6 (docs/benchmarks shows the scan; flat within 20 %).

In d = 3 nearly all lists of this mean fill two registers of eight and no third: the search takes as long as
with twelve, and lists are renewed less often.
"""

DENSE_DISKS, OF_DENSE_DISKS = 0.55, 8
"""Packing fraction of equal disks from which on lists of another length run faster, by 3 to 8 %: most fill
one register of eight. At .55 both lengths are as fast, at .45 the shorter one is 3 % slower.
"""

SMALLEST_MARGIN = 0.05
"""Twice the margin of lists of components that differ or grow, at least, in median diameters; else sectors
are better.
"""

FINEST = 16.0
"""Steps of a reference point in a margin, at least: a flight is cut short by about one of them."""

SHORTEST = 1.2  # reach in diameters below which lists are renewed so often that sectors are better


def of_dimension(table: tuple, dimension: int):
    """Return the value for a dimension; beyond the last that is known, that one."""
    return table[min(dimension, len(table)) - 1]


def default_shell(packing_fraction: float, dimension: int) -> float:
    """Return the reach s in diameters at which lists have the right length: ``2^d eta s^d = listed + 1``."""
    listed = of_dimension(NEIGHBORS, dimension) + 1
    if dimension == 2 and packing_fraction >= DENSE_DISKS:
        listed = OF_DENSE_DISKS + 1
    return max((listed / packing_fraction) ** (1.0 / dimension) / 2.0, SHORTEST)


class ListRanges(NamedTuple):
    """How far lists may reach, and how far they do [length]."""

    list_range: float  # distance up to which the largest components are listed
    least: float  # reach below which margins are used up at once
    longest: float  # reach beyond which a neighbour could be listed under two of its images
    core: float  # diameter of the largest component, or the longest reach of its steps
    pace_ratio: float  # margin of the largest component, in those of the mean
    thinnest: float  # the smallest margin
    grid_step: float  # step of a reference point

    @property
    def coarse(self) -> bool:
        """Whether places are kept too coarsely for these margins."""
        return FINEST * self.grid_step > self.thinnest

    def fit(self, system: System) -> bool:
        """Tell whether lists can be had."""
        return self.least < self.list_range <= self.longest and not self.coarse and system.listable


def list_ranges(system: System, shell: float | None) -> ListRanges:
    """Return what lists would be like; ``shell`` as of :func:`choose`."""
    diameter, radii = system.diameter, system.radii
    # Neighbours must stay the nearest image while both move by the margin, and be listed under no other one.
    pace_ratio = 1.0 if radii is None else float(system.paces.max())
    core = diameter if system.reaches is None else 2.0 * float(system.reaches.max())
    # A stream may move them further apart.
    narrowest = system.narrowest / (max(system.listed_stretch) * system.drift_apart)
    longest = diameter + (0.5 * narrowest - core) / (2.0 * pace_ratio)
    if shell is None:
        list_range = min(default_list_range(system), longest)
        shortest = SHORTEST * diameter if radii is None else 0.0
        list_range = max(list_range, shortest, diameter)
    else:
        list_range = diameter * shell
    # A margin that shrinks to nothing in a box too narrow would be used up ever more often.
    least = diameter
    if radii is not None and (system.rates is not None or shell is None):
        least += SMALLEST_MARGIN * 2.0 * float(np.median(radii))
    grid_step = max(spans_of(system, list_range)) * 2.0 ** -coordinate_bits(system.dimension)
    thinnest = 0.5 * (list_range - diameter) * (1.0 if radii is None else float(system.paces.min()))
    return ListRanges(list_range, least, longest, core, pace_ratio, thinnest, grid_step)


def refuse_lists(system: System, margins: ListRanges) -> None:
    """Raise ValueError where lists are asked for and cannot be had."""
    list_range, least, diameter = margins.list_range, margins.least, system.diameter
    if margins.coarse and least < list_range <= margins.longest:
        raise ValueError(
            f"Neighbour lists keep places to {margins.grid_step:g} in a box of this length, too coarse for "
            f"margins of {margins.thinnest:g}; use neighbors='sectors', or a larger shell."
        )
    if list_range > margins.longest or list_range <= least:
        needed = 2.0 * (margins.core + 2.0 * margins.pace_ratio * (max(list_range, least) - diameter))
        needed *= max(system.listed_stretch) * system.drift_apart
        if system.stepped:
            raise ValueError(
                f"The steps of pairs reach {diameter:g}, which needs box edges above {needed:g} to tell "
                f"images apart; the shortest is {system.narrowest:g}. Use more components, or less reach."
            )
        raise ValueError(
            f"Neighbour lists with a reach of {list_range:g} need box edges of at least {needed:g}, "
            f"the shortest is {system.narrowest:g}; use neighbors='sectors', or a smaller shell."
        )
    if not system.listable:
        if system.stepped:
            raise ValueError(
                "Steps of pairs are kept in lists, which are for straight flight: leave out motion."
            )
        raise ValueError("Neighbour lists are for straight flight; use neighbors='sectors' for this motion.")


def default_list_range(system: System) -> float:
    """Return the reach at which lists are as long as they should be, on the average."""
    sizes = system.reaches
    if system.stepped:
        filled = system.n * unit_ball_volume(system.dimension) / math.prod(system.box)
        filled *= (0.5 * system.diameter) ** system.dimension
        return system.diameter * default_shell(filled, system.dimension)
    if sizes is None:
        return system.diameter * default_shell(system.packing_fraction, system.dimension)
    dimension = system.dimension
    wanted = of_dimension(NEIGHBORS, dimension) + 1
    density = unit_ball_volume(dimension) / math.prod(system.box)
    kinds, numbers = np.unique(np.column_stack([sizes, system.paces]), axis=0, return_counts=True)
    if len(kinds) > 64:  # many sizes: some of them stand for all
        order = np.argsort(sizes)[((np.arange(64) + 0.5) / 64.0 * len(sizes)).astype(int)]
        kinds, numbers = np.column_stack([sizes, system.paces])[order], np.full(64, len(sizes) / 64.0)
    weights = numbers[:, None] * numbers[None, :] / len(sizes)

    def listed(skin: float) -> float:
        bounds = kinds[:, 0] + skin * kinds[:, 1]
        return density * float(np.sum(weights * (bounds[:, None] + bounds[None, :]) ** dimension))

    low, high = 0.0, math.prod(system.box) ** (1.0 / dimension) + system.diameter
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if listed(middle) < wanted else (low, middle)
    # Lists of large components among small ones are long; a margin below a tenth would be used up at once.
    smallest = 0.1 * 2.0 * float(np.median(sizes))
    return system.diameter + 2.0 * max(low, smallest)
