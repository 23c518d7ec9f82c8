"""Everything that a run consists of: built for a scene and its scheme, enlarged, saved and filled again."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.lanes import make_lanes
from carom.compiling.registry import is_ours
from carom.engine.calendar import Calendar, make_calendar, most_lines
from carom.engine.constants import POWERS, TALLY
from carom.engine.neighbors.all_pairs import AlongCurves, Everybody, Pairs
from carom.engine.neighbors.build import build_neighbors
from carom.engine.neighbors.lists import NeighborLists
from carom.engine.neighbors.plan import NeighborPlan
from carom.engine.neighbors.sectors import Sectors
from carom.engine.observers.build import make_observers
from carom.engine.observers.interface import NOBODY, kept_arrays
from carom.engine.obstacle_grid import with_grids
from carom.engine.obstacles import Crowd, is_live, make_obstacles
from carom.engine.one_body import make_timers, wall_timing
from carom.engine.search import FarSteps, FromCache, FromNow, FromRows, Timing
from carom.engine.state import State, aligned, make_state
from carom.engine.system import System
from carom.engine.tilted_lattice import in_lattice
from carom.models.interactions.units import Units
from carom.models.interfaces.memory import copied, copy_state
from carom.models.interfaces.motion import MotionModel
from carom.models.mathematics.contact import MOST_DIAMETERS

MOST_FLOWN = 8.0
"""Diameters that two may fly relative to each other from the moment from which their contact is computed: the
square of their distance is rounded, and the contact is off by some 32 roundings.
"""

SLIGHT = 2.0**-10
"""Diameters below which contacts are not computed from such a moment: the box leaves no room for it."""

ALIKE = 2.0**-4
"""Part of the smallest diameter that a distance of contact may be for this to hold for it, too: it is then
off by less than a scene tolerates. Where one is less, the flight is measured by that.
"""


class Model(NamedTuple):
    """What the basic functions are, by type, and their parameters, by value."""

    pair: Any
    lanes: Any  # room for what the search reads of candidates, or None
    motion: Any
    boundary: Any
    impact: Any  # what a contact of two components loses, or None where it is elastic
    obstacles: Any  # everything fixed that components can meet, or None
    timing: Any  # how the time of a contact is computed (``engine.search``)
    observers: Any  # what adds something up of the events (:mod:`carom.engine.observers`)
    rules: Any  # the pair model again, where units decide by rules, or None
    timers: Any
    """What kicks single components at times of its own (:mod:`carom.engine.one_body`), or None."""


PARTS = ("pair", "motion", "impact", "obstacles", "timers")
"""Parts of a model that may remember something, beside its observers."""


class Engine(NamedTuple):
    """Everything that a run consists of."""

    model: Model
    state: State
    neighbors: NeighborLists | Sectors | Everybody | Pairs
    calendar: Calendar
    tallies: Any


def make_model(system: System) -> Model:
    """Return the physics of a scene, without what a search needs and without observers."""
    particles = system.particles
    pair = system.interaction.model(particles)
    obstacles = make_obstacles(system.dimension, system.walls, system.obstacle_models)
    timers = None
    if system.scene.drive is not None:
        kicks = copied(system.scene.drive.model(particles))
        timers = make_timers(kicks, system.dimension, system.unit.exponent, system.scene.pinned)
    impact = system.impact.model(particles)
    if system.scene.spins is not None:
        impact.spins[:-1] = system.unit.to_kernel(system.scene.spins, -1)
    return Model(
        pair=pair,
        lanes=None,
        motion=system.motion.model(particles),
        boundary=None,
        impact=impact,
        obstacles=obstacles,
        timing=None,
        observers=NOBODY,
        rules=pair if isinstance(pair, Units) else None,
        timers=timers,
    )


def build(scheme: NeighborPlan, system: System, positions, velocities) -> Engine:
    """Return the arrays of a run at time zero, nothing scheduled yet."""
    number = np.float32 if system.single else np.float64
    model = make_model(system)
    state = make_state(in_lattice(model.motion, positions), velocities, scheme.epoch, system.images, number)
    pair = model.pair
    live = model.obstacles is not None and model.obstacles.live is not None
    changes = model.impact is not None or system.rates is not None or system.stepped or live
    lossy = changes or model.timers is not None
    neighbors, boundary = build_neighbors(scheme, system, pair, model.motion)
    timing = timing_of(scheme, system, neighbors, pair, model.motion)
    obstacles = model.obstacles
    if obstacles is not None:
        chain = with_grids(obstacles.chain, scheme, system, neighbors, pair)
        at_obstacles = wall_timing(timing, model.motion, obstacles.live)
        obstacles = obstacles._replace(chain=chain, timing=at_obstacles)
    return Engine(
        model._replace(
            lanes=make_lanes(pair),
            boundary=boundary,
            obstacles=obstacles,
            timing=timing,
            observers=make_observers(system, pair, velocities, lossy),
        ),
        state,
        neighbors,
        make_calendar(system.n, scheme.width, scheme.heap),
        np.zeros(1, TALLY).view(np.recarray),
    )


def timing_of(scheme: NeighborPlan, system: System, neighbors, pair, motion) -> Timing:
    """Return how the time of a contact is computed."""
    if scheme.kind == "all":
        return FromCache(neighbors.start_times)
    if scheme.kind == "pairs":
        return AlongCurves(scheme.span)
    if system.stepped:
        core = _smallest_core(system.interaction, pair, system)
        return FarSteps() if scheme.list_range > MOST_DIAMETERS * core else FromNow()
    # Half a box away, pairs would be taken for other images.
    growing = 1.0 if system.rates is None else 2.0
    free_space = 0.49 * system.narrowest / max(system.stretch) - growing * system.diameter
    size = system.smallest if system.smallest_contact >= ALIKE * system.smallest else system.smallest_contact
    ahead = min(MOST_FLOWN * size, free_space)
    as_found = is_ours(type(pair).contact_time.__module__)
    as_found &= type(motion).candidate_relative_to is MotionModel.candidate_relative_to
    return FromRows(ahead**2, as_found) if ahead >= SLIGHT * size else FromNow()


def _smallest_core(interaction: Any, pair, system: System) -> float:
    """Return the diameter of the smallest hard core, circles not counted; infinity without one."""
    count, _ = interaction.steps(system.particles)
    squares = [float(pair.step_core_square(step)) for step in range(count)]
    return math.sqrt(min((square for square in squares if square > 0.0), default=math.inf))


def bare_model(model):
    """Return a model without observers and contact law, which schedules do not ask: compiled once for all."""
    return Model(
        model.pair, model.lanes, model.motion, model.boundary, None, model.obstacles, model.timing, None,
        model.rules, model.timers,
    )  # fmt: skip


def stripped(engine: Engine) -> Engine:
    """Return the engine with its bare model."""
    return engine._replace(model=bare_model(engine.model))


def enlarge_neighbors(engine: Engine, scheme: NeighborPlan, system: System) -> Engine:
    """Return the engine with larger, empty arrays for its neighbor scheme; all must be scheduled anew."""
    neighbors, boundary = build_neighbors(scheme, system, engine.model.pair, engine.model.motion)
    return engine._replace(neighbors=neighbors, model=engine.model._replace(boundary=boundary))


def take_over(old: Engine, new: Engine, instant: Fraction, passed: float, slower: int) -> None:
    """Let an engine go on with what the one remembers whose place it takes (see ``copy_state``)."""
    new.tallies[:] = old.tallies
    for name, power in POWERS.items():
        new.tallies[name] = np.ldexp(old.tallies[name], -power * slower)
    observers = copied(old.model.observers)
    observers.at_rest(passed, 0.0)
    copy_state(new.model.observers, observers, instant, passed, slower)
    for part in PARTS:
        copy_state(getattr(new.model, part), getattr(old.model, part), instant, passed, slower)


def enlarge_heap(engine: Engine, capacity: int) -> Engine:
    """Return the engine with a larger heap and as many times more lines, up to all needed, contents kept."""
    calendar = engine.calendar
    event_time, component = np.zeros(capacity), np.zeros(capacity, np.int32)
    event_time[: len(calendar.event_time)], component[: len(calendar.component)] = (
        calendar.event_time,
        calendar.component,
    )
    width = calendar.lines.shape[1]
    count = min(
        len(calendar.lines) * capacity // len(calendar.event_time), most_lines(len(engine.state.partner))
    )
    lines = aligned(width * count, np.uint32).reshape(count, width)
    lines[: len(calendar.lines)] = calendar.lines
    return engine._replace(
        calendar=calendar._replace(event_time=event_time, component=component, lines=lines)
    )


def arrays(engine: Engine) -> dict[str, np.ndarray]:
    """Return every array by a dotted name, the fields of records apart: what a checkpoint holds."""
    found: dict[str, np.ndarray] = {}

    def gather(name, value):
        if isinstance(value, np.ndarray):
            if value.dtype.names:
                for field in value.dtype.names:
                    found[f"{name}.{field}"] = value[field]
            else:
                found[name] = value
        elif isinstance(value, Crowd):  # which does not change
            gather(f"{name}.tail", value.tail)
        elif hasattr(value, "_fields"):
            for field, part in zip(value._fields, value, strict=True):
                gather(f"{name}.{field}" if name else field, part)
        elif isinstance(value, tuple):
            for k, part in enumerate(value):
                if is_live(part):
                    gather(f"{name}.{k}", part)

    for part in ("state", "neighbors", "calendar", "tallies"):
        gather(part, getattr(engine, part))
    for part in PARTS:
        gather(f"model.{part}", getattr(engine.model, part))
    for observer, its in kept_arrays(engine.model.observers).items():
        found |= {f"observers.{observer}.{field}": array for field, array in its.items()}
    return found


def restore(engine: Engine, saved: dict[str, np.ndarray]) -> None:
    """Fill the arrays of a freshly built engine with those of a checkpoint."""
    mine = arrays(engine)
    for name, target in mine.items():
        source = saved.get(name)
        if source is None or source.shape != target.shape or source.dtype != target.dtype:
            raise ValueError(f"The checkpoint's array {name!r} does not fit this scene.")
        target[...] = source
    engine.calendar.control.full[0] = 1  # it is laid out from the times at which components are due
