"""The neighbour scheme of a scene, and the sizes of its arrays: a rule that was measured
(docs/performance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from carom.densities import unit_ball_volume
from carom.engine.neighbors import thin
from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.neighbors.levels import levels_of, spans_of
from carom.engine.requirements import Contents

DENSEST = (1.0, 0.9069, 0.7405, 0.6169, 0.4653, 0.3729, 0.2953, 0.2537)
"""Densest known packing fractions in d = 1 to 8, rounded as they are: lengths of epochs follow from these
digits, and with them the bits of all runs (``carom.densities.CLOSEST_PACKING`` has the rest).
"""


@dataclass(frozen=True)
class Scheme:
    """The choices that change speed and memory, never the physics.

    Attributes
    ----------
    kind : {"lists", "sectors", "all", "pairs"}
        The neighbour scheme.
    shape : tuple of int
        Cells along each edge.
    cell_capacity : int
        Components a cell can hold; grown when a cell is full.
    reach : float
        Distance of reference points up to which the largest components are listed [length]; 0 for sectors.
    capacity : int
        Neighbours a list can hold (where lists are of several lengths: beyond the number expected); grown
        when a list is full; 0 for sectors.
    epoch : float
        Length of an epoch [time], a power of two: times are relative to the epoch.
    width : float
        First width of the calendar's buckets [time], a power of two; adapted as the run goes on.
    heap : int
        Entries that the calendar's heap can hold; grown when it is full.
    """

    kind: str
    shape: tuple[int, ...]
    cell_capacity: int
    reach: float
    capacity: int
    epoch: float
    width: float
    heap: int
    horizon: float = math.inf
    """Time after which components that grow need another scheme."""
    span: float = 0.0
    """Time that a search among all, or all pairs, covers; 0 for lists and sectors."""
    step: int = 8
    """By how much the room in lists grows at least when one is full, twice that the next time; 0 where all
    lists have the room of the longest, which then grows by a sixteenth.
    """

    def with_larger_neighbors(self, full_cell: bool) -> Scheme:
        """Return the scheme with more room in cells, or in lists."""
        if full_cell:
            return replace(self, cell_capacity=self.cell_capacity + (8 if self.kind == "sectors" else 1))
        growth = max(self.step, self.capacity // 16, 1)
        return replace(self, capacity=self.capacity + growth, step=2 * self.step)

    def with_larger_heap(self) -> Scheme:
        """Return the scheme with more room in the calendar's heap."""
        return replace(self, heap=2 * self.heap)


def _power_of_two(x: float) -> float:
    return 2.0 ** math.floor(math.log2(x))


def _short(x: float) -> float:
    """Return a number of twenty binary digits just below: sums of a few are exact, and so are times since
    one.
    """
    if not math.isfinite(x):
        return x
    grain = _power_of_two(x) * 2.0**-20
    return math.floor(x / grain) * grain


def collision_rate(packing_fraction: float, dimension: int, diameter: float, speed: float) -> float:
    """Return a rough collision rate of one component [1 / time]: the exact law for it, with a pressure that
    is right at both ends.

    The law is ``2 d (Z - 1) sqrt(kT / m) / (sqrt(pi) sigma)``; ``Z - 1`` is taken as ``2^(d-1) eta / (1 - eta
    / eta_max)``.
    """
    room = max(1.0 - packing_fraction / _of(DENSEST, dimension), 2.0**-40)
    excess = 2.0 ** (dimension - 1) * packing_fraction / room
    return 2.0 * math.sqrt(dimension / math.pi) * excess * speed / diameter


NEIGHBORS = (5, 10, 12, 26, 40, 60)
"""Length of the lists that ran fastest in d = 1 to 6 (docs/performance shows the scan; flat within 20 %)."""

DILUTE = (0.01, 0.51, 0.36, 0.18, 0.07, 0.03)
"""Packing fraction in d = 1 to 6 below which sectors run faster than lists."""

SECTOR = 0.88
"""Side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/performance)."""

SMALLEST_MARGIN = 0.05
"""Twice the margin of lists of components that differ or grow, at least, in median diameters; else sectors
are better.
"""

SMALLEST_GROWTH = 2.0**-30
"""Part of their diameter by which components must be able to grow before they are as wide as the box."""

HAIR = 2.0**-40
"""Part of a diameter that a sector is wider than that, to absorb the rounding of its faces."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""

FINEST = 16.0
"""Steps of a reference point in a margin, at least: a flight is cut short by about one of them."""

LONGEST_PLUNGE = 1024.0
"""Diameters that a pair would fly in an epoch at the speed it has in its deepest well, at most: times are
then rounded by 1e-13 of a diameter.
"""

CROWDED = 6.0
"""Components in a sector as wide as the largest, on the average, from which on lists run faster."""

SHORTEST = 1.2
"""Reach in diameters below which lists are renewed so often that sectors are better."""


def _of(table: tuple, dimension: int):
    return table[min(dimension, len(table)) - 1]


def default_shell(packing_fraction: float, dimension: int) -> float:
    """Return the reach in diameters at which lists are as long as they should be: ``2^d eta s^d = listed +
    1``.
    """
    listed = _of(NEIGHBORS, dimension) + 1
    return max((listed / packing_fraction) ** (1.0 / dimension) / 2.0, SHORTEST)


def choose(
    contents: Contents,
    speed: float,
    neighbors: str = "auto",
    shell: float | None = None,
    rate: float | None = None,
) -> Scheme:
    """Choose the scheme for a scene; a given ``shell`` means lists if they fit.

    Parameters
    ----------
    contents : Contents
        The scene.
    speed : float
        Root mean square speed [length / time].
    neighbors : {"auto", "lists", "sectors", "all"}
        The requested scheme.
    shell : float, optional
        Reach of the lists in (largest) diameters.
    rate : float, optional
        Collisions of one component a time, where it is known.

    Raises
    ------
    ValueError
        If lists are asked for in a box too small for them.
    """
    if contents.curved:
        if neighbors not in ("auto", "all"):
            raise ValueError(
                f"neighbors={neighbors!r} is for straight flight, and {type(contents.motion).__name__} bends "
                "the paths of a pair apart; use neighbors='auto'."
            )
        return _pairs(contents, speed)
    box, diameter, dimension = contents.box, contents.diameter, contents.dimension
    packing_fraction = contents.packing_fraction
    if contents.stepped:
        if neighbors not in ("auto", "lists"):
            raise ValueError(
                f"The steps of pairs are kept in neighbour lists, which neighbors={neighbors!r} has not; use "
                "neighbors='auto'."
            )
        neighbors = "lists"
    # Neighbours must stay the nearest image while both move by the margin, and be listed under no other one.
    pace = 1.0 if contents.radii is None else float(contents.paces.max())
    core = diameter if contents.reaches is None else 2.0 * float(contents.reaches.max())
    widest = diameter + (0.5 * contents.narrowest - core) / (2.0 * pace)
    if shell is None:
        reach = min(_default_reach(contents), widest)
        shortest = SHORTEST * diameter if contents.radii is None else 0.0
        reach = max(reach, shortest, diameter)
    else:
        reach = diameter * shell
    # A margin that shrinks to nothing in a box too narrow would be used up ever more often.
    least = diameter
    if contents.radii is not None and (contents.rates is not None or shell is None):
        least += SMALLEST_MARGIN * 2.0 * float(np.median(contents.radii))
    grain = max(spans_of(contents, reach)) * 2.0 ** -coordinate_bits(dimension)
    thinnest = 0.5 * (reach - diameter) * (1.0 if contents.radii is None else float(contents.paces.min()))
    coarse = FINEST * grain > thinnest
    if neighbors == "lists" and coarse and least < reach <= widest:
        raise ValueError(
            f"Neighbour lists keep places to {grain:g} in a box of this length, too coarse for margins of "
            f"{thinnest:g}; use neighbors='sectors', or a larger shell."
        )
    if neighbors == "lists" and (reach > widest or reach <= least):
        needed = 2.0 * (core + 2.0 * pace * (max(reach, least) - diameter))
        if contents.stepped:
            raise ValueError(
                f"The steps of pairs reach {diameter:g}, which needs box edges above {needed:g} to tell "
                f"images apart; the shortest is {contents.narrowest:g}. Use more components, or less reach."
            )
        raise ValueError(
            f"Neighbour lists with a reach of {reach:g} need box edges of at least {needed:g}, "
            f"the shortest is {contents.narrowest:g}; use neighbors='sectors', or a smaller shell."
        )
    if neighbors == "lists" and not contents.straight:
        if contents.stepped:
            raise ValueError(
                "Steps of pairs are kept in lists, which are for straight flight: leave out motion."
            )
        raise ValueError("Neighbour lists are for straight flight; use neighbors='sectors' for this motion.")
    density = contents.n / math.prod(box)
    spacing = density ** (-1.0 / dimension)
    wish = neighbors
    if neighbors == "all" and (lack := thin.fits_everybody(contents)) is not None:
        raise ValueError(f"neighbors='all' needs {lack}; use neighbors='auto'.")
    if neighbors == "auto":
        fits = least < reach <= widest and not coarse and contents.straight
        dense = packing_fraction > dilute(dimension) or (diameter / spacing) ** dimension > CROWDED
        neighbors = "lists" if fits and (dense or shell is not None) else "sectors"
    typical = diameter if contents.radii is None else 2.0 * float(contents.radii.mean())
    if rate is None:
        rate = collision_rate(packing_fraction, dimension, typical, speed) if typical > 0.0 else 0.0
    sizes = contents.reaches
    margin = 0.5 * (reach - diameter)
    horizon = math.inf
    if neighbors == "lists":
        side = reach
        if contents.rates is not None:
            # Until somebody has grown over half of its margin.
            horizon = 0.5 * margin / float((contents.rates / contents.paces).max())
    else:
        sight = max(WIDEST * contents.smallest, max(box) / MOST_SECTORS ** (1.0 / dimension))
        side = max(diameter * (1.0 + HAIR), min(SECTOR * spacing, max(box), sight))
        if contents.rates is not None:
            side = max(side, 1.05 * diameter)
        elif neighbors == "sectors" and thin.is_thin(contents) and rate > 0.0:
            side = min(thin.best_side(contents, side, speed / rate), max(box), sight)
        if wish == "auto" and thin.prefers_everybody(contents, side, speed, rate):
            neighbors = "all"
    shape = (1,) * dimension if neighbors == "all" else tuple(max(int(edge / side), 1) for edge in box)
    if neighbors == "sectors" and contents.rates is not None:
        narrow = min(edge / size for edge, size in zip(box, shape, strict=True))
        horizon = (1.0 - 2.0**-20) * (narrow - diameter) / (2.0 * float(contents.rates.max()))
        if horizon * 2.0 * float(contents.rates.max()) < SMALLEST_GROWTH * diameter:
            raise ValueError(
                f"The components have grown to a diameter of {diameter:g} in a box of edges "
                f"{', '.join(f'{edge:g}' for edge in box)}: one as wide as the box would meet itself. Use "
                "more of them, or a box more nearly cubic."
            )
    members = contents.n / math.prod(shape)
    if sizes is not None and neighbors == "lists":
        members = levels_of(contents, reach).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    epoch = 1.0
    if speed > 0.0:
        crossing = 4.0 * max(box) / speed
        epoch = _power_of_two(min(16.0 / rate, crossing) if rate > 0.0 else crossing)
    if contents.plunge > 0.0:
        epoch = min(epoch, _power_of_two(LONGEST_PLUNGE * contents.smallest / contents.plunge))
    if neighbors == "all" and speed > 0.0:
        epoch = thin.epoch_of(contents, speed, rate)
    width = epoch
    if speed > 0.0 and rate > 0.0:
        width = min(_power_of_two(4.0 / (contents.n * rate)), epoch)
    capacity = 0
    if neighbors != "lists":
        reach = 0.0
    elif sizes is None:
        listed = density * unit_ball_volume(dimension) * reach**dimension
        # Most fluids never need more than this; a few longer ones are no reason for room in all of them.
        capacity = int(listed + 1.25 * math.sqrt(listed) + 1.0)
    else:
        capacity = 8
    return Scheme(
        kind=neighbors,
        shape=shape,
        cell_capacity=-(-int(most + 1.0) // 8) * 8 - count if count else max(-(-int(most) // 4) * 4, 8),
        reach=reach,
        capacity=capacity,
        epoch=epoch,
        width=width,
        heap=max(256, contents.n // 64),
        horizon=_short(horizon),
        step=0 if sizes is None else 8,
        span=epoch if neighbors == "all" else 0.0,
    )


def _pairs(contents: Contents, speed: float) -> Scheme:
    """Return the scheme that looks at all pairs, one by one; ``speed`` as of :func:`choose`."""
    epoch = _power_of_two(4.0 * contents.narrowest / speed) if speed > 0.0 else 1.0
    horizon = math.inf
    if contents.rates is not None:  # nobody can outgrow this scheme
        horizon = 0.5 * contents.narrowest / float(contents.rates.max())
    return Scheme(
        kind="pairs",
        shape=(1,) * contents.dimension,
        cell_capacity=0,
        reach=0.0,
        capacity=0,
        epoch=epoch,
        width=epoch / _power_of_two(4.0 * contents.n),
        heap=256,
        horizon=_short(horizon),
        span=_short(0.25 * epoch),
    )


def dilute(dimension: int) -> float:
    """Return the packing fraction below which sectors run faster than lists."""
    return _of(DILUTE, dimension)


def _default_reach(contents: Contents) -> float:
    """Return the reach at which lists are as long as they should be, on the average."""
    sizes = contents.reaches
    if contents.stepped:
        filled = contents.n * unit_ball_volume(contents.dimension) / math.prod(contents.box)
        filled *= (0.5 * contents.diameter) ** contents.dimension
        return contents.diameter * default_shell(filled, contents.dimension)
    if sizes is None:
        return contents.diameter * default_shell(contents.packing_fraction, contents.dimension)
    dimension = contents.dimension
    wanted = _of(NEIGHBORS, dimension) + 1
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
