"""Copies of an engine, each for one part of the box."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling import registry
from carom.compiling.lanes import make_lanes
from carom.engine.calendar import make_calendar
from carom.engine.images import NearestImage
from carom.engine.neighbors.bounds import GrowingBounds
from carom.engine.neighbors.lists import Lists
from carom.engine.neighbors.sectors import Sectors
from carom.engine.parts import Engine
from carom.engine.search import RowSight
from carom.engine.state import aligned
from carom.engine.tallies import TALLY
from carom.engine.windows.hooks import Gathered, Page, Watched
from carom.engine.windows.shares import OWN, Share
from carom.models.free_flight import Inertial
from carom.models.interface import age, begin, complaint, growth, take_over, taken_up

MEMORY = (age, begin, complaint, growth, take_over, taken_up)
"""Questions that only a pair model answers whose arrays change during a run."""


def obstacle_to_windows(engine: Engine) -> str | None:
    """Return what keeps an engine from running in windows, in words, or None."""
    model, neighbors = engine.model, engine.neighbors
    bounds = getattr(neighbors, "bounds", None)
    if not isinstance(neighbors, Lists | Sectors):
        return "its few or thinly spread components"
    if not isinstance(model.boundary, NearestImage) or not isinstance(model.sight, RowSight):
        return "its small box, or its steps of pairs"
    if isinstance(bounds, GrowingBounds) or hasattr(model.pair, "rates"):
        return "its growing diameters"
    if model.balance is not None or model.impact is not None:
        return "contacts that change the energy"
    if hasattr(model.pair, "impulse"):
        return "its pinned components"
    if any(registry.answers(question, type(model.pair)) for question in MEMORY):
        return "a pair model with a memory"
    if model.obstacles is not None and model.obstacles.live is not None:
        return "obstacles that move or lose energy"
    if model.obstacles is not None and not isinstance(model.motion, Inertial):
        return "walls or obstacles in a field"
    if model.currents is not None or model.flights is not None:
        return "the currents or free flights that are added up"
    return None


def clone(value: Any) -> Any:
    """Return a deep copy of a model or an array."""
    if isinstance(value, np.ndarray):
        fresh = aligned(value.size, value.dtype).reshape(value.shape)
        fresh[...] = value
        return fresh.view(type(value))
    if isinstance(value, tuple):
        parts = [clone(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def share_of(engine: Engine, here: np.ndarray) -> Share:
    """Return the arrays of an engine that are filled and handed back."""
    state = engine.state
    bits = state.rows.view(np.ndarray).view(np.uint64).reshape(len(state.rows), -1)
    return Share(state.rows, bits, state.partner, state.leave, state.images, engine.neighbors, here)


class Part(NamedTuple):
    """A copy of an engine for one part of the box."""

    engine: Engine
    """The copy; its tally of species is what it gathers."""
    share: Share
    """Its arrays."""
    gathered: Gathered
    """The collisions in its own cells."""
    digests: np.ndarray
    """Of what happened in each cell that is compared, (cells,) uint64."""


def make_part(engine: Engine, flags: np.ndarray, page: Page) -> Part:
    """Return a copy of an engine for one of several parts. Nothing is loaded into it yet."""
    state = clone(engine.state)
    n = len(state.partner)
    digests = aligned(len(flags), np.uint64)
    neighbors = clone(engine.neighbors)
    gathered = Gathered(neighbors, flags, aligned(1, np.float64), page)
    model = engine.model._replace(
        lanes=make_lanes(engine.model.pair),
        obstacles=clone(engine.model.obstacles),
        sight=Watched(engine.model.sight, flags, digests),
    )
    width, heap = float(engine.calendar.control.width[0]), len(engine.calendar.due)
    # All whom another part can touch are due when a window begins.
    calendar = make_calendar(n, width, heap, together=n)
    copy = Engine(
        model,
        state,
        neighbors,
        calendar,
        aligned(1, TALLY).view(np.recarray),
        gathered,  # type: ignore[arg-type]
    )
    return Part(copy, share_of(copy, np.full(n, OWN, np.uint8)), gathered, digests)


def with_neighbors(part: Part, neighbors: Any) -> Part:
    """Return a part with a copy of a neighbour scheme that has more room, everything else kept."""
    fresh = clone(neighbors)
    gathered = part.gathered._replace(neighbors=fresh)
    engine = part.engine._replace(neighbors=fresh, by_species=gathered)  # type: ignore[arg-type]
    return Part(engine, part.share._replace(neighbors=fresh), gathered, part.digests)


def restart(engine: Engine, epoch: int, now: float) -> None:
    """Build the calendar of an engine anew, at a time within an epoch."""
    clock, control = engine.state.clock, engine.calendar.control
    clock.epoch[0], clock.now[0] = epoch, now
    if control.full[0] == 0:
        control.width[0] *= 2.0  # which the cycle halves where lines ran out
    control.full[0] = 1


def with_larger_heap(part: Part) -> Part:
    """Return a part whose calendar has twice the heap, its entries kept."""
    calendar = part.engine.calendar
    due, who = np.zeros(2 * len(calendar.due)), np.zeros(2 * len(calendar.who), np.int32)
    due[: len(calendar.due)], who[: len(calendar.who)] = calendar.due, calendar.who
    return part._replace(engine=part.engine._replace(calendar=calendar._replace(due=due, who=who)))
