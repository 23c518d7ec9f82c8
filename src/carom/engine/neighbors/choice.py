"""The neighbour scheme of a scene, and the sizes of its arrays: a rule that was measured
(docs/performance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from carom.densities import unit_ball_volume
from carom.engine.neighbors import thin
from carom.engine.neighbors.levels import levels_of
from carom.engine.neighbors.margins import Margins, margins_of, of_dimension, refuse_lists
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
    room = max(1.0 - packing_fraction / of_dimension(DENSEST, dimension), 2.0**-40)
    excess = 2.0 ** (dimension - 1) * packing_fraction / room
    return 2.0 * math.sqrt(dimension / math.pi) * excess * speed / diameter


DILUTE = (0.01, 0.51, 0.36, 0.18, 0.07, 0.03)
"""Packing fraction in d = 1 to 6 below which sectors run faster than lists."""

SECTOR = 0.88
"""Side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/performance)."""

SMALLEST_GROWTH = 2.0**-30
"""Part of their diameter by which components must be able to grow before they are as wide as the box."""

HAIR = 2.0**-40
"""Part of a diameter that a sector is wider than that, to absorb the rounding of its faces."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""

LONGEST_PLUNGE = 1024.0
"""Diameters that a pair would fly in an epoch at the speed it has in its deepest well, at most: times are
then rounded by 1e-13 of a diameter.
"""

CROWDED = 6.0
"""Components in a sector as wide as the largest, on the average, from which on lists run faster."""


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
    if contents.stepped:
        if neighbors not in ("auto", "lists"):
            raise ValueError(
                f"The steps of pairs are kept in neighbour lists, which neighbors={neighbors!r} has not; use "
                "neighbors='auto'."
            )
        neighbors = "lists"
    margins = margins_of(contents, shell)
    if neighbors == "lists":
        refuse_lists(contents, margins)
    density = contents.n / math.prod(contents.box)
    spacing = density ** (-1.0 / contents.dimension)
    if neighbors == "all" and (lack := thin.fits_everybody(contents)) is not None:
        raise ValueError(f"neighbors='all' needs {lack}; use neighbors='auto'.")
    wish = neighbors
    if neighbors == "auto":
        dense = contents.packing_fraction > dilute(contents.dimension)
        dense = dense or (contents.diameter / spacing) ** contents.dimension > CROWDED
        neighbors = "lists" if margins.fit(contents) and (dense or shell is not None) else "sectors"
    if rate is None:
        rate = _expected_rate(contents, speed)
    if neighbors == "lists":
        side = margins.reach
    else:
        side, sight = _sector(contents, spacing)
        if contents.rates is None and neighbors == "sectors" and thin.is_thin(contents) and rate > 0.0:
            side = min(thin.best_side(contents, side, speed / rate), max(contents.box), sight)
        if wish == "auto" and thin.prefers_everybody(contents, side, speed, rate):
            neighbors = "all"
    alone = neighbors == "all"
    shape = tuple(1 if alone else max(int(edge / side), 1) for edge in contents.box)
    epoch, width = _epoch(contents, speed, rate, alone)
    return Scheme(
        kind=neighbors,
        shape=shape,
        cell_capacity=_room_in_cells(contents, neighbors, shape, margins.reach),
        reach=margins.reach if neighbors == "lists" else 0.0,
        capacity=_room_in_lists(contents, density, margins.reach) if neighbors == "lists" else 0,
        epoch=epoch,
        width=width,
        heap=max(256, contents.n // 64),
        horizon=_short(_horizon(contents, neighbors, shape, margins)),
        step=0 if contents.reaches is None else 8,
        span=epoch if alone else 0.0,
    )


def _expected_rate(contents: Contents, speed: float) -> float:
    """Return the collisions of one component a time, where it is not known."""
    typical = contents.diameter if contents.radii is None else 2.0 * float(contents.radii.mean())
    if typical > 0.0:
        return collision_rate(contents.packing_fraction, contents.dimension, typical, speed)
    return 0.0


def _sector(contents: Contents, spacing: float) -> tuple[float, float]:
    """Return the side of a sector, and how wide one may be at most, unless there were too many [length]."""
    box, diameter = contents.box, contents.diameter
    sight = max(WIDEST * contents.smallest, max(box) / MOST_SECTORS ** (1.0 / contents.dimension))
    side = max(diameter * (1.0 + HAIR), min(SECTOR * spacing, max(box), sight))
    if contents.rates is not None:
        side = max(side, 1.05 * diameter)
    return side, sight


def _horizon(contents: Contents, neighbors: str, shape: tuple[int, ...], margins: Margins) -> float:
    """Return the time after which components that grow need another scheme."""
    if contents.rates is None:
        return math.inf
    box, diameter = contents.box, contents.diameter
    if neighbors == "lists":  # until somebody has grown over half of its margin
        return 0.5 * (0.5 * (margins.reach - diameter)) / float((contents.rates / contents.paces).max())
    if neighbors != "sectors":
        return math.inf
    narrow = min(edge / size for edge, size in zip(box, shape, strict=True))
    horizon = (1.0 - 2.0**-20) * (narrow - diameter) / (2.0 * float(contents.rates.max()))
    if horizon * 2.0 * float(contents.rates.max()) < SMALLEST_GROWTH * diameter:
        raise ValueError(
            f"The components have grown to a diameter of {diameter:g} in a box of edges "
            f"{', '.join(f'{edge:g}' for edge in box)}: one as wide as the box would meet itself. Use "
            "more of them, or a box more nearly cubic."
        )
    return horizon


def _epoch(contents: Contents, speed: float, rate: float, alone: bool) -> tuple[float, float]:
    """Return the length of an epoch and the width of the calendar's buckets; ``alone`` without sectors."""
    epoch = 1.0
    if speed > 0.0:
        crossing = 4.0 * max(contents.box) / speed
        epoch = _power_of_two(min(16.0 / rate, crossing) if rate > 0.0 else crossing)
    if contents.plunge > 0.0:
        epoch = min(epoch, _power_of_two(LONGEST_PLUNGE * contents.smallest / contents.plunge))
    if alone and speed > 0.0:
        epoch = thin.epoch_of(contents, speed, rate)
    width = epoch
    if speed > 0.0 and rate > 0.0:
        width = min(_power_of_two(4.0 / (contents.n * rate)), epoch)
    return epoch, width


def _room_in_cells(contents: Contents, neighbors: str, shape: tuple[int, ...], reach: float) -> int:
    """Return how many components a cell can hold at first."""
    members = contents.n / math.prod(shape)
    if contents.reaches is not None and neighbors == "lists":
        members = levels_of(contents, reach).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    return -(-int(most + 1.0) // 8) * 8 - count if count else max(-(-int(most) // 4) * 4, 8)


def _room_in_lists(contents: Contents, density: float, reach: float) -> int:
    """Return how many neighbours a list can hold at first."""
    if contents.reaches is not None:
        return 8
    listed = density * unit_ball_volume(contents.dimension) * reach**contents.dimension
    # Most fluids never need more than this; a few longer ones are no reason for room in all of them.
    return int(listed + 1.25 * math.sqrt(listed) + 1.0)


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
    return of_dimension(DILUTE, dimension)
