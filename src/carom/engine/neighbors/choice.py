"""The neighbour scheme of a scene, and the sizes of its arrays: a rule that was measured
(docs/performance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from carom.engine.calendar import usual_heap
from carom.engine.neighbors import thin
from carom.engine.neighbors.epochs import horizon_of, lengths_of, power_of_two, short
from carom.engine.neighbors.margins import margins_of, of_dimension, refuse_lists
from carom.engine.neighbors.rooms import room_in_cells, room_in_lists
from carom.engine.neighbors.sides import sector_of
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
    if rate is None:
        rate = _expected_rate(contents, speed)
    density = contents.n / math.prod(contents.box)
    spacing = density ** (-1.0 / contents.dimension)
    margins = margins_of(contents, shell)
    if neighbors == "lists":
        refuse_lists(contents, margins)
    if neighbors == "all" and (lack := thin.fits_everybody(contents)) is not None:
        raise ValueError(f"neighbors='all' needs {lack}; use neighbors='auto'.")
    wish = neighbors
    if neighbors == "auto":
        dense = contents.packing_fraction > dilute(contents.dimension)
        dense = dense or (contents.diameter / spacing) ** contents.dimension > CROWDED
        neighbors = "lists" if margins.fit(contents) and (dense or shell is not None) else "sectors"
    if neighbors == "lists":
        side = margins.reach
    else:
        side, sight = sector_of(contents, spacing)
        if contents.rates is None and neighbors == "sectors" and thin.is_thin(contents) and rate > 0.0:
            side = min(thin.best_side(contents, side, speed / rate), max(contents.box), sight)
        if wish == "auto" and thin.prefers_everybody(contents, side, speed, rate):
            neighbors = "all"
    alone = neighbors == "all"
    shape = tuple(1 if alone else max(int(edge / side), 1) for edge in contents.box)
    epoch, width = lengths_of(contents, speed, rate, alone)
    horizon = short(horizon_of(contents, neighbors, shape, margins))
    return Scheme(
        kind=neighbors,
        shape=shape,
        reach=margins.reach if neighbors == "lists" else 0.0,
        capacity=room_in_lists(contents, density, margins.reach) if neighbors == "lists" else 0,
        cell_capacity=room_in_cells(contents, neighbors, shape, margins.reach),
        epoch=epoch,
        width=width,
        heap=usual_heap(contents.n),
        horizon=horizon,
        step=0 if contents.reaches is None else 8,
        span=epoch if alone else 0.0,
    )


def _expected_rate(contents: Contents, speed: float) -> float:
    """Return the collisions of one component a time, where it is not known."""
    typical = contents.diameter if contents.radii is None else 2.0 * float(contents.radii.mean())
    if typical > 0.0:
        return collision_rate(contents.packing_fraction, contents.dimension, typical, speed)
    return 0.0


def _pairs(contents: Contents, speed: float) -> Scheme:
    """Return the scheme that looks at all pairs, one by one; ``speed`` as of :func:`choose`."""
    # Between walls along all axes nothing is met in an image, and no path is longer than about the box.
    edge = min(contents.box) if math.isinf(contents.narrowest) else contents.narrowest
    epoch = power_of_two(4.0 * edge / speed) if speed > 0.0 else 1.0
    horizon = math.inf
    if contents.rates is not None:  # nobody can outgrow this scheme
        horizon = 0.5 * edge / float(contents.rates.max())
    return Scheme(
        kind="pairs",
        shape=(1,) * contents.dimension,
        cell_capacity=0,
        reach=0.0,
        capacity=0,
        epoch=epoch,
        width=epoch / power_of_two(4.0 * contents.n),
        heap=256,
        horizon=short(horizon),
        span=short(0.25 * epoch),
    )


def dilute(dimension: int) -> float:
    """Return the packing fraction below which sectors run faster than lists."""
    return of_dimension(DILUTE, dimension)
