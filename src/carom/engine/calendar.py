"""The event calendar, a calendar queue: append-only buckets, and a small heap for the present one.

As in Paul, J. Comput. Phys. 221 (2007) 615. An entry names a component, due at its new event or its sector
crossing, whichever is first. It is stale if that time is no longer in its bucket, and is then dropped when
the bucket is opened. A pair event needs one entry, of a component that has it before its sector crossing.
Buckets (days) cover a *window* of time (the year); later events are found in the rows at its end. The order
is by (time, component), for any width of the buckets.

Whether an event falls into the window is a coin toss, known last: a branch on it would be mispredicted too
late for anything of the next event to be done meanwhile. One more bucket, never read, takes what is due
later.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.compiling.instructions import prefetch
from carom.compiling.registry import Questions, cold
from carom.engine.neighbors.prefetch import HUGE, LARGE, prefetch_next
from carom.engine.state import aligned
from carom.models.interfaces.particles import NEVER

ENTRIES = 14
"""Entries a cache line: 16 words, less one for the count and one for the link to the line filled before."""

FEWEST, MOST = 4.0, 8.5  # cycles a bucket below and above which the next window has buckets of another width

LARGE_SYSTEM_FACTOR = 0.47
"""Factor on both for ``HUGE`` systems: memory is requested a bucket at a time, best a few events ahead."""

BLOCK = 256
"""Components that are looked at together when the calendar is laid out; the heap has room for as many."""

MOST_NEW_ENTRIES = 8  # entries that one cycle can add to the heap, at most

# No field may have the name of an attribute of numpy scalars (size, say): the engine runs as Python, too.
CONTROL = np.dtype(
    [
        ("start", "f8"),
        ("end", "f8"),
        ("width", "f8"),
        ("inverse", "f8"),
        ("cursor", "i8"),
        ("waiting", "i8"),
        ("lines", "i8"),
        ("full", "i8"),
        ("cycles", "i8"),
        ("ahead", "i8"),
    ]
)

NARROWEST = 2.0**-40
"""Width of a bucket in epochs, at least: what is closer in time, or simultaneous, fills one bucket anyway."""


class OneOfSeveral(Questions):
    """What a calendar does that is one of several, each for a part of the box (``engine/domains``).

    For one that is alone the cycle has no branch and no byte.
    """

    control: Any  # one record of type CONTROL

    def is_remote(self, i):
        """Return whether component i belongs to another calendar; by default there is none."""
        return False

    def count_local(self, start_index, end):
        """Return how many of a range belong to this calendar (all by default); its heap is empty and free."""
        return end - start_index

    def local_component(self, start_index, k):
        """Return the k-th of those."""
        return start_index + k

    def send_if_remote(self, i, time):
        """Send i, due at ``time``, to the calendar that it belongs to; return whether that is another one."""
        return False

    def note_border_event(self, bucket, time, i):
        """Take notice of an entry; by default nobody does."""

    def clear_notes(self):
        """Forget all such notices: everything is entered anew."""

    def receive(self, state):
        """Begin a cycle: enter what other calendars have sent."""

    def publish_time(self, state, time):
        """Tell the others that nothing is due here before ``time``, as a null message does: its safe time."""

    def safe_to_process(self, state, boundary, i, now):
        """Return whether the first event here, of component i, may be processed for all that others hold."""
        return True

    def should_return(self):
        """Return whether the cycle is to end because this was refused too often."""
        return False

    def narrow(self, longest):
        """Halve the buckets of the next window; return whether that could be done."""
        control = self.control[0]
        if control.width <= NARROWEST * longest:
            return False
        control.width *= 0.5
        return True

    def choose_width(self, n, longest):
        """Choose the width of the next buckets by this window's cycles: a few a bucket (the default)."""
        control = self.control[0]
        # All, but where the epoch ended before.
        buckets_passed = (control.end - control.start) * control.inverse
        buckets_passed *= LARGE_SYSTEM_FACTOR if n >= HUGE else 1.0
        if control.cycles > MOST * buckets_passed:
            control.width *= 0.5
        elif (
            control.cycles < FEWEST * buckets_passed
            and 2.0 * buckets_in_window(self) * control.width <= longest
        ):
            control.width *= 2.0


class Calendar(OneOfSeveral):
    """A window of buckets and a heap."""

    control: Any  # one record of type CONTROL
    buckets: np.ndarray
    """(buckets + 1, 16) uint32: count, link, entries; the last row takes what is due beyond the window."""
    lines: np.ndarray  # (lines, 16) uint32: full lines that buckets spilled; line 0 is no line
    event_time: np.ndarray  # heap: times
    component: np.ndarray  # heap: entries


def usual_heap(n: int) -> int:
    """Return for how many entries the heap has room at first."""
    return max(BLOCK, n // 64)


def most_lines(n: int) -> int:
    """Return how many lines are enough: everybody fills half of them."""
    return 2 * (n // ENTRIES) + 64


def make_calendar(n: int, width: float, heap: int = 0) -> Calendar:
    """Return an empty calendar for ``n`` components with buckets of ``width`` (a power of two).

    ``heap`` entries have room in the heap; where that is more than at first, lines grow by the same factor.
    """
    buckets = max(n // 8, 16)
    # For buckets that fill unevenly; should that not do, the window is laid out anew.
    lines = min((n // (4 * ENTRIES) + 64) * max(heap // usual_heap(n), 1), most_lines(n))
    heap = max(heap, BLOCK)
    control = aligned(1, CONTROL)
    control["width"] = width
    control["cursor"] = buckets - 1
    control["ahead"] = 1
    return Calendar(
        control.view(np.recarray),
        aligned(16 * (buckets + 1), np.uint32).reshape(-1, 16),
        aligned(16 * lines, np.uint32).reshape(-1, 16),
        np.zeros(heap),
        np.zeros(heap, np.int32),
    )


def time_of(state, i):
    """Return the time of the first event of component i, a sector crossing included."""
    return min(np.float64(state.rows[i].event_time), state.crossing_time[i])


def push(calendar, time, i):
    """Put an entry on the heap; the caller ensures that there is room."""
    control = calendar.control[0]
    event_time, component = calendar.event_time, calendar.component
    k = control.waiting
    control.waiting += 1
    while k > 0:
        parent = (k - 1) >> 1
        if event_time[parent] < time or (event_time[parent] == time and component[parent] <= i):
            break
        event_time[k] = event_time[parent]
        component[k] = component[parent]
        k = parent
    event_time[k] = time
    component[k] = i


def pop(calendar):
    """Drop the first entry of the heap."""
    control = calendar.control[0]
    event_time, component = calendar.event_time, calendar.component
    control.waiting -= 1
    size = control.waiting
    time = event_time[size]
    i = component[size]
    k = 0
    child = 1
    while child < size:
        right = child + 1
        if right < size and (
            event_time[right] < event_time[child]
            or (event_time[right] == event_time[child] and component[right] < component[child])
        ):
            child = right
        if time < event_time[child] or (time == event_time[child] and i <= component[child]):
            break
        event_time[k] = event_time[child]
        component[k] = component[child]
        k = child
        child = (k << 1) + 1
    event_time[k] = time
    component[k] = i


def buckets_in_window(calendar):
    """Return how many buckets cover the window: the number of the one that takes what is due later."""
    return len(calendar.buckets) - 1


def bucket_of(calendar, time):
    """Return the bucket of a time inside the window."""
    control = calendar.control[0]
    return min(int((time - control.start) * control.inverse), buckets_in_window(calendar) - 1)


def insert(calendar, i, time):
    """Enter component i at ``time``."""
    if calendar.send_if_remote(i, time):
        return
    control = calendar.control[0]
    inside = time < control.end
    bucket = bucket_of(calendar, time if inside else control.start)
    bucket = bucket if inside else buckets_in_window(calendar)
    calendar.note_border_event(bucket, time, i)
    if bucket <= control.cursor:
        push(calendar, time, np.int32(i))
    else:
        append(calendar, bucket, np.uint32(i))


def prefetch_calendar(calendar, state, boundary, ref):
    """Ask for what an event of ``ref`` will touch: its partner, and the bucket of that one's event."""
    if ref >= 0 and len(state.partner) >= HUGE:
        j = boundary.index(ref)
        prefetch(state.partner, j)
        event_time = np.float64(state.rows[j].event_time)
        if event_time < calendar.control[0].end:
            prefetch(calendar.buckets, bucket_of(calendar, event_time) * calendar.buckets.shape[1])


def append(calendar, bucket, i):
    """Append an entry to a bucket that lies ahead, or to that of what is due beyond the window."""
    control = calendar.control[0]
    buckets = calendar.buckets
    count = buckets[bucket, 0]
    if count == ENTRIES and bucket == buckets_in_window(calendar):
        count = np.uint32(0)  # nobody reads it
    elif count == ENTRIES:
        line = control.lines
        if line == len(calendar.lines):
            control.full = 1  # the entry is lost, and found again when the window is laid out anew
            return
        control.lines += 1
        for k in range(1, 16):
            calendar.lines[line, k] = buckets[bucket, k]
        buckets[bucket, 1] = line
        count = np.uint32(0)
    buckets[bucket, count + 2] = i
    buckets[bucket, 0] = count + np.uint32(1)


@cold
def open_bucket(calendar, state, bucket):
    """Move the valid entries of a bucket to the heap; return False, and do nothing, if it has no room."""
    control = calendar.control[0]
    buckets = calendar.buckets
    count = buckets[bucket, 0]
    link = buckets[bucket, 1]
    total = count
    while link > 0:
        total += ENTRIES
        link = calendar.lines[link, 1]
    if control.waiting + total + MOST_NEW_ENTRIES > len(calendar.event_time):
        return False
    for k in range(count):
        push_if_due(calendar, state, bucket, buckets[bucket, k + 2])
    link = buckets[bucket, 1]
    while link > 0:
        for k in range(ENTRIES):
            push_if_due(calendar, state, bucket, calendar.lines[link, k + 2])
        link = calendar.lines[link, 1]
    return True


def push_if_due(calendar, state, bucket, i):
    """Push component i if it is due in this bucket."""
    time = time_of(state, i)
    if time < calendar.control[0].end and bucket_of(calendar, time) <= bucket:
        push(calendar, time, np.int32(i))


@cold
def fill_window(calendar, state, boundary, start, end):
    """Begin a window up to ``end`` at most, enter all that is due in it, and return the earliest time due.

    Where lines run out, buckets become narrower. If too many are due at one time that does not help: ``full``
    is set, and entries are missing until the calendar has more room.
    """
    control = calendar.control[0]
    size = buckets_in_window(calendar)
    if control.full != 0:
        calendar.narrow(end)  # more came into the window before than its lines could hold
    while True:
        control.start = start
        control.end = min(start + size * control.width, end)
        control.inverse = 1.0 / control.width
        control.cursor = -1
        control.waiting = 0
        control.lines = 1
        control.full = 0
        control.cycles = 0
        for b in range(size + 1):
            calendar.buckets[b, 0] = 0
            calendar.buckets[b, 1] = 0
        calendar.clear_notes()
        earliest = NEVER
        n = len(state.partner)
        for start_index in range(0, n, BLOCK):
            earliest = min(earliest, choose_due(calendar, state, start_index, min(start_index + BLOCK, n)))
            choose_entering(calendar, state, boundary)
            count = control.waiting
            control.waiting = 0
            for k in range(count):
                insert(calendar, calendar.component[k], calendar.event_time[k])
        if control.full == 0 or not calendar.narrow(end):
            return earliest


def crowded(calendar):
    """Return whether a window has too few lines: entries are missing, or will be after a few events."""
    return 2 * calendar.control[0].lines > len(calendar.lines)


def cluttered(calendar, state):
    """Return whether the heap has room for everybody twice: most of it is stale until the next window."""
    return len(calendar.event_time) > 2 * len(state.partner) + BLOCK


def effort(state):
    """Return how many cycles take about as long as laying out a window, which looks at everybody."""
    return 1 + (len(state.partner) >> 8)


def choose_due(calendar, state, start_index, end):
    """Put those of a block that are due on the heap, without a branch; return the earliest time due."""
    event_time, component = calendar.event_time, calendar.component
    until = calendar.control[0].end
    earliest = NEVER
    count = 0
    for k in range(calendar.count_local(start_index, end)):
        i = calendar.local_component(start_index, k)
        time = time_of(state, i)
        earliest = min(earliest, time)
        event_time[count] = time
        component[count] = i
        count += time < until
    calendar.control[0].waiting = count
    return earliest


def choose_entering(calendar, state, boundary):
    """Keep those that enter the calendar, of a pair one if it is there to collide; ask for their buckets."""
    event_time, component = calendar.event_time, calendar.component
    count = 0
    for k in range(calendar.control[0].waiting):
        i, time = component[k], event_time[k]
        ref = state.partner[i]
        j = boundary.index(ref) if ref >= 0 else i
        enters = (
            (j >= i)
            | (time == state.crossing_time[i])
            | (state.crossing_time[j] < time)
            | calendar.is_remote(j)
        )
        event_time[count] = time
        component[count] = i
        count += enters
        if len(state.partner) >= HUGE:
            prefetch(calendar.buckets, bucket_of(calendar, time) * calendar.buckets.shape[1])
    calendar.control[0].waiting = count


def next_event(calendar, state, neighbors, boundary, motion):
    """Return who is first, and stays on the heap; -1 at the window's end, -2 if an array is too small."""
    control = calendar.control[0]
    while True:
        while control.waiting > 0:
            i = int(calendar.component[0])
            if time_of(state, i) == calendar.event_time[0]:
                return i
            pop(calendar)
        if control.cursor + 1 >= buckets_in_window(calendar):
            return -1
        if not open_bucket(calendar, state, control.cursor + 1):
            return -2
        control.cursor += 1
        if len(state.partner) >= LARGE:
            prefetch_next(calendar, state, neighbors, boundary, motion)
