"""The collisions of several processes: noted by each, added up in the order of time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.entry import entry
from carom.engine.constants import LAMBDA, OBSTACLE
from carom.engine.observers.interface import Observer
from carom.engine.state import aligned

ENTRY = np.dtype([("time", "f8"), ("virial", "f8")])
"""A collision: its time within the epoch and its virial."""

DETAIL = np.dtype([("impulse", "f8"), ("ref", "i8")])
"""The magnitude of the momentum exchanged, and the ref of the other, or ``OBSTACLE - k``."""


class LpEvents(NamedTuple):
    """The collisions of one process."""

    used: np.ndarray  # how many there are, the first of a line of int64
    entries: Any  # (room,) of type ENTRY
    component: np.ndarray  # the component of lower index, (room,) int32
    details: Any  # (room,) of type DETAIL, or None where nobody asks: no observers, no obstacles


class AllEvents(NamedTuple):
    """The same of all processes, a row for each process."""

    used: np.ndarray
    """How many collisions each has, in the first column, (processes, 8) int64: a cache line for each."""
    entries: Any  # (processes, room) of type ENTRY
    component: np.ndarray  # (processes, room) int32
    details: Any  # (processes, room) of type DETAIL, or None
    order: np.ndarray  # the process of each collision in the order of time, (processes * room,) uint16


def make_all_events(processes: int, capacity: int, detailed: bool) -> AllEvents:
    """Return empty arrays with room for a given number of collisions of each process."""

    def rows(kind):
        return aligned(processes * capacity, kind).reshape(processes, capacity)

    used = aligned(8 * processes, np.int64).reshape(processes, 8)
    details = rows(DETAIL).view(np.recarray) if detailed else None
    order = np.empty(processes * capacity, np.uint16)
    return AllEvents(used, rows(ENTRY).view(np.recarray), rows(np.int32), details, order)


def lp_events_of(all_events: AllEvents, process: int) -> LpEvents:
    """Return the rows of a process."""
    details = None if all_events.details is None else all_events.details[process]
    return LpEvents(
        all_events.used[process], all_events.entries[process], all_events.component[process], details
    )


class LpRecorder(Observer):
    """The observer of a process: it notes its collisions."""

    last_virial: np.ndarray  # virial of the collision at hand, (1,) float64
    lp_events: LpEvents  # the rows of the process

    def count_pair(self, i, j, virial):
        self.last_virial[0] = virial

    def is_full(self):
        return self.lp_events.used[0] == len(self.lp_events.entries)

    def record(self, clock, i, ref, impulse):
        lp_events = self.lp_events
        k = lp_events.used[0]
        entry = lp_events.entries[k]
        entry.time = clock.now
        entry.virial = self.last_virial[0]
        lp_events.component[k] = i
        put_detail(lp_events.details, k, ref, impulse)
        lp_events.used[0] = k + 1


def put_detail(details, k, ref, impulse):
    """Note the ref and the impulse of the k-th collision."""
    if details is not None:
        details[k].ref = ref
        details[k].impulse = impulse


def detail(details, process, k):
    """Return the ref and the impulse of the k-th collision of a process."""
    if details is None:
        return 0, 0.0
    return details[process, k].ref, np.float64(details[process, k].impulse)


def struck(obstacles, number, momentum):
    """Add a collision with an obstacle."""
    if obstacles is not None:
        obstacles.hits[number] += 1
        obstacles.impulse[number] += momentum


def put_in_order(lp_events: LpEvents) -> None:
    """Sort the collisions of a process by time, where one came late."""
    count = lp_events.used[0]
    order = np.argsort(lp_events.entries.view(np.ndarray)["time"][:count], kind="stable")
    for column in (lp_events.entries, lp_events.component, lp_events.details):
        if column is not None:
            values = column.view(np.ndarray)[:count]
            values[:] = values[order]


def order_tasks(all_events: AllEvents) -> list[tuple[Any, ...]]:
    """Divide the window's time among the processes, and return the arguments of ``find_order`` for each."""
    counts, rows = all_events.used[:, 0], all_events.entries.view(np.ndarray)
    pages = [page["time"][:count] for page, count in zip(rows, counts, strict=True)]
    longest = max(pages, key=len) if counts.any() else np.zeros(1)
    borders = longest[len(longest) * np.arange(1, len(pages)) // len(pages)]
    inside = np.array([np.searchsorted(page, borders) for page in pages])
    bounds = np.ascontiguousarray(np.vstack([np.zeros(len(pages), np.int64), inside.T, counts]))
    totals = bounds.sum(axis=1)
    return [
        (
            all_events,
            bounds[k].copy(),
            bounds[k + 1],
            all_events.order[totals[k] : totals[k + 1]],
            *_players(len(pages)),
        )
        for k in range(len(pages))
    ]


def _players(processes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the tree of a tournament that nobody has begun: who lost at each node, when, and with whom."""
    leaves = 1 << (processes - 1).bit_length()
    return np.zeros(leaves, np.int64), np.full(leaves, -np.inf), np.zeros(leaves, np.int32)


def next_after(process, time, component, losers, times, components):
    """Let the next collision of a process play against those that lost before; return who comes first."""
    node = (len(losers) + process) >> 1
    while node > 0:
        other, at, who = losers[node], times[node], components[node]
        wins = (at < time) | ((at == time) & (who < component))  # a jump would hang on the toss of a coin
        losers[node], process = process if wins else other, other if wins else process
        times[node], time = time if wins else at, at if wins else time
        components[node], component = component if wins else who, who if wins else component
        node >>= 1
    return process


@entry
def find_order(all_events, heads, ends, order, losers, times, components):
    """Find the order of collisions, by a tournament of processes: who has the earliest, who the next."""
    entries, component = all_events.entries, all_events.component
    process = 0
    for k in range(len(losers)):
        time, who = np.inf, 0
        if k < len(heads) and heads[k] < ends[k]:
            time, who = entries[k, heads[k]].time, component[k, heads[k]]
        process = next_after(k, time, who, losers, times, components)
    for k in range(len(order)):
        order[k] = process
        head = heads[process] + 1
        heads[process] = head
        time, who = np.inf, 0
        if head < ends[process]:
            time, who = entries[process, head].time, component[process, head]
        process = next_after(process, time, who, losers, times, components)


@entry
def merge(all_events, heads, clock, tallies, observers, obstacles, boundary):
    """Add up the collisions of all processes in the order that was found, as one cycle would have."""
    tally = tallies[0]
    done = total = 0
    for process in range(len(heads)):
        done += heads[process]
        total += all_events.used[process, 0]
    for k in range(done, total):
        if observers.is_full():
            return False
        page = all_events.order[k]
        h = heads[page]
        heads[page] += 1
        entry = all_events.entries[page, h]
        i = all_events.component[page, h]
        ref, impulse = detail(all_events.details, page, h)
        clock[0].now = entry.time
        if ref < LAMBDA:
            struck(obstacles, OBSTACLE - ref, impulse)
        else:
            tally.collisions += 1
            tally.virial += entry.virial
            observers.count_pair(i, boundary.index(ref), entry.virial)
        observers.record(clock[0], i, ref, impulse)
    return True
