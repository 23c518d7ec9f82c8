"""The collisions of several processes: noted by each, added up in the order of time."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.compiling.registry import inner, optional
from carom.engine.boundary import index
from carom.engine.constants import LAMBDA, OBSTACLE
from carom.engine.observers.interface import count_pair, is_full, record
from carom.engine.obstacles import Obstacles
from carom.engine.state import aligned

ENTRY = np.dtype([("time", "f8"), ("virial", "f8")])
"""A collision: its time within the epoch and its virial."""

DETAIL = np.dtype([("impulse", "f8"), ("ref", "i8")])
"""The magnitude of the momentum exchanged, and the word of the other, or ``OBSTACLE - k``."""


STRETCH = 256
"""Collisions that are put in order in one go, four times, before they are added up."""


class LpEvents(NamedTuple):
    """The collisions of one process."""

    used: np.ndarray
    """How many there are, the first of a line of int64."""
    entries: Any
    """(room,) of type ENTRY."""
    component: np.ndarray
    """The component of lower index, (room,) int32."""
    details: Any
    """(room,) of type DETAIL, or None where nobody asks: no observers, no obstacles."""


class AllEvents(NamedTuple):
    """The same of all processes, a row for each process."""

    used: np.ndarray
    """How many collisions each has, in the first column, (processes, 8) int64: a cache line for each."""
    entries: Any
    """(processes, room) of type ENTRY."""
    stamps: np.ndarray
    """The bits of times and virials, a view of them, (processes, room, 2) int64."""
    component: np.ndarray
    """(processes, room) int32."""
    details: Any
    """(processes, room) of type DETAIL, or None."""
    ordered: np.ndarray
    """Bits of virials in the order of time, room for adding up, (4, STRETCH) int64."""


def make_all_events(processes: int, capacity: int, detailed: bool) -> AllEvents:
    """Return an empty ledger with room for a given number of collisions of each process."""

    def rows(kind):
        return aligned(processes * capacity, kind).reshape(processes, capacity)

    used = aligned(8 * processes, np.int64).reshape(processes, 8)
    entries = rows(ENTRY)
    stamps = entries.view(np.int64).reshape(processes, capacity, 2)
    details = rows(DETAIL).view(np.recarray) if detailed else None
    ordered = aligned(4 * STRETCH, np.int64).reshape(4, STRETCH)
    return AllEvents(used, entries.view(np.recarray), stamps, rows(np.int32), details, ordered)


def lp_events_of(all_events: AllEvents, process: int) -> LpEvents:
    """Return the page of a process."""
    details = None if all_events.details is None else all_events.details[process]
    return LpEvents(
        all_events.used[process], all_events.entries[process], all_events.component[process], details
    )


class LpRecorder(NamedTuple):
    """The observer of a process: it notes its collisions."""

    last_virial: np.ndarray
    """Virial of the collision at hand, (1,) float64."""
    lp_events: LpEvents
    """The process's page of the ledger."""


@count_pair.register
def _(observer: LpRecorder, i, j, virial):
    observer.last_virial[0] = virial


@is_full.register
def _(observer: LpRecorder):
    return observer.lp_events.used[0] == len(observer.lp_events.entries)


@record.register
def _(observer: LpRecorder, clock, i, ref, impulse):
    lp_events = observer.lp_events
    k = lp_events.used[0]
    entry = lp_events.entries[k]
    entry.time = clock.now
    entry.virial = observer.last_virial[0]
    lp_events.component[k] = i
    put_detail(lp_events.details, k, ref, impulse)
    lp_events.used[0] = k + 1


@optional
def put_detail(details, k, ref, impulse):
    """Note the word and the impulse of the k-th collision."""
    return


@put_detail.register
def _(details: np.ndarray, k, ref, impulse):
    details[k].ref = ref
    details[k].impulse = impulse


@optional
def detail(details, process, k):
    """Return the word and the impulse of the k-th collision of a process."""
    return np.int64(0), 0.0


@detail.register
def _(details: np.ndarray, process, k):
    return np.int64(details[process, k].ref), np.float64(details[process, k].impulse)


@optional
def struck(obstacles, number, momentum):
    """Add a collision with an obstacle."""
    return


@struck.register
def _(obstacles: Obstacles, number, momentum):
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


@inner
def of_left(left, right, a, b, count):
    """Return how many of the next ``count`` collisions are of the left process, from the a-th and b-th on."""
    low, high = np.int64(0), np.int64(count)
    while low < high:
        middle = (low + high) // 2
        if right[np.uint64(b + count - 1 - middle), 0] < left[np.uint64(a + middle), 0]:
            high = middle
        else:
            low = middle + 1
    return low


@inner
def next_of_two(left, right, a, b):
    """Return the virial of the next collision, the a-th or the b-th, what is next then, and whether both are
    at the same time.
    """
    at_left, at_right = left[a, 0], right[b, 0]
    of_a, of_b = left[a, 1], right[b, 1]
    is_right = at_right < at_left
    step = np.uint64(is_right)
    return of_b if is_right else of_a, a + np.uint64(1) - step, b + step, at_left == at_right


@inner
def add_two(all_events, heads, tally):
    """Add up what two processes have, until one of them has little left, or two collisions are at the same
    time.

    Which comes first is a coin tossed for each collision, and the next question hangs on the answer. So four
    stretches are put in order at a time, and without a jump: positive numbers are in the order of their bits.
    A stretch holds if the one before ended where it began. Then they are added up.
    """
    left, right, ordered = all_events.stamps[0], all_events.stamps[1], all_events.ordered
    virials = ordered.view(np.float64)
    a, b = heads[0], heads[1]
    virial = tally.virial
    while min(all_events.used[0, 0] - a, all_events.used[1, 0] - b) >= 4 * STRETCH:
        begin1 = a + of_left(left, right, a, b, STRETCH)
        begin2 = a + of_left(left, right, a, b, 2 * STRETCH)
        begin3 = a + of_left(left, right, a, b, 3 * STRETCH)
        a0, a1, a2, a3 = np.uint64(a), np.uint64(begin1), np.uint64(begin2), np.uint64(begin3)
        b0, b1 = np.uint64(b), np.uint64(a + b + STRETCH - begin1)
        b2, b3 = np.uint64(a + b + 2 * STRETCH - begin2), np.uint64(a + b + 3 * STRETCH - begin3)
        tied = False
        for k in range(np.uint64(STRETCH)):
            ordered[0, k], a0, b0, tied0 = next_of_two(left, right, a0, b0)
            ordered[1, k], a1, b1, tied1 = next_of_two(left, right, a1, b1)
            ordered[2, k], a2, b2, tied2 = next_of_two(left, right, a2, b2)
            ordered[3, k], a3, b3, tied3 = next_of_two(left, right, a3, b3)
            tied |= tied0 | tied1 | tied2 | tied3
        if tied or np.int64(a0) != begin1 or np.int64(a1) != begin2 or np.int64(a2) != begin3:
            break
        for stretch in range(4):
            for k in range(np.uint64(STRETCH)):
                virial += virials[stretch, k]
        a, b = np.int64(a3), np.int64(b3)
    tally.collisions += a + b - heads[0] - heads[1]
    tally.virial = virial
    heads[0], heads[1] = a, b


@entry
def merge(all_events, heads, clock, tallies, observers, obstacles, boundary):
    """Add up the collisions of all processes in the order of time, as one cycle would have.

    Parameters
    ----------
    heads : (processes,) int64 array
        Number of collisions of each process that have been added already.

    Returns
    -------
    done : bool
        False if an observer is full. The next call then continues from there.
    """
    all_events, obstacles, observers = borrowed(all_events), borrowed(obstacles), borrowed(observers)
    tally = tallies[0]
    entries = all_events.entries
    processes = len(heads)
    if processes == 2 and all_events.details is None:
        add_two(all_events, heads, tally)
    while True:
        process = np.int64(-1)
        for k in range(processes):
            h = heads[k]
            if h == all_events.used[k, 0]:
                continue
            if process < 0 or entries[k, h].time < entries[process, heads[process]].time:
                process = np.int64(k)
            elif entries[k, h].time == entries[process, heads[process]].time:
                process = (
                    np.int64(k)
                    if all_events.component[k, h] < all_events.component[process, heads[process]]
                    else process
                )
        if process < 0:
            return True
        if is_full(observers):
            return False
        h = heads[process]
        heads[process] = h + 1
        entry = entries[process, h]
        i = np.int64(all_events.component[process, h])
        ref, impulse = detail(all_events.details, process, h)
        clock[0].now = entry.time
        if ref < LAMBDA:
            struck(obstacles, OBSTACLE - ref, impulse)
        else:
            tally.collisions += 1
            tally.virial += entry.virial
            count_pair(observers, i, np.int64(index(boundary, ref)), entry.virial)
        record(observers, clock[0], i, ref, impulse)
