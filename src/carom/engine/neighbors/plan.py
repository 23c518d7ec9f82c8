"""The choice of a neighbor scheme, of its arrays and its epochs: a measured rule (docs/benchmarks)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from carom.engine.calendar import usual_heap
from carom.engine.neighbors import sizes
from carom.engine.neighbors.sizes import (
    ListRanges,
    cell_capacity_of,
    list_capacity_of,
    list_ranges,
    of_dimension,
)
from carom.engine.system import System

DENSEST = (1.0, 0.9069, 0.7405, 0.6169, 0.4653, 0.3729, 0.2953, 0.2537)
"""Densest known packing fractions in d = 1 to 8, rounded as they are: lengths of epochs follow from these
digits, and with them the bits of all runs (``carom.densities.CLOSEST_PACKING`` has the rest).
"""


@dataclass(frozen=True)
class NeighborPlan:
    """The choices that change speed and memory, never the physics. Capacities grow when something is full."""

    kind: str  # lists, sectors, all or pairs
    shape: tuple[int, ...]  # cells along each edge
    cell_capacity: int  # components a cell can hold
    list_range: float  # reach of reference points of the largest [length]; 0 for sectors
    capacity: int  # neighbors a list can hold, of unequal lengths beyond the number expected; 0 for sectors
    epoch: float  # [time], a power of two: times are relative to the epoch
    width: float  # first width of the calendar's buckets [time], a power of two; adapted later
    heap: int  # entries of the calendar's heap
    horizon: float = math.inf
    """Time after which components that grow need another scheme."""
    span: float = 0.0
    """Time that a search among all, or all pairs, covers; 0 for lists and sectors."""
    step: int = 8
    """By how much the room in lists grows at least when one is full, twice that the next time; 0 where all
    lists have the room of the longest, which then grows by a sixteenth.
    """

    def with_larger_neighbors(self, full_cell: bool) -> NeighborPlan:
        """Return the scheme with more room in cells, or in lists."""
        if full_cell:
            return replace(self, cell_capacity=self.cell_capacity + (8 if self.kind == "sectors" else 1))
        growth = max(self.step, self.capacity // 16, 1)
        return replace(self, capacity=self.capacity + growth, step=2 * self.step)

    def with_larger_heap(self) -> NeighborPlan:
        """Return the scheme with more room in the calendar's heap."""
        return replace(self, heap=2 * self.heap)


def collision_rate(packing_fraction: float, dimension: int, diameter: float, speed: float) -> float:
    """Return a rough collision rate of one component [1 / time].

    It is ``2 d (Z - 1) sqrt(kT / m) / (sqrt(pi) sigma)``, with ``Z - 1`` taken as ``2^(d-1) eta / (1 - eta /
    eta_max)``, which is right at both ends.
    """
    free_volume = max(1.0 - packing_fraction / of_dimension(DENSEST, dimension), 2.0**-40)
    excess = 2.0 ** (dimension - 1) * packing_fraction / free_volume
    return 2.0 * math.sqrt(dimension / math.pi) * excess * speed / diameter


SMALLEST_GROWTH = 2.0**-30
"""Part of their diameter by which components must be able to grow before they are as wide as the box."""

LONGEST_PLUNGE = 1024.0
"""Diameters that a pair would fly in an epoch at the speed it has in its deepest well, at most: times are
then rounded by 1e-13 of a diameter.
"""


def power_of_two(x: float) -> float:
    """Return the power of two just below a number, or the number."""
    return 2.0 ** math.floor(math.log2(x))


def short(x: float) -> float:
    """Return a number of twenty binary digits just below, so that sums and differences of a few are exact."""
    if not math.isfinite(x):
        return x
    digit = power_of_two(x) * 2.0**-20
    return math.floor(x / digit) * digit


def lengths_of(system: System, speed: float, rate: float, alone: bool) -> tuple[float, float]:
    """Return the length of an epoch and the width of the calendar's buckets; ``alone`` without sectors."""
    epoch = 1.0
    if speed > 0.0:
        crossing = 4.0 * max(system.box) / speed
        epoch = power_of_two(min(16.0 / rate, crossing) if rate > 0.0 else crossing)
    if system.plunge > 0.0:
        epoch = min(epoch, power_of_two(LONGEST_PLUNGE * system.smallest / system.plunge))
    if alone and speed > 0.0:
        epoch = sizes.epoch_of(system, speed, rate)
    longest = getattr(system.motion, "longest_epoch", lambda: math.inf)()
    if longest < math.inf:
        epoch = min(epoch, power_of_two(float(system.unit.to_kernel(longest, 1))))
    width = epoch
    if speed > 0.0 and rate > 0.0:
        width = min(power_of_two(4.0 / (system.n * rate)), epoch)
    return epoch, width


def horizon_of(system: System, neighbors: str, shape: tuple[int, ...], ranges: ListRanges) -> float:
    """Return the time after which components that grow need another scheme."""
    if system.rates is None:
        return math.inf
    box, diameter = system.box, system.diameter
    if neighbors == "lists":  # until somebody has grown over half of its margin
        return 0.5 * (0.5 * (ranges.list_range - diameter)) / float((system.rates / system.paces).max())
    if neighbors != "sectors":
        return math.inf
    # Along an axis of a lattice that tilts, sectors must be wider than a diameter.
    narrow = min(edge / size / axis for edge, size, axis in zip(box, shape, system.stretch, strict=True))
    horizon = (1.0 - 2.0**-20) * (narrow - diameter) / (2.0 * float(system.rates.max()))
    if horizon * 2.0 * float(system.rates.max()) < SMALLEST_GROWTH * diameter:
        raise ValueError(
            f"The components have grown to a diameter of {diameter:g} in a box of edges "
            f"{', '.join(f'{edge:g}' for edge in box)}: one as wide as the box would meet itself. Use "
            "more of them, or a box more nearly cubic."
        )
    return horizon


DILUTE = (0.01, 0.51, 0.36, 0.18, 0.07, 0.03)
"""Packing fraction in d = 1 to 6 below which sectors run faster than lists."""

SLOWEST = 1e9  # what a collision may cost by estimate [ns]

LISTS_FROM = 6.0
"""Components in a sector as wide as the largest, on the average, from which on lists run faster."""


def choose(
    system: System,
    speed: float,
    neighbors: str = "auto",
    shell: float | None = None,
    rate: float | None = None,
) -> NeighborPlan:
    """Choose the scheme for a scene; a ``shell``, a reach in (largest) diameters, means lists if they fit.

    ``speed`` is the root mean square, ``rate`` the known collisions of one component a time. Raises
    ValueError for an impossible scheme, or if a collision would take longer than ``SLOWEST``.
    """
    if system.curved:
        if neighbors not in ("auto", "all"):
            raise ValueError(
                f"neighbors={neighbors!r} is for straight flight, and {type(system.motion).__name__} bends "
                "the paths of a pair apart; use neighbors='auto'."
            )
        return _pairs(system, speed)
    if system.stepped:
        if neighbors not in ("auto", "lists"):
            raise ValueError(
                f"The steps of pairs are kept in neighbor lists, which neighbors={neighbors!r} has not; use "
                "neighbors='auto'."
            )
        neighbors = "lists"
    begins = rate is None
    if rate is None:
        rate = _expected_rate(system, speed)
    density = system.n / math.prod(system.box)
    spacing = density ** (-1.0 / system.dimension)
    ranges = list_ranges(system, shell)
    if neighbors == "lists":
        sizes.refuse_lists(system, ranges)
    if neighbors == "all" and (lack := sizes.fits_everybody(system)) is not None:
        raise ValueError(f"neighbors='all' needs {lack}; use neighbors='auto'.")
    requested = neighbors
    if neighbors == "auto":
        dense = system.packing_fraction > dilute(system.dimension)
        dense = dense or (system.diameter / spacing) ** system.dimension > LISTS_FROM
        neighbors = "lists" if ranges.fit(system) and (dense or shell is not None) else "sectors"
    if neighbors == "lists":
        side = ranges.list_range
    else:
        side, widest_side = sizes.sector_of(system, spacing)
        if system.rates is None and neighbors == "sectors" and sizes.is_thin(system) and rate > 0.0:
            side = min(sizes.best_side(system, side, speed / rate), max(system.box), widest_side)
        # With walls, obstacles, kicks or growth a run does not wait for pairs at today's rate.
        pairs_only = all(system.periodic) and not system.obstacles and system.straight
        changes = system.rates is not None or system.scene.drive is not None
        lasts = begins and pairs_only and not changes and speed > 0.0 < rate
        if requested == "auto" and sizes.prefers_everybody(system, side, speed, rate):
            neighbors = "all"
        elif lasts and requested == "auto" and sizes.is_thin(system):
            cost = sizes.sector_cost(system, side, speed / rate)
            if cost > SLOWEST:
                lack = sizes.fits_everybody(system) or "double precision and elastic contacts"
                raise ValueError(
                    f"A collision would take about {1e-9 * cost:.2g} s: there is one in {speed / rate:.2g} "
                    f"length units of flight, and at each crossing of a sector the 3^{system.dimension} "
                    f"around it are searched. It is cheap with {lack}; or insist, with "
                    "tuning=carom.Tuning(neighbors='sectors')."
                )
    alone = neighbors == "all"
    stretch = system.listed_stretch if neighbors == "lists" else system.stretch
    sides = [side * each for each in stretch]
    shape = tuple(
        1 if alone else max(int(edge / side), 1) for edge, side in zip(system.box, sides, strict=True)
    )
    epoch, width = lengths_of(system, speed, rate, alone)
    horizon = short(horizon_of(system, neighbors, shape, ranges))
    return NeighborPlan(
        kind=neighbors,
        shape=shape,
        list_range=ranges.list_range if neighbors == "lists" else 0.0,
        capacity=list_capacity_of(system, density, ranges.list_range) if neighbors == "lists" else 0,
        cell_capacity=cell_capacity_of(system, neighbors, shape, ranges.list_range),
        epoch=epoch,
        width=width,
        heap=usual_heap(system.n),
        horizon=horizon,
        step=0 if system.reaches is None else 8,
        span=epoch if alone else 0.0,
    )


def _expected_rate(system: System, speed: float) -> float:
    """Return the collisions of one component a time, where it is not known."""
    typical = system.diameter if system.radii is None else 2.0 * float(system.radii.mean())
    if typical > 0.0:
        return collision_rate(system.packing_fraction, system.dimension, typical, speed)
    return 0.0


def _pairs(system: System, speed: float) -> NeighborPlan:
    """Return the scheme that looks at all pairs, one by one; ``speed`` as of :func:`choose`."""
    # Between walls along all axes nothing is met in an image, and no path is longer than about the box.
    edge = min(system.box) if math.isinf(system.narrowest) else system.narrowest
    epoch = power_of_two(4.0 * edge / speed) if speed > 0.0 else 1.0
    horizon = math.inf
    if system.rates is not None:  # nobody can outgrow this scheme
        horizon = 0.5 * edge / float(system.rates.max())
    return NeighborPlan(
        kind="pairs",
        shape=(1,) * system.dimension,
        cell_capacity=0,
        list_range=0.0,
        capacity=0,
        epoch=epoch,
        width=epoch / power_of_two(4.0 * system.n),
        heap=256,
        horizon=short(horizon),
        span=short(0.25 * epoch),
    )


def dilute(dimension: int) -> float:
    """Return the packing fraction below which sectors run faster than lists."""
    return of_dimension(DILUTE, dimension)
