"""Sizes of sectors, cells and lists: how wide, with room for how many, and what a collision costs with them.

Nothing here is compiled. ``plan`` makes the choice.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.densities import unit_ball_volume
from carom.engine.neighbors.all_pairs import NARROWEST
from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.neighbors.prefilter import BLOCK
from carom.engine.system import System

SECTOR = 0.88  # side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/benchmarks)

SECTOR_MARGIN = 2.0**-40
"""Part of a diameter that a sector is wider than that, to absorb the rounding of its faces."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""


def sector_of(system: System, spacing: float) -> tuple[float, float]:
    """Return the side of a sector, and how wide one may be at most, unless there were too many [length]."""
    box, diameter = system.box, system.diameter
    widest_side = max(WIDEST * system.smallest, max(box) / MOST_SECTORS ** (1.0 / system.dimension))
    side = max(diameter * (1.0 + SECTOR_MARGIN), min(SECTOR * spacing, max(box), widest_side))
    if system.rates is not None:
        side = max(side, 1.05 * diameter)
    return side, widest_side


class SizeClasses(NamedTuple):
    """Components by size: a factor of two a level."""

    levels: np.ndarray  # level of each component, (n,) int
    reaches: list  # the largest bound in each
    shapes: list  # cells of each along each axis
    members: float  # components in a cell, in the fullest level


def spans_of(system: System, list_range: float) -> list[float]:
    """Return the lengths that reference points are fractions of."""
    return [
        edge if wraps else edge + list_range for edge, wraps in zip(system.box, system.periodic, strict=True)
    ]


def shape_of(spans, side: float, stretch) -> tuple[int, ...]:
    """Return how many cells, no narrower than ``side`` times the ``stretch`` of each axis, fit along it."""
    return tuple(max(int(span / (side * each)), 1) for span, each in zip(spans, stretch, strict=True))


def bounds_of(system: System, list_range: float) -> np.ndarray:
    """Return the radii of the bounds, (n,): sizes and margins."""
    assert system.reaches is not None
    return system.reaches + 0.5 * (list_range - system.diameter) * system.paces


def size_classes_of(system: System, list_range: float) -> SizeClasses:
    """Sort components of several sizes into levels."""
    bound = bounds_of(system, list_range)
    octaves, levels = np.unique(np.floor(np.log2(bound.max() / bound)), return_inverse=True)
    reaches = [float(bound[levels == k].max()) for k in range(len(octaves))]
    spans = spans_of(system, list_range)
    shapes = [shape_of(spans, 2.0 * each, system.listed_stretch) for each in reaches]
    members = [np.count_nonzero(levels == k) / math.prod(shapes[k]) for k in range(len(octaves))]
    return SizeClasses(levels, reaches, shapes, max(members))


def cells_around(levels: SizeClasses, spans, stretch) -> list:
    """Return how many cells to look to either side: for one of a level, in the grid of another, by axis."""
    # A hair more than the sum of two bounds, so that rounding does not lose a cell.
    hair = 1.0 + 2.0**-30
    return [
        [
            [
                math.ceil((one + other) * hair * size / span * each)
                for span, size, each in zip(spans, shape, stretch, strict=True)
            ]
            for other, shape in zip(levels.reaches, levels.shapes, strict=True)
        ]
        for one in levels.reaches
    ]


def starts_of(bound: np.ndarray, system: System, extra: int) -> np.ndarray:
    """Return where the lists begin, each with room for the neighbors expected, and ``extra`` more."""
    dimension = system.dimension
    radii, inverse, numbers = np.unique(bound, return_inverse=True, return_counts=True)
    if len(radii) > 64:
        edges = np.quantile(bound, np.arange(1, 65) / 64.0)
        inverse = np.minimum(np.searchsorted(edges, bound), 63)
        radii, numbers = edges, np.bincount(inverse, minlength=64)
    density = unit_ball_volume(dimension) / math.prod(system.box)
    listed = density * ((radii[:, None] + radii[None, :]) ** dimension) @ numbers
    capacities = np.ceil(listed + 2.0 * np.sqrt(listed)).astype(np.int64) + extra
    capacities = np.minimum(capacities, max(system.n - 1, 1))
    return np.concatenate([[0], np.cumsum(capacities[inverse])]).astype(np.int64)


def cell_capacity_of(system: System, neighbors: str, shape: tuple[int, ...], list_range: float) -> int:
    """Return how many components a cell can hold at first."""
    members = system.n / math.prod(shape)
    if system.reaches is not None and neighbors == "lists":
        members = size_classes_of(system, list_range).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    return -(-int(most + 1.0) // 8) * 8 - count if count else max(-(-int(most) // 4) * 4, 8)


def list_capacity_of(system: System, density: float, list_range: float) -> int:
    """Return how many neighbors a list can hold at first."""
    if system.reaches is not None:
        return 8
    listed = density * unit_ball_volume(system.dimension) * list_range**system.dimension
    # Most fluids never need more than this; a few longer ones are no reason for room in all of them.
    return int(listed + 1.25 * math.sqrt(listed) + 1.0)


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
    longest: float  # reach beyond which a neighbor could be listed under two of its images
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
    # Neighbors must stay the nearest image while both move by the margin, and be listed under no other one.
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
            f"Neighbor lists keep places to {margins.grid_step:g} in a box of this length, too coarse for "
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
            f"Neighbor lists with a reach of {list_range:g} need box edges of at least {needed:g}, "
            f"the shortest is {system.narrowest:g}; use neighbors='sectors', or a smaller shell."
        )
    if not (system.listable or system.bounded):
        instead = "leave out motion" if system.stepped else "use neighbors='sectors' for this motion"
        name = type(system.motion).__name__
        raise ValueError(
            f"Neighbor lists follow paths whose acceleration has a bound, which {name} does not tell: give "
            f"it a method bend, or {instead}."
        )


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


THIN = 0.049
"""Packing fraction below which a system is thin; the sides that were measured at 0.05 and beyond stay."""

CROSSING, LOOKED_INTO, CANDIDATE = 115.0, 3.0, 3.5
"""What a crossing costs by itself, each sector looked into, and each candidate found there [ns]."""

ANEW = 3.0
"""How often a crossing costs as much where images are told apart by sectors: everybody is searched anew."""

WIDER, STEPS = 2.0**0.25, 16
"""Sides that are tried: each so many times as wide as the one before."""

COLLISION, PAIR, PLANE = 1400.0, 0.35, 0.015
"""What a collision costs where everybody is looked at, besides pairs; each pair of a search, and each plane
that it passes, both for each dimension [ns].
"""

FLOWN = 64.0  # boxes that a search among everybody covers, at most

EPOCH = 0.75
"""Part of the time that a search may cover, for epochs at whose beginning all pairs are looked at. Their
lengths are powers of two: from 0.53 to 1.06 of it.
"""

FASTER = 2.5
"""Planes that the fastest of a block passes while the root mean square speed takes it through one box."""

CHEAPER = 0.8  # part of the cost of sectors that looking at everybody may have at most, to be taken by itself

HIGH = 5
"""Dimensions from which on sectors around one are so many that everybody may be looked at at any density."""


def crossings(dimension: int) -> float:
    """Return how many planes of a unit grid a flight of unit length crosses, averaged over directions."""
    half = 0.5 * dimension
    return dimension * math.gamma(half) / (math.sqrt(math.pi) * math.gamma(half + 0.5))


def sector_cost(system: System, side: float, path: float) -> float:
    """Return about what a collision costs with sectors of a side [ns]; ``path`` is the mean free path."""
    dimension = system.dimension
    shape = [max(int(edge / side), 1) for edge in system.box]
    members = system.n / math.prod(shape)
    search = 3.0**dimension * (LOOKED_INTO + CANDIDATE * members)
    wide = all(size >= 4 or not wraps for size, wraps in zip(shape, system.periodic, strict=True))
    each = CROSSING + (search / 3.0 if wide else ANEW * search)
    return 2.0 * path / side * crossings(dimension) * each + 2.0 * search


def best_side(system: System, least: float, path: float) -> float:
    """Return the side of sectors, ``least`` or larger, at which a collision costs least.

    In high dimension a sector as wide as the box is seen in so many images that smaller ones are tried, too.
    """
    sides = [least * WIDER**k for k in range(STEPS)]
    if system.dimension >= HIGH:
        tight = system.diameter * (1.0 + SECTOR_MARGIN)
        finer = [tight * WIDER**k for k in range(STEPS) if tight * WIDER**k < least]
        sides += [side for side in finer if math.prod(edge / side for edge in system.box) < MOST_SECTORS]
    return min(sides, key=lambda side: sector_cost(system, side, path))


def is_thin(system: System) -> bool:
    """Tell whether a system is thin: its sectors are as wide as their costs say, or everybody is looked at.

    On a long free path small sectors are crossed all the while, and large ones bring many candidates. The
    best side follows from the measured costs of both (docs/decisions/05-neighbors.md).
    """
    several = system.dimension >= HIGH and 3**system.dimension > system.n
    return system.packing_fraction < THIN or several


def fits_everybody(system: System) -> str | None:
    """Return why not everybody can be looked at, or None if that can be done."""
    if not all(system.periodic) or system.obstacles:
        return "a box that is periodic along all axes, without obstacles"
    if system.rates is not None:
        return "diameters that do not grow"
    if system.scene.drive is not None:
        return "particles that no drive kicks"
    if not system.straight:
        return "straight flight"
    if system.dimension == 1:
        return "two dimensions or more"
    if system.narrowest < NARROWEST * system.diameter:
        return f"edges of at least {NARROWEST:g} times the largest diameter"
    return None


def span_of(system: System, speed: float, rate: float) -> float:
    """Return the time that a search may cover: a mean free time, but so many boxes at most."""
    crossing = FLOWN * system.narrowest / speed if speed > 0.0 else math.inf
    return min(1.0 / rate, crossing) if rate > 0.0 else crossing


def epoch_of(system: System, speed: float, rate: float) -> float:
    """Return the length of epochs at whose beginning all pairs are looked at."""
    return 2.0 ** math.floor(math.log2(EPOCH * span_of(system, speed, rate)) + 0.5)


def everybody_cost(system: System, speed: float, rate: float) -> float:
    """Return about what a collision costs where everybody is looked at [ns]."""
    epoch = epoch_of(system, speed, rate)
    blocks = math.ceil(system.n / BLOCK)
    planes = 1.0 + FASTER * speed * epoch / system.narrowest
    # Two that have collided are searched until the end of the epoch, of which half is left; all pairs are
    # looked at once an epoch, in whole blocks.
    after = 2.0 * blocks * BLOCK * (PAIR + PLANE * 0.5 * planes)
    anew = system.n * 0.5 * (blocks + 1) * BLOCK * (PAIR + PLANE * planes)
    return COLLISION + system.dimension * (after + anew / (0.5 * system.n * rate * epoch))


def prefers_everybody(system: System, side: float, speed: float, rate: float) -> bool:
    """Tell whether looking at everybody is better than sectors of a side.

    Not for contacts that lose energy: the time that a search covers does not follow falling speeds. Not in
    single precision: coordinates in boxes are too coarse.
    """
    if not is_thin(system) or fits_everybody(system) or system.single or not system.elastic:
        return False
    if system.n == 1 or not (speed > 0.0 and rate > 0.0):
        return False
    costs = everybody_cost(system, speed, rate), sector_cost(system, side, speed / rate)
    return costs[0] < CHEAPER * costs[1]
