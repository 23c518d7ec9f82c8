"""Saved state, rollback and commit of a window: bounded optimism, as in a Time Warp with one saved state.

A window is rolled back where an event was a straggler (:mod:`.synchronization`), reached further than is
allowed for, or found no room. Where all processes came to its end and no message is on its way, that is the
global virtual time (GVT): nothing before it can change any more, and the window is committed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from carom.engine.build import Engine
from carom.engine.domains.event_log_merge import AllEvents, find_order, merge, order_tasks, put_in_order
from carom.engine.domains.logical_process import LogicalProcess
from carom.engine.state import State


class SavedState(NamedTuple):
    """What a window begins with: of the rest, scheduling makes all anew."""

    rows: np.ndarray  # old events, n
    images: np.ndarray | None  # boxes crossed, (n, d), where they are counted


def make_saved_state(state: State) -> SavedState:
    """Return room for the state of a window's beginning."""
    rows = state.rows.view(np.ndarray)[:-1]
    return SavedState(np.empty_like(rows), None if state.images is None else np.empty_like(state.images))


def save_state(saved: SavedState, state: State, share: slice) -> None:
    """Keep a share of the components as they are at a window's beginning."""
    saved.rows[share] = state.rows.view(np.ndarray)[share]
    if saved.images is not None and state.images is not None:
        saved.images[share] = state.images[share]


def roll_back(saved: SavedState, state: State, epoch: int, start: float) -> None:
    """Go back to the beginning of a window; all must be scheduled anew, which leaves no trace."""
    state.rows.view(np.ndarray)[: len(saved.rows)] = saved.rows
    if saved.images is not None and state.images is not None:
        state.images[...] = saved.images
    state.clock.epoch[0], state.clock.now[0] = epoch, start


def commit(
    engine: Engine,
    processes: list[LogicalProcess],
    all_events: AllEvents,
    each: Callable[..., Any],
    flush: Callable[[], None],
) -> None:
    """Count what all processes did in a window, in the order of time; its end is the global virtual time.

    ``each`` calls a function in the thread of every process, ``flush`` makes room in the log of the run.
    """

    def order_page(k: int) -> None:
        calendar: Any = processes[k].engine.calendar
        if calendar.lp[0].stragglers != 0:
            put_in_order(processes[k].recorder.lp_events)

    def order_part(k: int) -> None:
        find_order(*tasks[k])

    total = engine.tallies[0]
    for process in processes:
        tally = process.engine.tallies[0]
        for name in ("advancements", "transits", "returns", "clamped"):
            total[name] += tally[name]
        total.depth = max(total.depth, tally.depth)
    each(order_page)
    tasks = order_tasks(all_events)
    each(order_part)
    heads, model = np.zeros(len(processes), np.int64), engine.model
    told = model.observers, model.obstacles, model.boundary
    while not merge(all_events, heads, engine.state.clock, engine.tallies, *told):
        flush()
