"""Everything that a run consists of: built for a scene and its scheme, enlarged, saved and filled again."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.lanes import make_lanes
from carom.engine.balance import make_balance
from carom.engine.calendar import Calendar, make_calendar
from carom.engine.currents import make_currents
from carom.engine.flights import make_flights
from carom.engine.held import make_held
from carom.engine.images import NearestImage, SectorImage
from carom.engine.live import is_live, made_live
from carom.engine.neighbors.bounds import EqualBounds, GrowingBounds, UnequalBounds
from carom.engine.neighbors.choice import HAIR, Scheme
from carom.engine.neighbors.everybody import Everybody, make_everybody
from carom.engine.neighbors.grid import make_grid
from carom.engine.neighbors.levels import bounds_of, cells_around, levels_of, shape_of, spans_of, starts_of
from carom.engine.neighbors.lists import Lists, make_lists
from carom.engine.neighbors.pairs import AlongCurves, Pairs, make_pairs
from carom.engine.neighbors.sectors import Sectors, make_sectors
from carom.engine.obstacles import make_obstacles
from carom.engine.pair_steps import SteppedImage, make_steps
from carom.engine.requirements import Contents
from carom.engine.search import FarSteps, NearSight, RowSight
from carom.engine.state import State, make_state
from carom.engine.tallies import TALLY, BySpecies
from carom.models.contact import FAR
from carom.models.interface import step_core_square
from carom.models.pinned import PinnedCores
from carom.models.units import Units

SLACK = 1.0 - 2.0**-20
"""Flights end this fraction of the margin, or of the slack, early, so that rounding cannot hide a contact
behind the end of a list, or two sectors away.
"""


AHEAD = 8.0
"""Diameters that two may fly relative to each other from the moment from which their contact is computed: the
square of their distance is rounded, and the contact is off by some 32 roundings.
"""

SLIGHT = 2.0**-10
"""Diameters below which contacts are not computed from such a moment: the box leaves no room for it."""


class Model(NamedTuple):
    """What the basic functions are, by type, and their parameters, by value."""

    pair: Any
    lanes: Any
    """Room for what the search reads of candidates, or None."""
    motion: Any
    boundary: Any
    impact: Any
    """What a contact of two components loses, or None where it is elastic."""
    balance: Any
    """The energy and its integral over time, or None where no contact changes it."""
    obstacles: Any
    """Everything fixed that components can meet, or None."""
    sight: Any
    """How the time of a contact is computed; None: from the moment at which it is found."""
    currents: Any
    """Currents of momentum and heat, and their integrals over time, or None where nobody asks."""
    flights: Any
    """Histograms of free flights and normal speeds, or None where nobody asks."""
    rules: Any
    """The pair model again, where units decide by rules, or None."""


class Engine(NamedTuple):
    """Everything that a run consists of."""

    model: Model
    state: State
    neighbors: Lists | Sectors | Everybody | Pairs
    calendar: Calendar
    tallies: Any
    by_species: BySpecies | None


def build(scheme: Scheme, contents: Contents, positions, velocities) -> Engine:
    """Return the arrays of a run at time zero, nothing scheduled yet."""
    number = np.float32 if contents.single else np.float64
    state = make_state(positions, velocities, scheme.epoch, contents.images, number)
    particles = contents.particles
    pair, impact = contents.interaction.model(particles), contents.impact.model(particles)
    obstacles = made_live(
        make_obstacles(contents.dimension, contents.walls, contents.obstacle_models), contents.obstacle_models
    )
    live = obstacles is not None and obstacles.live is not None
    lossy = impact is not None or contents.rates is not None or contents.stepped or live
    changes = contents.straight and lossy
    neighbors, boundary = build_neighbors(scheme, contents, pair)
    by_species = None
    if contents.kinds is not None:
        count = int(contents.kinds.max()) + 1
        by_species = BySpecies(
            particles.with_ghost(contents.kinds, np.int64),
            np.zeros((count, count), np.int64),
            np.zeros((count, count)),
        )
    return Engine(
        Model(
            pair,
            make_lanes(pair),
            contents.motion.model(particles),
            boundary,
            impact,
            make_balance(particles.masses, velocities, contents.still) if changes else None,
            obstacles,
            _sight(scheme, contents, neighbors, pair),
            _currents(contents, particles, velocities, pair),
            _flights(contents, particles, pair),
            pair if isinstance(pair, Units) else None,
        ),
        state,
        neighbors,
        make_calendar(contents.n, scheme.width, scheme.heap),
        np.zeros(1, TALLY).view(np.recarray),
        by_species,
    )


def _currents(contents: Contents, particles, velocities, pair):
    """Return the currents, where they are asked for."""
    if not contents.currents:
        return None
    held = make_held(contents.n, contents.dimension, pair.energy) if contents.stepped else None
    return make_currents(particles.masses, velocities, _kinds(contents, particles), held)


def _flights(contents: Contents, particles, pair):
    """Return empty histograms of free flights, where they are asked for."""
    if not contents.flights:
        return None
    inverse = pair.inverse if isinstance(pair, PinnedCores) else None
    return make_flights(contents.n, _kinds(contents, particles), inverse)


def _kinds(contents: Contents, particles):
    """Return the species of each component and of the ghost, or None where there are none."""
    return None if contents.kinds is None else particles.with_ghost(contents.kinds, np.int64)


def _sight(
    scheme: Scheme, contents: Contents, neighbors, pair
) -> RowSight | FarSteps | NearSight | AlongCurves | None:
    """Return how the time of a contact is computed."""
    if scheme.kind == "all":
        return NearSight(neighbors.near)
    if scheme.kind == "pairs":
        return AlongCurves(scheme.span)
    if contents.stepped:
        core = _smallest_core(contents.interaction, pair, contents)
        return FarSteps() if scheme.reach > FAR * core else None
    # Half a box away, pairs would be taken for other images.
    growing = 1.0 if contents.rates is None else 2.0
    room = 0.49 * contents.narrowest - growing * contents.diameter
    ahead = min(AHEAD * contents.smallest, room)
    return RowSight(ahead**2) if ahead >= SLIGHT * contents.smallest else None


def _smallest_core(interaction: Any, pair, contents: Contents) -> float:
    """Return the diameter of the smallest hard core, which need not be a component's; infinity without one.

    Circles of units are no cores.
    """
    count, _ = interaction.steps(contents.particles)
    squares = [float(step_core_square(pair, step)) for step in range(count)]
    return math.sqrt(min((square for square in squares if square > 0.0), default=math.inf))


def build_neighbors(scheme: Scheme, contents: Contents, pair):
    """Return the empty neighbour scheme and the boundary that goes with it."""
    edges = tuple(float(edge) for edge in contents.box)
    # Along an axis with walls nothing is an image of anything: an inverse of zero rounds to no box at all.
    inverse = tuple(
        1.0 / edge if wraps else 0.0 for edge, wraps in zip(edges, contents.periodic, strict=True)
    )
    if scheme.kind == "lists":
        lists = _build_lists(scheme, contents, pair)
        if lists.steps is not None:
            return lists, SteppedImage(edges, inverse, lists.steps.bits)
        return lists, NearestImage(edges, inverse)
    if scheme.kind == "all":
        number = np.float32 if contents.single else np.float64
        everybody = make_everybody(contents.n, edges, contents.diameter, scheme.span, number)
        return everybody, NearestImage(edges, inverse)
    if scheme.kind == "pairs":
        return make_pairs(contents.n, scheme.span), NearestImage(edges, inverse)
    slacks = slacks_of(scheme, contents)
    spare = _spare(scheme, contents, slacks)
    sectors = make_sectors(contents.n, edges, scheme.shape, scheme.cell_capacity, slacks, spare)
    if _is_wide(scheme, contents):
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


def _is_wide(scheme: Scheme, contents: Contents) -> bool:
    """Tell whether two neighbouring sectors hold no two components half a box apart."""
    return all(size >= 4 or not wraps for size, wraps in zip(scheme.shape, contents.periodic, strict=True))


def slacks_of(scheme: Scheme, contents: Contents) -> list[float]:
    """Return how far a component may be beyond its sector along each axis [length].

    Two that touch are in neighbouring sectors as long as a sector is a diameter and two slacks wide.
    Components that grow need that room, and beyond a wall of the box there is nothing. Small ones have more
    (:func:`_spare`).
    """
    slacks = [0.0] * contents.dimension
    if _is_wide(scheme, contents) and contents.rates is None:
        for axis, (edge, size) in enumerate(zip(contents.box, scheme.shape, strict=True)):
            if contents.periodic[axis]:
                room = 0.5 * (edge / size - contents.diameter * (1.0 + HAIR))
                # The images of neighbours must be told apart as before.
                slacks[axis] = max(SLACK * min(room, 0.25 * edge - edge / size), 0.0)
    return slacks


def _spare(scheme: Scheme, contents: Contents, slacks: list[float]) -> np.ndarray | None:
    """Return how much more slack each component has than the largest, (n + 1,) [length], or None where all
    have the same: by as much as its radius is smaller.
    """
    radii = contents.radii
    if not contents.by_radii or radii is None or contents.contact is not None or contents.rates is not None:
        return None
    rooms = [
        0.25 * edge - edge / size - slack
        for edge, size, slack in zip(contents.box, scheme.shape, slacks, strict=True)
        if slack > 0.0
    ]
    spare = np.minimum(0.5 * contents.diameter - radii, min(rooms, default=0.0))
    return contents.particles.with_ghost(SLACK * spare, np.float32)


def _build_lists(scheme: Scheme, contents: Contents, pair) -> Lists:
    """Return empty lists."""
    n, dimension = contents.n, contents.dimension
    sizes = contents.reaches
    # Reference points beyond a wall are no neighbours: a stretched axis keeps its two ends apart.
    spans = spans_of(contents, scheme.reach)
    if sizes is None:
        margin = 0.5 * (scheme.reach - contents.diameter)
        bounds: Any = EqualBounds(scheme.reach**2, margin * SLACK, scheme.capacity)
        longest, words = scheme.capacity, n * scheme.capacity
        shapes = [shape_of(spans, scheme.reach)]
        around = [[[1] * dimension]]
    else:
        bound = bounds_of(contents, scheme.reach)
        levels = levels_of(contents, scheme.reach)
        shapes = levels.shapes
        around = cells_around(levels, spans)
        starts = starts_of(bound, contents, scheme.capacity)
        longest, words = int(np.diff(starts).max()), int(starts[-1])
        ghostly = contents.particles.with_ghost(bound)
        marks = contents.particles.with_ghost(levels.levels, np.uint8)
        largest = np.array(levels.reaches)
        if contents.rates is not None:
            bounds = GrowingBounds(
                ghostly, pair.radii, pair.rates, starts, marks, len(shapes), largest, SLACK
            )
        else:
            margins = contents.particles.with_ghost(bound - sizes) * SLACK
            bounds = UnequalBounds(ghostly, margins, starts, marks, len(shapes), largest)
    steps = make_steps(contents.interaction, contents.particles)
    grid = make_grid(shapes, around)
    return make_lists(n, spans, bounds, grid, scheme.cell_capacity, words, longest, steps)


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
    if hasattr(old.model.pair, "impulse"):  # what pinned components took up
        new.model.pair.impulse[:] = np.ldexp(old.model.pair.impulse, slower)
    if old.model.balance is not None:
        new.model.balance.action[:] = np.ldexp(old.model.balance.action, slower)
    if isinstance(old.model.boundary, SteppedImage):
        new.model.pair.events[:] = old.model.pair.events
    for counted, before in zip(new.model.impact or (), old.model.impact or (), strict=True):
        if isinstance(counted, np.ndarray):  # what a contact law counts
            counted[:] = before
    if old.model.obstacles is not None:
        new.model.obstacles.hits[:] = old.model.obstacles.hits
        new.model.obstacles.impulse[:] = np.ldexp(old.model.obstacles.impulse, slower)


def enlarge_heap(engine: Engine, room: int) -> Engine:
    """Return the engine with a heap for so many entries, those that it has kept."""
    calendar = engine.calendar
    due, who = np.zeros(room), np.zeros(room, np.int32)
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
        elif isinstance(value, tuple):
            for k, part in enumerate(value):
                if is_live(part):
                    collect(f"{name}.{k}", part)

    for part in ("state", "neighbors", "calendar", "tallies", "by_species"):
        collect(part, getattr(engine, part))
    for part in ("pair", "impact", "balance", "obstacles", "currents", "flights"):
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
        if name == "calendar.buckets" and source is not None and len(source) == len(target) - 1:
            # Written when there was no bucket yet for what is due beyond the window.
            source = np.concatenate([source, target[-1:]])
        if source is None or source.shape != target.shape or source.dtype != target.dtype:
            raise ValueError(f"The checkpoint's array {name!r} does not fit this scene.")
        target[...] = source
