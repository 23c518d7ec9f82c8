"""How far neighbour lists may reach, and how far they do: margins that neither vanish nor meet an image."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.densities import unit_ball_volume
from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.neighbors.levels import spans_of
from carom.engine.requirements import Contents

NEIGHBORS = (5, 10, 14, 26, 40, 60)
"""Length of the lists that ran fastest in d = 1 to 6 (docs/performance shows the scan; flat within 20 %).

In d = 3 nearly all lists of this mean fill two registers of eight and no third: the search takes as long as
with twelve, and lists are renewed less often.
"""

SMALLEST_MARGIN = 0.05
"""Twice the margin of lists of components that differ or grow, at least, in median diameters; else sectors
are better.
"""

FINEST = 16.0
"""Steps of a reference point in a margin, at least: a flight is cut short by about one of them."""

SHORTEST = 1.2
"""Reach in diameters below which lists are renewed so often that sectors are better."""


def of_dimension(table: tuple, dimension: int):
    """Return the value for a dimension; beyond the last that is known, that one."""
    return table[min(dimension, len(table)) - 1]


def default_shell(packing_fraction: float, dimension: int) -> float:
    """Return the reach in diameters at which lists are as long as they should be: ``2^d eta s^d = listed +
    1``.
    """
    listed = of_dimension(NEIGHBORS, dimension) + 1
    return max((listed / packing_fraction) ** (1.0 / dimension) / 2.0, SHORTEST)


class Margins(NamedTuple):
    """How far lists may reach, and how far they do [length]."""

    reach: float
    """Distance up to which the largest components are listed."""
    least: float
    """Reach below which margins are used up at once."""
    widest: float
    """Reach beyond which a neighbour could be listed under two of its images."""
    core: float
    """Diameter of the largest component, or the longest reach of its steps."""
    pace: float
    """Margin of the largest component, in those of the mean."""
    thinnest: float
    """The smallest margin."""
    grain: float
    """Step of a reference point."""

    @property
    def coarse(self) -> bool:
        """Whether places are kept too coarsely for these margins."""
        return FINEST * self.grain > self.thinnest

    def fit(self, contents: Contents) -> bool:
        """Tell whether lists can be had."""
        return self.least < self.reach <= self.widest and not self.coarse and contents.straight


def margins_of(contents: Contents, shell: float | None) -> Margins:
    """Return what lists would be like; ``shell`` as of :func:`choose`."""
    diameter, radii = contents.diameter, contents.radii
    # Neighbours must stay the nearest image while both move by the margin, and be listed under no other one.
    pace = 1.0 if radii is None else float(contents.paces.max())
    core = diameter if contents.reaches is None else 2.0 * float(contents.reaches.max())
    widest = diameter + (0.5 * contents.narrowest - core) / (2.0 * pace)
    if shell is None:
        reach = min(default_reach(contents), widest)
        shortest = SHORTEST * diameter if radii is None else 0.0
        reach = max(reach, shortest, diameter)
    else:
        reach = diameter * shell
    # A margin that shrinks to nothing in a box too narrow would be used up ever more often.
    least = diameter
    if radii is not None and (contents.rates is not None or shell is None):
        least += SMALLEST_MARGIN * 2.0 * float(np.median(radii))
    grain = max(spans_of(contents, reach)) * 2.0 ** -coordinate_bits(contents.dimension)
    thinnest = 0.5 * (reach - diameter) * (1.0 if radii is None else float(contents.paces.min()))
    return Margins(reach, least, widest, core, pace, thinnest, grain)


def refuse_lists(contents: Contents, margins: Margins) -> None:
    """Raise ValueError where lists are asked for and cannot be had."""
    reach, least, diameter = margins.reach, margins.least, contents.diameter
    if margins.coarse and least < reach <= margins.widest:
        raise ValueError(
            f"Neighbour lists keep places to {margins.grain:g} in a box of this length, too coarse for "
            f"margins of {margins.thinnest:g}; use neighbors='sectors', or a larger shell."
        )
    if reach > margins.widest or reach <= least:
        needed = 2.0 * (margins.core + 2.0 * margins.pace * (max(reach, least) - diameter))
        if contents.stepped:
            raise ValueError(
                f"The steps of pairs reach {diameter:g}, which needs box edges above {needed:g} to tell "
                f"images apart; the shortest is {contents.narrowest:g}. Use more components, or less reach."
            )
        raise ValueError(
            f"Neighbour lists with a reach of {reach:g} need box edges of at least {needed:g}, "
            f"the shortest is {contents.narrowest:g}; use neighbors='sectors', or a smaller shell."
        )
    if not contents.straight:
        if contents.stepped:
            raise ValueError(
                "Steps of pairs are kept in lists, which are for straight flight: leave out motion."
            )
        raise ValueError("Neighbour lists are for straight flight; use neighbors='sectors' for this motion.")


def default_reach(contents: Contents) -> float:
    """Return the reach at which lists are as long as they should be, on the average."""
    sizes = contents.reaches
    if contents.stepped:
        filled = contents.n * unit_ball_volume(contents.dimension) / math.prod(contents.box)
        filled *= (0.5 * contents.diameter) ** contents.dimension
        return contents.diameter * default_shell(filled, contents.dimension)
    if sizes is None:
        return contents.diameter * default_shell(contents.packing_fraction, contents.dimension)
    dimension = contents.dimension
    wanted = of_dimension(NEIGHBORS, dimension) + 1
    density = unit_ball_volume(dimension) / math.prod(contents.box)
    kinds, numbers = np.unique(np.column_stack([sizes, contents.paces]), axis=0, return_counts=True)
    if len(kinds) > 64:  # many sizes: some of them stand for all
        order = np.argsort(sizes)[((np.arange(64) + 0.5) / 64.0 * len(sizes)).astype(int)]
        kinds, numbers = np.column_stack([sizes, contents.paces])[order], np.full(64, len(sizes) / 64.0)
    weights = numbers[:, None] * numbers[None, :] / len(sizes)

    def listed(margin: float) -> float:
        bounds = kinds[:, 0] + margin * kinds[:, 1]
        return density * float(np.sum(weights * (bounds[:, None] + bounds[None, :]) ** dimension))

    low, high = 0.0, math.prod(contents.box) ** (1.0 / dimension) + contents.diameter
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if listed(middle) < wanted else (low, middle)
    # Lists of large components among small ones are long; a margin below a tenth would be used up at once.
    smallest = 0.1 * 2.0 * float(np.median(sizes))
    return contents.diameter + 2.0 * max(low, smallest)
