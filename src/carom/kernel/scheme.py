"""Which neighbour scheme a scene gets, and how large its arrays are: a rule that was measured
(docs/performance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from carom.kernel.boundary import NearestImage, SectorImage
from carom.kernel.calendar import Calendar, make_calendar
from carom.kernel.cycle import Model
from carom.kernel.lists import (
    EqualBounds,
    GrowingBounds,
    Lists,
    UnequalBounds,
    coordinate_bits,
    make_grid,
    make_lists,
)
from carom.kernel.motion import FreeFlight
from carom.kernel.obstacle import make_obstacles
from carom.kernel.pair import EqualCores, GrowingCores, Inelastic, SpeciesCores, UnequalCores
from carom.kernel.sectors import Sectors, make_sectors
from carom.kernel.sight import FAR, FarSight
from carom.kernel.state import State, make_state
from carom.kernel.tally import TALLY, BySpecies

DENSEST = (1.0, 0.9069, 0.7405, 0.6169, 0.4653, 0.3729, 0.2953, 0.2537)
"""Densest known packing fractions in d = 1 to 8."""

SLACK = 1.0 - 2.0**-20
"""Flights end this fraction of the margin early, so that rounding cannot hide a contact behind the end of a
list.
"""


@dataclass(frozen=True)
class Contents:
    """What the kernel has to know of a scene, in its own unit of time (:mod:`carom.units`).

    Attributes
    ----------
    n : int
        Components.
    box : tuple of d floats
        Edges [length].
    periodic : tuple of d bools
        Which axes are periodic; the others have walls.
    diameter : float
        The largest distance of contact between two components, now [length].
    mass : float
        The common mass, where there is one.
    radii, masses : (n,) float64 arrays, optional
        Of each component, where they differ or grow.
    kinds : (n,) int64 array, optional
        Species of each component, 0 to K - 1.
    contact : (K, K) float64 array, optional
        Distances of contact between species, where they are not the sums of the radii.
    rates : (n,) float64 array, optional
        Radius gained a time.
    obstacles : tuple of NamedTuples
        Kernel models of the obstacles.
    restitution, threshold : float
        Normal speed after over before a contact, and the speed below which a contact is elastic.
    images : bool
        Whether to count the boxes that each component crosses.
    single : bool
        Whether positions, velocities and times are kept in single precision.
    """

    n: int
    box: tuple[float, ...]
    periodic: tuple[bool, ...]
    diameter: float
    mass: float
    radii: np.ndarray | None = None
    masses: np.ndarray | None = None
    kinds: np.ndarray | None = None
    contact: np.ndarray | None = None
    rates: np.ndarray | None = None
    obstacles: tuple = field(default=())
    restitution: float = 1.0
    threshold: float = 0.0
    images: bool = True
    single: bool = False

    @property
    def dimension(self) -> int:
        """Number of dimensions."""
        return len(self.box)

    @property
    def packing_fraction(self) -> float:
        """Part of the box that is filled."""
        powers = self.n * self.diameter**self.dimension
        if self.radii is not None:
            powers = float(np.sum((2.0 * self.radii) ** self.dimension))
        return powers * _ball(self.dimension) / 2.0**self.dimension / math.prod(self.box)

    @property
    def reaches(self) -> np.ndarray | None:
        """Radii whose sums are no smaller than any distance of contact, (n,), or None where all are equal."""
        if self.radii is None or self.contact is None or self.kinds is None:
            return self.radii
        sums = np.zeros_like(self.contact)
        core = np.zeros(len(self.contact))
        core[self.kinds] = self.radii
        sums = core[:, None] + core[None, :]
        return self.radii * max(1.0, float((self.contact / sums).max()))

    @property
    def paces(self) -> np.ndarray:
        """Square roots of thermal speeds in units of their mean, (n,): how margins are shared out.

        A light component uses up its margin sooner, in proportion to ``v / margin``; of all margins that add
        up to the same, these are used up most seldom.
        """
        if self.masses is None:
            return np.ones(self.n)
        paces = (self.masses / self.masses.mean()) ** -0.25
        return np.clip(paces / paces.mean(), 1.0 / 8.0, 8.0)

    @property
    def narrowest(self) -> float:
        """The shortest edge along which images are met [length]; infinite if there is none."""
        edges = [edge for edge, wraps in zip(self.box, self.periodic, strict=True) if wraps]
        return min(edges, default=math.inf)


def _ball(dimension: int) -> float:
    """Return the volume of a ball of radius one."""
    return math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1)


@dataclass(frozen=True)
class Scheme:
    """The choices that change speed and memory, never the physics.

    Attributes
    ----------
    kind : {"lists", "sectors"}
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
    step: int = 8
    """By how much the room in lists grows at least when one is full, twice that the next time; 0 where all
    lists have the room of the longest, which then grows by a sixteenth.
    """

    def with_larger_neighbors(self, full_cell: bool) -> Scheme:
        """Return the scheme with more room in cells, or in lists."""
        if full_cell:
            return replace(self, cell_capacity=self.cell_capacity + (8 if self.kind == "sectors" else 2))
        growth = max(self.step, self.capacity // 16, 1)
        return replace(self, capacity=self.capacity + growth, step=2 * self.step)

    def with_larger_heap(self) -> Scheme:
        """Return the scheme with more room in the calendar's heap."""
        return replace(self, heap=2 * self.heap)


class Engine(NamedTuple):
    """Everything that a run consists of."""

    model: Model
    state: State
    neighbors: Lists | Sectors
    calendar: Calendar
    tallies: Any
    by_species: BySpecies | None


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

DILUTE = (0.01, 0.57, 0.42, 0.18, 0.07, 0.03)
"""Packing fraction in d = 1 to 6 below which sectors run faster than lists."""

MANY, MANY_DILUTE = 100_000, 0.57
"""Components from which on they do so only below this part of it: far from the caches it counts how many
lines of memory a search touches, and lists touch fewer (docs/performance).
"""

FEWER = 5.0 / 6.0
"""Part of their usual length that lists have where fewer components would have sectors: as fast, smaller."""

SECTOR = 0.88
"""Side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/performance)."""

SMALLEST_MARGIN = 0.05
"""Twice the margin of lists of components that differ or grow, at least, in median diameters; else sectors
are better.
"""

SMALLEST_GROWTH = 2.0**-30
"""Part of their diameter by which components must be able to grow before they are as wide as the box."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""

FINEST = 16.0
"""Steps of a reference point in a margin, at least: a flight is cut short by about one of them."""

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
    thin = packing_fraction < _of(DILUTE, dimension)
    listed = _of(NEIGHBORS, dimension) * (FEWER if thin else 1.0) + 1
    return max((listed / packing_fraction) ** (1.0 / dimension) / 2.0, SHORTEST)


def choose(
    contents: Contents,
    speed: float,
    neighbors: str = "auto",
    shell: float | None = None,
    rate: float | None = None,
) -> Scheme:
    """Choose the scheme for a scene; a shell asked for means lists where they fit.

    Parameters
    ----------
    contents : Contents
        The scene.
    speed : float
        Root mean square speed [length / time].
    neighbors : {"auto", "lists", "sectors"}
        The scheme, if the user has a wish.
    shell : float, optional
        Reach of the lists in (largest) diameters.
    rate : float, optional
        Collisions of one component a time, where it is known.

    Raises
    ------
    ValueError
        If lists are asked for in a box too small for them.
    """
    box, diameter, dimension = contents.box, contents.diameter, contents.dimension
    packing_fraction = contents.packing_fraction
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
    grain = max(_spans(contents, reach)) * 2.0 ** -coordinate_bits(dimension)
    thinnest = 0.5 * (reach - diameter) * (1.0 if contents.radii is None else float(contents.paces.min()))
    coarse = FINEST * grain > thinnest
    if neighbors == "lists" and coarse and least < reach <= widest:
        raise ValueError(
            f"Neighbour lists keep places to {grain:g} in a box of this length, too coarse for margins of "
            f"{thinnest:g}; use neighbors='sectors', or a larger shell."
        )
    if neighbors == "lists" and (reach > widest or reach <= least):
        needed = 2.0 * (core + 2.0 * pace * (max(reach, least) - diameter))
        raise ValueError(
            f"Neighbour lists with a reach of {reach:g} need box edges of at least {needed:g}, "
            f"the shortest is {contents.narrowest:g}; use neighbors='sectors', or a smaller shell."
        )
    density = contents.n / math.prod(box)
    spacing = density ** (-1.0 / dimension)
    if neighbors == "auto":
        fits = least < reach <= widest and not coarse
        dense = packing_fraction > dilute(contents) or (diameter / spacing) ** dimension > CROWDED
        neighbors = "lists" if fits and (dense or shell is not None) else "sectors"
    sizes = contents.reaches
    margin = 0.5 * (reach - diameter)
    horizon = math.inf
    if neighbors == "lists":
        side = reach
        if contents.rates is not None:
            # Until somebody has grown over half of its margin.
            horizon = 0.5 * margin / float((contents.rates / contents.paces).max())
    else:
        # A sector must be no smaller than a diameter; a relative hair more absorbs the rounding of its walls.
        sight = max(WIDEST * _smallest(contents), max(box) / MOST_SECTORS ** (1.0 / dimension))
        side = max(diameter * (1.0 + 2.0**-40), min(SECTOR * spacing, max(box), sight))
        if contents.rates is not None:
            side = max(side, 1.05 * diameter)
    shape = tuple(max(int(edge / side), 1) for edge in box)
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
        members = _levels(contents, reach).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    typical = diameter if contents.radii is None else 2.0 * float(contents.radii.mean())
    if rate is None:
        rate = collision_rate(packing_fraction, dimension, typical, speed) if typical > 0.0 else 0.0
    epoch = 1.0
    if speed > 0.0:
        crossing = 4.0 * max(box) / speed
        epoch = _power_of_two(min(16.0 / rate, crossing) if rate > 0.0 else crossing)
    width = epoch
    if speed > 0.0 and rate > 0.0:
        width = min(_power_of_two(4.0 / (contents.n * rate)), epoch)
    capacity = 0
    if neighbors == "sectors":
        reach = 0.0
    elif sizes is None:
        listed = density * _ball(dimension) * reach**dimension
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
        heap=max(256, contents.n // 16),
        horizon=_short(horizon),
        step=0 if sizes is None else 8,
    )


def dilute(contents: Contents) -> float:
    """Return the packing fraction below which sectors run faster than lists."""
    return _of(DILUTE, contents.dimension) * (MANY_DILUTE if contents.n >= MANY else 1.0)


def _default_reach(contents: Contents) -> float:
    """Return the reach at which lists are as long as they should be, on the average."""
    sizes = contents.reaches
    if sizes is None:
        return contents.diameter * default_shell(contents.packing_fraction, contents.dimension)
    dimension = contents.dimension
    wanted = _of(NEIGHBORS, dimension) + 1
    density = _ball(dimension) / math.prod(contents.box)
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


def build(scheme: Scheme, contents: Contents, positions, velocities) -> Engine:
    """Return the arrays of a run at time zero, nothing scheduled yet."""
    n = contents.n
    number = np.float32 if contents.single else np.float64
    state = make_state(positions, velocities, scheme.epoch, contents.images, number)
    pair = _cores(contents)
    neighbors, boundary = build_neighbors(scheme, contents, pair)
    inelastic = contents.restitution < 1.0
    by_species = None
    if contents.kinds is not None:
        count = int(contents.kinds.max()) + 1
        by_species = BySpecies(
            _with_ghost(contents.kinds, np.int64),
            np.zeros((count, count), np.int64),
            np.zeros((count, count)),
        )
    return Engine(
        Model(
            pair,
            FreeFlight(),
            boundary,
            Inelastic(float(contents.restitution), float(contents.threshold), np.zeros(1, np.int64))
            if inelastic
            else None,
            make_obstacles(contents.box, [not wraps for wraps in contents.periodic], contents.obstacles),
            FarSight() if _farthest(scheme, contents) > FAR else None,
        ),
        state,
        neighbors,
        make_calendar(n, scheme.width, scheme.heap),
        np.zeros(1, TALLY).view(np.recarray),
        by_species,
    )


def _farthest(scheme: Scheme, contents: Contents) -> float:
    """Return from how many contact distances a contact may be found."""
    if scheme.kind == "lists":
        return scheme.reach / _smallest(contents)
    sides = [edge / cells for edge, cells in zip(contents.box, scheme.shape, strict=True)]
    return 2.0 * math.hypot(*sides) / _smallest(contents)


def _smallest(contents: Contents) -> float:
    """Return the smallest diameter."""
    return contents.diameter if contents.radii is None else 2.0 * float(contents.radii.min())


def _with_ghost(values, dtype=np.float64) -> np.ndarray:
    """Return an array with one item more, which is like the first."""
    return np.concatenate([values, values[:1]]).astype(dtype)


def _cores(contents: Contents):
    """Return the pair interaction."""
    if contents.radii is None:
        return EqualCores(float(contents.diameter) ** 2, 0.5 * float(contents.diameter), float(contents.mass))
    masses = contents.masses if contents.masses is not None else np.full(contents.n, contents.mass)
    radii, masses = _with_ghost(contents.radii), _with_ghost(masses)
    if contents.rates is not None:
        return GrowingCores(radii, _with_ghost(contents.rates), masses)
    if contents.contact is not None:
        kinds = _with_ghost(contents.kinds, np.int64)
        squares = np.ascontiguousarray(contents.contact, np.float64).ravel() ** 2
        return SpeciesCores(kinds, squares, len(contents.contact), radii, masses)
    return UnequalCores(radii, masses)


def build_neighbors(scheme: Scheme, contents: Contents, pair):
    """Return the empty neighbour scheme and the boundary that goes with it."""
    edges = tuple(float(edge) for edge in contents.box)
    # Along an axis with walls nothing is an image of anything: an inverse of zero rounds to no box at all.
    inverse = tuple(
        1.0 / edge if wraps else 0.0 for edge, wraps in zip(edges, contents.periodic, strict=True)
    )
    if scheme.kind == "lists":
        return _build_lists(scheme, contents, pair), NearestImage(edges, inverse)
    sectors = make_sectors(contents.n, edges, scheme.shape, scheme.cell_capacity)
    # Two neighbouring sectors of four or more along an edge hold no two components half a box apart.
    if all(size >= 4 or not wraps for size, wraps in zip(scheme.shape, contents.periodic, strict=True)):
        return sectors, NearestImage(edges, inverse)
    return sectors, SectorImage(
        # What is seen through a wall is so far away that a wall is met before it.
        tuple(edge if wraps else 4.0 * edge for edge, wraps in zip(edges, contents.periodic, strict=True)),
        inverse,
        sectors.shape,
        sectors.place,
        sectors.turn,
        sectors.digits,
        (len(sectors.digits) - 1).bit_length(),
    )


def _build_lists(scheme: Scheme, contents: Contents, pair) -> Lists:
    """Return empty lists."""
    n, dimension = contents.n, contents.dimension
    sizes = contents.reaches
    # Reference points beyond a wall are no neighbours: a stretched axis keeps its two ends apart.
    spans = _spans(contents, scheme.reach)
    if sizes is None:
        margin = 0.5 * (scheme.reach - contents.diameter)
        bounds: Any = EqualBounds(scheme.reach**2, margin * SLACK, scheme.capacity)
        longest, words = scheme.capacity, n * scheme.capacity
        shapes = [_shape(spans, scheme.reach)]
        around = [[[1] * dimension]]
    else:
        bound = _bounds(contents, scheme.reach)
        levels = _levels(contents, scheme.reach)
        shapes = levels.shapes
        around = _around(levels, spans)
        starts = _starts(bound, contents, scheme.capacity)
        longest, words = int(np.diff(starts).max()), int(starts[-1])
        ghostly = _with_ghost(bound)
        marks = _with_ghost(levels.levels, np.uint8)
        largest = np.array(levels.reaches)
        if contents.rates is not None:
            bounds = GrowingBounds(
                ghostly, pair.radii, pair.rates, starts, marks, len(shapes), largest, SLACK
            )
        else:
            margins = _with_ghost(bound - sizes) * SLACK
            bounds = UnequalBounds(ghostly, margins, starts, marks, len(shapes), largest)
    return make_lists(n, spans, bounds, make_grid(shapes, around), scheme.cell_capacity, words, longest)


class Levels(NamedTuple):
    """Components by size: a factor of two a level."""

    levels: np.ndarray
    """Level of each component, (n,) int."""
    reaches: list
    """The largest bound in each."""
    shapes: list
    """Cells of each along each axis."""
    members: float
    """Components in a cell, in the fullest level."""


def _spans(contents: Contents, reach: float) -> list[float]:
    """Return the lengths that reference points are fractions of."""
    return [
        edge if wraps else edge + reach for edge, wraps in zip(contents.box, contents.periodic, strict=True)
    ]


def _shape(spans, side: float) -> tuple[int, ...]:
    """Return how many cells, no narrower than ``side``, fit along each axis."""
    return tuple(max(int(span / side), 1) for span in spans)


def _bounds(contents: Contents, reach: float) -> np.ndarray:
    """Return the radii of the bounds, (n,): sizes and margins."""
    assert contents.reaches is not None
    return contents.reaches + 0.5 * (reach - contents.diameter) * contents.paces


def _levels(contents: Contents, reach: float) -> Levels:
    """Sort components of several sizes into levels."""
    bound = _bounds(contents, reach)
    octaves, levels = np.unique(np.floor(np.log2(bound.max() / bound)), return_inverse=True)
    reaches = [float(bound[levels == k].max()) for k in range(len(octaves))]
    shapes = [_shape(_spans(contents, reach), 2.0 * each) for each in reaches]
    members = [np.count_nonzero(levels == k) / math.prod(shapes[k]) for k in range(len(octaves))]
    return Levels(levels, reaches, shapes, max(members))


def _around(levels: Levels, spans) -> list:
    """Return how many cells to look to either side: for one of a level, in the grid of another, by axis."""
    # A hair more than the sum of two bounds, so that rounding does not lose a cell.
    hair = 1.0 + 2.0**-30
    return [
        [
            [math.ceil((own + other) * hair * size / span) for span, size in zip(spans, shape, strict=True)]
            for other, shape in zip(levels.reaches, levels.shapes, strict=True)
        ]
        for own in levels.reaches
    ]


def _starts(bound: np.ndarray, contents: Contents, spare: int) -> np.ndarray:
    """Return where the lists begin, each with room for the neighbours expected, and ``spare`` more."""
    dimension = contents.dimension
    radii, inverse, numbers = np.unique(bound, return_inverse=True, return_counts=True)
    if len(radii) > 64:
        edges = np.quantile(bound, np.arange(1, 65) / 64.0)
        inverse = np.minimum(np.searchsorted(edges, bound), 63)
        radii, numbers = edges, np.bincount(inverse, minlength=64)
    density = _ball(dimension) / math.prod(contents.box)
    listed = density * ((radii[:, None] + radii[None, :]) ** dimension) @ numbers
    rooms = np.ceil(listed + 2.0 * np.sqrt(listed)).astype(np.int64) + spare
    rooms = np.minimum(rooms, max(contents.n - 1, 1))
    return np.concatenate([[0], np.cumsum(rooms[inverse])]).astype(np.int64)


def enlarge_neighbors(engine: Engine, scheme: Scheme, contents: Contents) -> Engine:
    """Return the engine with empty, larger arrays for its neighbour scheme; everything must be scheduled
    anew.
    """
    neighbors, boundary = build_neighbors(scheme, contents, engine.model.pair)
    return engine._replace(neighbors=neighbors, model=engine.model._replace(boundary=boundary))


def keep_tallies(old: Engine, new: Engine, slower: int) -> None:
    """Copy what has been counted so far into an engine that takes the place of another, and whose unit of
    time is longer by ``2**slower``.
    """
    new.tallies[:] = old.tallies
    new.tallies["virial"] = np.ldexp(old.tallies["virial"], slower)
    if old.by_species is not None and new.by_species is not None:
        new.by_species.collisions[:] = old.by_species.collisions
        new.by_species.virial[:] = np.ldexp(old.by_species.virial, slower)
    if old.model.impact is not None:
        new.model.impact.spared[:] = old.model.impact.spared
    if old.model.obstacles is not None:
        new.model.obstacles.hits[:] = old.model.obstacles.hits
        new.model.obstacles.impulse[:] = np.ldexp(old.model.obstacles.impulse, slower)


def enlarge_heap(engine: Engine, scheme: Scheme) -> Engine:
    """Return the engine with a larger heap, its entries kept."""
    calendar = engine.calendar
    due, who = np.zeros(scheme.heap), np.zeros(scheme.heap, np.int32)
    due[: len(calendar.due)], who[: len(calendar.who)] = calendar.due, calendar.who
    return engine._replace(calendar=calendar._replace(due=due, who=who))


def arrays(engine: Engine) -> dict[str, np.ndarray]:
    """Return every array of the engine by a dotted name, the fields of records apart: what a checkpoint
    holds.
    """
    found: dict[str, np.ndarray] = {}

    def collect(name, value):
        if isinstance(value, np.ndarray):
            if value.dtype.names:
                for field in value.dtype.names:
                    found[f"{name}.{field}"] = value[field]
            else:
                found[name] = value
        elif hasattr(value, "_fields"):
            for field, part in zip(value._fields, value, strict=True):
                collect(f"{name}.{field}" if name else field, part)

    for part in ("state", "neighbors", "calendar", "tallies", "by_species"):
        collect(part, getattr(engine, part))
    for part in ("pair", "impact", "obstacles"):
        collect(f"model.{part}", getattr(engine.model, part))
    return found


def restore(engine: Engine, saved: dict[str, np.ndarray]) -> None:
    """Fill the arrays of a freshly built engine with those of a checkpoint.

    Raises
    ------
    ValueError
        If an array is missing or has another shape or type.
    """
    mine = arrays(engine)
    for name, target in mine.items():
        source = saved.get(name)
        if source is None or source.shape != target.shape or source.dtype != target.dtype:
            raise ValueError(f"The checkpoint's array {name!r} does not fit this scene.")
        target[...] = source
