"""Thin systems: how wide sectors should be, and when looking at everybody costs less.

On a long free path small sectors are crossed all the while, and large ones bring many candidates. The best
side follows from the measured costs of both (docs/decisions/05-neighbours.md).
"""

from __future__ import annotations

import math

from carom.engine.neighbors.all_pairs import NARROWEST
from carom.engine.neighbors.prefilter import BLOCK
from carom.engine.neighbors.sector_side import ROUNDING_MARGIN
from carom.engine.system import System

THIN = 0.049
"""Packing fraction below which the rules of this module hold: above, the sides that were
measured at 0.05 and beyond stay.
"""

CROSSING, SECTOR, CANDIDATE = 115.0, 3.0, 3.5
"""What a crossing costs by itself, each sector looked into, and each candidate found there [ns]."""

ANEW = 3.0
"""How often a crossing costs as much where images are told apart by sectors: everybody is searched anew."""

MOST = 2.0**20  # sectors, at most

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
    search = 3.0**dimension * (SECTOR + CANDIDATE * members)
    wide = all(size >= 4 or not wraps for size, wraps in zip(shape, system.periodic, strict=True))
    each = CROSSING + (search / 3.0 if wide else ANEW * search)
    return 2.0 * path / side * crossings(dimension) * each + 2.0 * search


def best_side(system: System, least: float, path: float) -> float:
    """Return the side of sectors, ``least`` or larger, at which a collision costs least.

    In high dimension a sector as wide as the box is seen in so many images that smaller ones are tried, too.
    """
    sides = [least * WIDER**k for k in range(STEPS)]
    if system.dimension >= HIGH:
        tight = system.diameter * (1.0 + ROUNDING_MARGIN)
        finer = [tight * WIDER**k for k in range(STEPS) if tight * WIDER**k < least]
        sides += [side for side in finer if math.prod(edge / side for edge in system.box) < MOST]
    return min(sides, key=lambda side: sector_cost(system, side, path))


def is_thin(system: System) -> bool:
    """Tell whether the rules of this module hold."""
    several = system.dimension >= HIGH and 3**system.dimension > system.n
    return system.packing_fraction < THIN or several


def fits_everybody(system: System) -> str | None:
    """Return why not everybody can be looked at, or None if that can be done."""
    if not all(system.periodic) or system.obstacles:
        return "a box that is periodic along all axes, without obstacles"
    if system.rates is not None:
        return "diameters that do not grow"
    if system.drive is not None:
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
