"""Which neighbour scheme a scene gets, and how large its arrays are: a rule that was measured
(docs/performance).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from carom.kernel.boundary import NearestImage, SectorImage
from carom.kernel.calendar import Calendar, make_calendar
from carom.kernel.cycle import Model
from carom.kernel.lists import Lists, make_lists
from carom.kernel.motion import FreeFlight
from carom.kernel.pair import EqualCores
from carom.kernel.sectors import Sectors, make_sectors
from carom.kernel.state import State, make_state
from carom.kernel.tally import TALLY

DENSEST = (1.0, 0.9069, 0.7405, 0.6169, 0.4653, 0.3729, 0.2953, 0.2537)
"""Densest known packing fractions in d = 1 to 8."""

SLACK = 1.0 - 2.0**-20
"""Flights end this fraction of the margin early, so that rounding cannot hide a contact behind the end of a
list.
"""


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
        Distance of reference points up to which components are listed [length]; 0 for sectors.
    capacity : int
        Neighbours a list can hold; grown when a list is full; 0 for sectors.
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

    def with_larger_neighbors(self) -> Scheme:
        """Return the scheme with more room in cells and lists."""
        more = self.capacity + 8 if self.capacity else 0
        return replace(self, cell_capacity=self.cell_capacity + 8, capacity=more)

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


def _power_of_two(x: float) -> float:
    return 2.0 ** math.floor(math.log2(x))


def collision_rate(packing_fraction: float, dimension: int, diameter: float, speed: float) -> float:
    """Return a rough collision rate of one component [1 / time]: the exact law for it, with a pressure that
    is right at both ends.

    The law is ``2 d (Z - 1) sqrt(kT / m) / (sqrt(pi) sigma)``; ``Z - 1`` is taken as ``2^(d-1) eta / (1 - eta
    / eta_max)``.
    """
    room = max(1.0 - packing_fraction / _of(DENSEST, dimension), 2.0**-40)
    excess = 2.0 ** (dimension - 1) * packing_fraction / room
    return 2.0 * math.sqrt(dimension / math.pi) * excess * speed / diameter


NEIGHBORS = (5, 10, 15, 26, 40, 60)
"""Length of the lists that ran fastest in d = 1 to 6 (docs/performance shows the scan; flat within 20 %)."""

DILUTE = (0.4, 0.3, 0.23, 0.12, 0.06, 0.03)
"""Packing fraction in d = 1 to 6 below which sectors run faster than lists."""

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
    n: int,
    box: tuple[float, ...],
    diameter: float,
    packing_fraction: float,
    speed: float,
    neighbors: str = "auto",
    shell: float | None = None,
) -> Scheme:
    """Choose the scheme for a scene; a shell asked for means lists where they fit.

    Parameters
    ----------
    n, box, diameter, packing_fraction
        The scene.
    speed : float
        Root mean square speed [length / time].
    neighbors : {"auto", "lists", "sectors"}
        The scheme, if the user has a wish.
    shell : float, optional
        Reach of the lists in diameters.

    Raises
    ------
    ValueError
        If lists are asked for in a box too small for them.
    """
    dimension = len(box)
    # Lists need three cells along every edge, and neighbours that stay the nearest image while both move by
    # the margin.
    widest = min(min(box) / 3.0, (min(box) + 2.0 * diameter) / 4.0)
    reach = diameter * (default_shell(packing_fraction, dimension) if shell is None else shell)
    if shell is None:
        reach = max(min(reach, widest), SHORTEST * diameter)
    if neighbors == "lists" and reach > widest:
        raise ValueError(
            f"Neighbour lists with a reach of {reach:g} need box edges of at least "
            f"{max(3.0 * reach, 4.0 * reach - 2.0 * diameter):g}, the shortest is {min(box):g}; "
            "use neighbors='sectors', or a smaller shell."
        )
    density = n / math.prod(box)
    if neighbors == "auto":
        fit = reach <= widest and packing_fraction > _of(DILUTE, dimension)
        neighbors = "lists" if fit or (reach <= widest and shell is not None) else "sectors"
    spacing = density ** (-1.0 / dimension)
    # A sector must be no smaller than a diameter; a relative hair more absorbs the rounding of its walls.
    side = reach if neighbors == "lists" else max(diameter * (1.0 + 2.0**-40), min(1.2 * spacing, max(box)))
    shape = tuple(max(int(edge / side), 1) for edge in box)
    members = n / math.prod(shape)
    rate = collision_rate(packing_fraction, dimension, diameter, speed)
    epoch = _power_of_two(min(16.0 / rate, 4.0 * max(box) / speed)) if speed > 0.0 else 1.0
    width = min(_power_of_two(4.0 / (n * rate)) if speed > 0.0 else 1.0, epoch)
    capacity = 0
    if neighbors == "lists":
        listed = density * math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1) * reach**dimension
        capacity = -(-int(listed + 2.0 * math.sqrt(listed) + 1.0) // 8) * 8
    else:
        reach = 0.0
    return Scheme(
        kind=neighbors,
        shape=shape,
        cell_capacity=-(-int(members + 2.0 * math.sqrt(members) + 1.0) // 8) * 8,
        reach=reach,
        capacity=capacity,
        epoch=epoch,
        width=width,
        heap=max(256, n // 16),
    )


def build(scheme: Scheme, positions, velocities, box, diameter: float, mass: float, images: bool) -> Engine:
    """Return the arrays of a run at time zero, nothing scheduled yet."""
    state = make_state(positions, velocities, scheme.epoch, images)
    neighbors, boundary = build_neighbors(scheme, len(positions), box, diameter)
    return Engine(
        Model(EqualCores(float(diameter) ** 2, float(mass)), FreeFlight(), boundary),
        state,
        neighbors,
        make_calendar(len(positions), scheme.width, scheme.heap),
        np.zeros(1, TALLY).view(np.recarray),
    )


def build_neighbors(scheme: Scheme, n: int, box, diameter: float):
    """Return the empty neighbour scheme and the boundary that goes with it."""
    edges = tuple(float(edge) for edge in box)
    inverse = tuple(1.0 / edge for edge in edges)
    if scheme.kind == "lists":
        margin = 0.5 * (scheme.reach - diameter) * SLACK
        lists = make_lists(
            n, edges, scheme.shape, scheme.cell_capacity, scheme.reach, margin, scheme.capacity
        )
        return lists, NearestImage(edges, inverse)
    sectors = make_sectors(n, edges, scheme.shape, scheme.cell_capacity)
    # Two neighbouring sectors of four or more along an edge hold no two components half a box apart.
    if min(scheme.shape) >= 4:
        return sectors, NearestImage(edges, inverse)
    cells = sectors.cells
    return sectors, SectorImage(
        edges,
        inverse,
        cells.shape,
        sectors.place,
        sectors.turn,
        cells.digits,
        (len(cells.digits) - 1).bit_length(),
    )


def enlarge_neighbors(engine: Engine, scheme: Scheme, box, diameter: float) -> Engine:
    """Return the engine with empty, larger arrays for its neighbour scheme; everything must be scheduled
    anew.
    """
    neighbors, boundary = build_neighbors(scheme, len(engine.state.partner), box, diameter)
    return engine._replace(neighbors=neighbors, model=engine.model._replace(boundary=boundary))


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

    for part in ("state", "neighbors", "calendar", "tallies"):
        collect(part, getattr(engine, part))
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
