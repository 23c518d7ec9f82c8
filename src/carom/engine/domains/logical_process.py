"""The engine as each of several logical processes sees it: one slab of the box is its own."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling import registry
from carom.compiling.lanes import make_lanes
from carom.engine.boundary import NearestImage
from carom.engine.build import Engine, enlarge_heap
from carom.engine.calendar import make_calendar
from carom.engine.constants import TALLY
from carom.engine.domains.decomposition import PATCHES, Slabs
from carom.engine.domains.event_log_merge import LpEvents, LpRecorder
from carom.engine.domains.lp_queue import LpQueue
from carom.engine.domains.lp_state import (
    HISTORY_LENGTH,
    LINE,
    LP_STATE,
    MOST_ANNOUNCED,
    MOST_MESSAGES,
    PLACE,
    TIME,
    Channels,
)
from carom.engine.neighbors.lists import NeighborLists
from carom.engine.neighbors.sectors import Sectors
from carom.engine.observers.interface import chained, listed
from carom.engine.observers.own import name_of
from carom.engine.search import FromRows
from carom.engine.state import aligned
from carom.models.interfaces.memory import remembers
from carom.models.interfaces.particles import NEVER
from carom.models.motions.free_flight import Inertial
from carom.models.motions.gravity import Falling

MEMORY = ("shift_epoch", "start_steps", "error_message", "growth_of", "record_impulse")
"""Questions that only a pair model answers whose arrays change during a run."""


def why_not_parallel(engine: Engine) -> str | None:
    """Return what keeps an engine from running in windows, in words, or None."""
    model, neighbors = engine.model, engine.neighbors
    if not isinstance(neighbors, NeighborLists | Sectors):
        return "its few or thinly spread components"
    if type(model.boundary) is not NearestImage or not isinstance(model.timing, FromRows):
        return "its small box, or its steps of pairs"
    if hasattr(model.pair, "rates"):
        return "its growing diameters"
    if model.impact is not None:
        return "contacts that change the energy"
    if model.timers is not None:
        return "its drive"
    if hasattr(model.pair, "impulse"):
        return "its pinned components"
    if remembers(model.pair) or any(registry.answers(question, type(model.pair)) for question in MEMORY):
        return "a pair model with a memory"
    if model.obstacles is not None and model.obstacles.live is not None:
        return "obstacles that move or lose energy"
    if not isinstance(model.motion, Inertial | Falling):
        return "a motion in which what flies apart may come back"
    if model.obstacles is not None and not isinstance(model.motion, Inertial):
        return "walls or obstacles in a field"
    for each in listed(model.observers):
        if not any(registry.answers(question, type(each)) for question in ("count_pair", "record")):
            return f"{name_of(each)}, which observes every event when it happens"
    return None


def clone(value: Any) -> Any:
    """Return a deep copy of a model or an array."""
    if isinstance(value, np.ndarray):
        copied = aligned(value.size, value.dtype).reshape(value.shape)
        copied[...] = value
        return copied.view(type(value))
    if isinstance(value, tuple):
        parts = [clone(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


class LogicalProcess(NamedTuple):
    """The engine as one process sees it: one state and one neighbor scheme, and a calendar of its own."""

    engine: Engine  # it has one observer, which notes its collisions
    recorder: LpRecorder  # that observer


SCRATCH: dict[type, tuple[str, ...]] = {
    Sectors: ("neighbor_cells", "refs"),
    NeighborLists: ("grid", "found", "points", "sizes", "newcomers", "hits"),
}
"""What a neighbor scheme has for the search at hand alone."""


def make_channels(processes: int, dimension: int) -> Channels:
    """Return the channels of a number of processes, empty."""
    return Channels(
        published_time=aligned(LINE * processes, np.float64).reshape(processes, LINE),
        sent_count=aligned(LINE * processes, np.int64).reshape(processes, LINE),
        acknowledged=aligned(LINE * processes, np.int64).reshape(processes, LINE),
        messages=aligned(2 * MOST_MESSAGES * processes, np.int32).reshape(processes, 2, MOST_MESSAGES),
        border_locks=aligned(LINE * processes, np.int64).reshape(processes, LINE),
        history=make_history(processes * HISTORY_LENGTH, dimension).reshape(processes, HISTORY_LENGTH, -1),
        event_time=aligned(2 * PATCHES * processes, np.float64).reshape(processes, 2, PATCHES),
    )


def make_history(events: int, dimension: int) -> np.ndarray:
    """Return room to remember events, each on cache lines of its own."""
    refs = -(-(PLACE + dimension) // LINE) * LINE
    return aligned(events * refs, np.float64).reshape(events, refs)


def make_process(
    engine: Engine, k: int, slabs: Slabs, channels: Channels, lp_events: LpEvents, spins_before_yield: int
) -> LogicalProcess:
    """Return an engine as process k sees it, which yields its core after ``spins_before_yield``."""
    processes, dimension = len(slabs.masks), len(slabs.conflict_range)
    state = engine.state._replace(clock=clone(engine.state.clock))
    scratch = SCRATCH[type(engine.neighbors)]
    neighbors: Any = engine.neighbors._replace(
        **{name: clone(getattr(engine.neighbors, name)) for name in scratch}
    )
    n = len(state.partner)
    plain = make_calendar(
        n // processes, float(engine.calendar.control.width[0]), len(engine.calendar.event_time)
    )
    lp = aligned(1, LP_STATE)
    lp["spins_before_yield"] = spins_before_yield
    lp["me"], lp["processes"], lp["axis"] = k, processes, slabs.axis
    calendar = LpQueue(
        plain.control,
        plain.buckets,
        plain.lines,
        plain.event_time,
        plain.component,
        neighbors=neighbors,
        lp=lp.view(np.recarray),
        channels=channels,
        mask=clone(slabs.masks[k]),
        along=slabs.along,
        patches=slabs.patches,
        rows=slabs.rows,
        layers=slabs.layers,
        conflict_range=slabs.conflict_range,
        history=make_history(HISTORY_LENGTH, dimension),
        announced_times=aligned(2 * MOST_ANNOUNCED, np.float64).reshape(2, MOST_ANNOUNCED),
        announced_patches=aligned(2 * MOST_ANNOUNCED, np.int64).reshape(2, MOST_ANNOUNCED),
        flags=aligned(len(plain.buckets), np.uint8),
    )
    recorder = LpRecorder(aligned(1, np.float64), lp_events)
    model = engine.model._replace(
        lanes=make_lanes(engine.model.pair),
        obstacles=clone(engine.model.obstacles),
        observers=chained([recorder]),
    )
    tallies = aligned(1, TALLY).view(np.recarray)
    return LogicalProcess(Engine(model, state, neighbors, calendar, tallies), recorder)


def begin_window(
    processes: list[LogicalProcess], epoch: int, start: float, end: float, time_window: float
) -> None:
    """Let all begin a window without tallies and messages; ``time_window`` is in widths of a bucket."""
    channels = processes[0].engine.calendar.channels  # type: ignore[attr-defined]
    channels.published_time[:, 0], channels.published_time[:, 1] = start, -NEVER
    for shared in (channels.sent_count, channels.acknowledged, channels.border_locks):
        shared[:] = 0
    for process in processes:
        calendar: Any = process.engine.calendar
        lp, clock = calendar.lp.view(np.ndarray), process.engine.state.clock
        clock.epoch[0], clock.now[0] = epoch, start
        for name in ("held_borders", "waits", "processed", "stragglers", "written", "read", "unacknowledged"):
            lp[name] = 0
        for name in ("local_time", "announced_time", "announced_horizon"):
            lp[name] = -NEVER
        lp["unread"], lp["window_end"], lp["time_window"] = NEVER, end, time_window
        calendar.history[:, TIME] = -NEVER
        process.engine.tallies.view(np.ndarray)[:] = 0


def stop(processes: list[LogicalProcess]) -> None:
    """Let all processes stop at their next refusal."""
    processes[0].engine.calendar.channels.sent_count[:, 2] = 1  # type: ignore[attr-defined]


def stopped(processes: list[LogicalProcess]) -> bool:
    """Tell whether all processes are to stop."""
    return bool(processes[0].engine.calendar.channels.sent_count[:, 2].any())  # type: ignore[attr-defined]


def has_messages(process: LogicalProcess) -> bool:
    """Tell whether a process, which does not run, has messages to read."""
    calendar: Any = process.engine.calendar
    lp = calendar.lp[0]
    return bool((calendar.channels.sent_count[int(lp.me), :2] != lp.read).any())


def refill_queue(engine: Engine, epoch: int, now: float, width: float | None = None) -> None:
    """Let a calendar be laid out anew at a time in the epoch; that of a process with a ``width``."""
    clock, control = engine.state.clock, engine.calendar.control
    clock.epoch[0], clock.now[0] = epoch, now
    if width is not None:
        control.width[0] = width
    elif control.full[0] == 0:
        control.width[0] *= 2.0  # the cycle halves it, as where lines ran out
    control.full[0] = 1


def with_larger_heap(process: LogicalProcess) -> LogicalProcess:
    """Return a process whose calendar has twice the heap, its entries kept."""
    return process._replace(engine=enlarge_heap(process.engine, 2 * len(process.engine.calendar.event_time)))
