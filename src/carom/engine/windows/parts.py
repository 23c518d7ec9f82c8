"""The engine as each of several parts of the box sees it."""

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
from carom.engine.observers.interface import Observers, count_pair, listed
from carom.engine.observers.own import name_of
from carom.engine.parts import Engine, enlarge_heap
from carom.engine.search import RowSight
from carom.engine.state import aligned
from carom.engine.tallies import TALLY
from carom.engine.windows import messages, turns, upcoming  # noqa: F401 (what a part's calendar answers)
from carom.engine.windows.desk import DESK, LINE, MAIL, NOTES, PAST, PLACE, TIME, Board, PartCalendar
from carom.engine.windows.ledger import Gathered, Page
from carom.engine.windows.slabs import PATCHES, Slabs
from carom.models.free_flight import Inertial
from carom.models.gravity import Falling
from carom.models.interface import NEVER, age, begin, complaint, growth, take_over, taken_up

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
    if model.impact is not None:
        return "contacts that change the energy"
    if hasattr(model.pair, "impulse"):
        return "its pinned components"
    if any(registry.answers(question, type(model.pair)) for question in MEMORY):
        return "a pair model with a memory"
    if model.obstacles is not None and model.obstacles.live is not None:
        return "obstacles that move or lose energy"
    if not isinstance(model.motion, Inertial | Falling):
        return "a motion in which what flies apart may come back"
    if model.obstacles is not None and not isinstance(model.motion, Inertial):
        return "walls or obstacles in a field"
    for each in listed(model.observers):
        if not registry.answers(count_pair, type(each)):
            return f"{name_of(each)}, which observes every event when it happens"
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


class Part(NamedTuple):
    """The engine as one part sees it: one state and one neighbour scheme, and a calendar of its own."""

    engine: Engine
    """Its one observer is what it gathers."""
    gathered: Gathered
    """Its collisions."""


SCRATCH: dict[type, tuple[str, ...]] = {
    Sectors: ("near", "words"),
    Lists: ("grid", "found", "points", "sizes", "newcomers", "hits"),
}
"""What a neighbour scheme has for the search at hand alone."""


def make_board(parts: int, dimension: int) -> Board:
    """Return an empty board."""
    return Board(
        clocks=aligned(LINE * parts, np.float64).reshape(parts, LINE),
        inbox=aligned(LINE * parts, np.int64).reshape(parts, LINE),
        taken=aligned(LINE * parts, np.int64).reshape(parts, LINE),
        mail=aligned(2 * MAIL * parts, np.int32).reshape(parts, 2, MAIL),
        locks=aligned(LINE * parts, np.int64).reshape(parts, LINE),
        past=make_past(parts * PAST, dimension).reshape(parts, PAST, -1),
        due=aligned(2 * PATCHES * parts, np.float64).reshape(parts, 2, PATCHES),
    )


def make_past(events: int, dimension: int) -> np.ndarray:
    """Return room to remember events, each on cache lines of its own."""
    words = -(-(PLACE + dimension) // LINE) * LINE
    return aligned(events * words, np.float64).reshape(events, words)


def make_part(engine: Engine, k: int, slabs: Slabs, board: Board, page: Page, patience: int) -> Part:
    """Return an engine as part k of several sees it. Its calendar is to be laid out yet.

    ``patience``: refusals after which its thread lets another have the core.
    """
    parts, dimension = len(slabs.masks), len(slabs.near)
    state = engine.state._replace(clock=clone(engine.state.clock), block=clone(engine.state.block))
    scratch = SCRATCH[type(engine.neighbors)]
    neighbors: Any = engine.neighbors._replace(
        **{name: clone(getattr(engine.neighbors, name)) for name in scratch}
    )
    n = len(state.partner)
    plain = make_calendar(n // parts, float(engine.calendar.control.width[0]), len(engine.calendar.due))
    desk = aligned(1, DESK)
    desk["patience"] = patience
    desk["me"], desk["parts"], desk["axis"] = k, parts, slabs.axis
    calendar = PartCalendar(
        *plain,
        neighbors=neighbors,
        desk=desk.view(np.recarray),
        board=board,
        mask=clone(slabs.masks[k]),
        along=slabs.along,
        patches=slabs.patches,
        rows=slabs.rows,
        layers=slabs.layers,
        near=slabs.near,
        past=make_past(PAST, dimension),
        notes=aligned(2 * NOTES, np.float64).reshape(2, NOTES),
        where=aligned(2 * NOTES, np.int64).reshape(2, NOTES),
        flags=aligned(len(plain.buckets), np.uint8),
    )
    gathered = Gathered(aligned(1, np.float64), page)
    model = engine.model._replace(
        lanes=make_lanes(engine.model.pair),
        obstacles=clone(engine.model.obstacles),
        observers=Observers(gathered, None),
    )
    tallies = aligned(1, TALLY).view(np.recarray)
    return Part(Engine(model, state, neighbors, calendar, tallies), gathered)  # type: ignore[arg-type]


def begin_window(parts: list[Part], epoch: int, start: float, end: float, lead: float) -> None:
    """Let all parts begin a window from ``start`` to ``end``, with empty tallies and no messages.

    ``lead`` is how far one may be ahead of another, in widths of a bucket.
    """
    board = parts[0].engine.calendar.board  # type: ignore[attr-defined]
    board.clocks[:, 0], board.clocks[:, 1] = start, -NEVER
    for shared in (board.inbox, board.taken, board.locks):
        shared[:] = 0
    for part in parts:
        calendar: Any = part.engine.calendar
        desk, clock = calendar.desk.view(np.ndarray), part.engine.state.clock
        clock.epoch[0], clock.now[0] = epoch, start
        for name in ("locked", "refused", "passed", "late", "written", "read", "fresh"):
            desk[name] = 0
        for name in ("latest", "told", "sight"):
            desk[name] = -NEVER
        desk["unread"], desk["until"], desk["lead"] = NEVER, end, lead
        calendar.past[:, TIME] = -NEVER
        part.engine.tallies.view(np.ndarray)[:] = 0


def stop(parts: list[Part]) -> None:
    """Let all parts stop at their next refusal."""
    parts[0].engine.calendar.board.inbox[:, 2] = 1  # type: ignore[attr-defined]


def stopped(parts: list[Part]) -> bool:
    """Tell whether all parts are to stop."""
    return bool(parts[0].engine.calendar.board.inbox[:, 2].any())  # type: ignore[attr-defined]


def has_mail(part: Part) -> bool:
    """Tell whether a part, which does not run, has messages to read."""
    calendar: Any = part.engine.calendar
    desk = calendar.desk[0]
    return bool((calendar.board.inbox[int(desk.me), :2] != desk.read).any())


def restart(engine: Engine, epoch: int, now: float, width: float | None = None) -> None:
    """Let the calendar of an engine be laid out anew, at a time within an epoch; that of a part with a
    ``width`` of its buckets.
    """
    clock, control = engine.state.clock, engine.calendar.control
    clock.epoch[0], clock.now[0] = epoch, now
    if width is not None:
        control.width[0] = width
    elif control.full[0] == 0:
        control.width[0] *= 2.0  # the cycle halves it, as where lines ran out
    control.full[0] = 1


def with_larger_heap(part: Part) -> Part:
    """Return a part whose calendar has twice the heap, its entries kept."""
    return part._replace(engine=enlarge_heap(part.engine, 2 * len(part.engine.calendar.due)))
