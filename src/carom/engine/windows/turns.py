"""Whose turn it is: parts that share one state process what both can touch in the order of time.

Every part has a calendar of its own, and runs ahead in the middle of its slab. An event that touches what
another part can touch, too, is in the *zone* of their border. It waits until the other part has nothing
earlier there, and holds the lock of the border meanwhile. What a part schedules for a component of another
goes there as a message.

Whether something earlier will turn up at the border is not known. Every border, and every part, remembers its
last events. Where one is processed that would have had to come before one of them nearby, the window is lost,
and is run again from its beginning.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.atomics import let_others, load, store, take
from carom.compiling.registry import inner
from carom.engine.calendar import (
    ENTRIES,
    ROOM,
    adapt,
    bucket_of,
    buckets_in_window,
    insert,
    pop,
    time_of,
)
from carom.engine.company import absent, announce, collect, granted, mark, marks_forgotten, sent, weary
from carom.engine.images import index
from carom.engine.neighbors.prefetch import leaves_first
from carom.engine.windows.slabs import (
    ANNOUNCED,
    HEEDED,
    LOWER,
    OWN,
    RECALLED,
    RIM,
    STRIPS,
    ZONES,
    apart_by,
    layer_of,
)
from carom.models.interface import NEVER

MAIL = 256
"""Messages that may be on their way to a part from one side; a power of two."""

PAST = 128
"""Events that a part, and a border, remember; a power of two."""

NOTES = 64
"""Events in a zone that a part announces."""

HORIZON = 16
"""Buckets in which a part looks for such events in advance."""

TIRED = 1 << 20
"""Refusals after which a thread asks whether all are to stop."""

BUSY, FAR = 4, 8
"""What ``locked`` has in addition while an event is processed, and if it is far away from all borders: what
it touches is the part's own, and concerns nobody else.
"""

LINE = 8
"""Words of a cache line."""

DESK = np.dtype(
    [
        ("me", "i8"),
        ("parts", "i8"),
        ("axis", "i8"),
        ("along", "i8"),
        ("lead", "f8"),
        ("patience", "i8"),
        ("locked", "i8"),
        ("refused", "i8"),
        ("passed", "i8"),
        ("latest", "f8"),
        ("told", "f8"),
        ("seen", "f8"),
        ("sight", "f8"),
        ("fresh", "i8"),
        ("frontier", "i8"),
        ("unnoted", "f8"),
        ("noted", "i8", (2,)),
        ("written", "i8", (2,)),
        ("read", "i8", (2,)),
        ("unread", "f8", (2,)),
    ]
)
"""What one part knows of itself.

``me``: its number of ``parts``; ``axis`` and ``along``: as in ``Slabs``; ``lead``: widths of a bucket that it
may be ahead of others; ``patience``: refusals after which it lets another thread have the core; ``locked``:
borders that it holds; ``refused``: how often in a row; ``passed``: events noted, and ``latest`` the time of
the latest; ``told`` and ``sight``: what it has announced; ``fresh``: it has read messages and not said so;
``frontier``: last bucket looked into, and ``seen`` its end; ``unnoted``: time of an event that it had no room
for. Of each side: ``noted`` events; messages ``written`` and ``read``; the time of the earliest that may be
``unread``.
"""


class Board(NamedTuple):
    """What parts tell each other; each writes on cache lines of its own."""

    clocks: np.ndarray
    """Of each part: nothing is due before this time, and nothing that it has not announced before that one,
    (parts, 8) float64.
    """
    inbox: np.ndarray
    """Messages sent to each part from below and from above, and whether all are to stop, (parts, 8) int64."""
    taken: np.ndarray
    """Messages that each part has read, (parts, 8) int64."""
    mail: np.ndarray
    """The messages: components that are due, (parts, 2, MAIL) int32."""
    locks: np.ndarray
    """Whether somebody holds the border below each part, and the events in its zone, (parts, 8) int64."""
    times: np.ndarray
    """Times of the last of them, (parts, PAST) float64."""
    highest: np.ndarray
    """The latest time of each and those before it, (parts, PAST) float64."""
    whose: np.ndarray
    """Part that each belonged to, (parts, PAST) int64."""
    places: np.ndarray
    """Layers that they were in, (parts, PAST, d) int64."""
    due: np.ndarray
    """Earliest event announced in each strip of both borders, (parts, 2, STRIPS) float64."""


class PartCalendar(NamedTuple):
    """The calendar of a part: the first five as those of a ``Calendar``."""

    control: Any
    buckets: np.ndarray
    lines: np.ndarray
    due: np.ndarray
    who: np.ndarray
    neighbors: Any
    """The neighbour scheme, which says where components are."""
    desk: Any
    """One record of type DESK."""
    board: Board
    mask: np.ndarray
    """What each layer is to the part, (layers,) uint8."""
    strips: np.ndarray
    """Strip of each layer along the other axis, (layers,) int64."""
    layers: np.ndarray
    """Layers along each axis, (d,) int64."""
    near: np.ndarray
    """Layers between two events up to which they may touch the same, (d,) int64."""
    times: np.ndarray
    """Times of the last events, (PAST,) float64."""
    places: np.ndarray
    """Layers that they were in, (PAST, d) int64."""
    notes: np.ndarray
    """Times of the events announced on each side, (2, NOTES) float64."""
    where: np.ndarray
    """Their strips, (2, NOTES) int64."""
    flags: np.ndarray
    """Whether a bucket may hold one, (buckets,) uint8."""


@inner
def mask_of(calendar, i):
    """Return what the layer of component i is to this part."""
    return np.int64(calendar.mask[layer_of(calendar.neighbors, i, calendar.desk[0].axis)])


@inner
def beside(desk, side):
    """Return the part below (side 0) or above (1)."""
    other = desk.me + 2 * side - 1
    return other + desk.parts if other < 0 else (other - desk.parts if other >= desk.parts else other)


@inner
def slot_of(desk, side):
    """Return which messages are those from or to the part on a side: of two parts, all are from below."""
    return np.int64(0 if desk.parts == 2 else side)


@inner
def border(desk, side):
    """Return where the lock of the border on a side is."""
    return np.int64(LINE) * np.int64(desk.me if side == 0 else beside(desk, np.int64(1)))


@inner
def stop_all(calendar):
    """Tell all parts that the window is lost."""
    for part in range(calendar.desk[0].parts):
        store(calendar.board.inbox, LINE * part + 2, np.int64(1))


# Messages ---------------------------------------------------------------------------------------------------


@absent.register
def _(calendar: PartCalendar, i):
    return mask_of(calendar, i) & OWN == 0


@sent.register
def _(calendar: PartCalendar, i, time):
    desk, board = calendar.desk[0], calendar.board
    if desk.locked & FAR != 0:
        return False
    mask = mask_of(calendar, np.uint64(i))
    foreign = mask & OWN == 0
    if desk.locked & BUSY != 0 and (foreign or mask & RIM != 0) and mask & ZONES & desk.locked == 0:
        stop_all(calendar)  # further away than an event should reach: somebody else may be at it
    if not foreign:
        return False
    side = np.int64(0 if mask & LOWER != 0 else 1)
    slot, other = slot_of(desk, side), beside(desk, side)
    back = slot_of(desk, 1 - side)
    k = desk.written[np.uint64(slot)]
    board.mail[np.uint64(other), np.uint64(back), np.uint64(k & (MAIL - 1))] = i
    desk.written[np.uint64(slot)] = k + 1
    desk.unread[np.uint64(slot)] = min(desk.unread[np.uint64(slot)], time)
    store(board.inbox, LINE * other + back, k + 1)
    return True


@collect.register
def _(calendar: PartCalendar, state):
    desk, board, control = calendar.desk[0], calendar.board, calendar.control[0]
    if desk.locked & ZONES != 0:
        unlock(calendar)
    desk.locked = 0
    for slot in range(2):
        count = load(board.inbox, LINE * desk.me + slot)
        while desk.read[slot] != count and control.waiting + ROOM < len(calendar.due):
            i = board.mail[np.uint64(desk.me), slot, np.uint64(desk.read[slot] & (MAIL - 1))]
            desk.read[slot] += 1
            desk.fresh = 1
            insert(calendar, np.uint64(i), time_of(state, np.uint64(i)))


@inner
def unlock(calendar):
    """Let others have the borders that this part holds."""
    desk = calendar.desk[0]
    for side in range(2):
        if desk.locked & (side + 1) != 0:
            store(calendar.board.locks, border(desk, np.int64(side)), np.int64(0))
    desk.locked = 0


# What is to come --------------------------------------------------------------------------------------------


@inner
def note(calendar, side, time, i):
    """Announce an event of component i at a border."""
    desk = calendar.desk[0]
    k = np.uint64(desk.noted[side])
    if k == NOTES:
        desk.unnoted = min(desk.unnoted, time)
        return
    strip = calendar.strips[layer_of(calendar.neighbors, i, desk.along)]
    calendar.notes[side, k] = time
    calendar.where[side, k] = strip
    desk.noted[side] += 1
    at = (2 * desk.me + side) * STRIPS + strip
    if time < load(calendar.board.due, at):
        store(calendar.board.due, at, np.float64(time))


@inner
def strike_out(calendar, side, now):
    """Withdraw what was announced at a border before now."""
    desk = calendar.desk[0]
    notes, where = calendar.notes, calendar.where
    k = np.int64(0)
    while k < desk.noted[side]:
        if notes[side, k] >= now:
            k += 1
            continue
        desk.noted[side] -= 1
        last = np.uint64(desk.noted[side])
        strip = where[side, k]
        notes[side, k] = notes[side, last]
        where[side, k] = where[side, last]
        earliest = np.float64(NEVER)
        for other in range(last):
            here = where[side, other] == strip and notes[side, other] >= now
            earliest = min(earliest, notes[side, other]) if here else earliest
        store(calendar.board.due, (2 * desk.me + side) * STRIPS + strip, earliest)


@inner
def note_both(calendar, time, i, mask):
    """Announce an event of component i at the borders that it may reach."""
    for side in range(2):
        if mask & (HEEDED * (side + 1)) != 0:
            note(calendar, side, time, i)


@mark.register
def _(calendar: PartCalendar, bucket, time, i):
    if calendar.desk[0].locked & FAR != 0:
        return
    mask = mask_of(calendar, np.uint64(i))
    if mask & ANNOUNCED != 0:
        if bucket > calendar.desk[0].frontier:
            calendar.flags[np.uint64(bucket)] = 1
        else:
            note_both(calendar, time, np.uint64(i), mask)


@marks_forgotten.register
def _(calendar: PartCalendar):
    desk = calendar.desk[0]
    calendar.flags[:] = 0
    desk.frontier = -1
    desk.seen = desk.told
    desk.unnoted = NEVER
    desk.sight = desk.told  # nothing is announced any more
    store(calendar.board.clocks, LINE * desk.me + 1, np.float64(desk.sight))
    for side in range(2):
        desk.noted[side] = 0
        for strip in range(STRIPS):
            store(calendar.board.due, (2 * desk.me + side) * STRIPS + strip, np.float64(NEVER))


@inner
def look_into_bucket(calendar, state, bucket):
    """Announce what a bucket holds at the borders."""
    buckets = calendar.buckets
    for k in range(np.uint64(buckets[bucket, 0])):
        look_at(calendar, state, bucket, np.uint64(buckets[bucket, k + np.uint64(2)]))
    link = buckets[bucket, 1]
    while link > 0:
        for k in range(np.uint64(ENTRIES)):
            look_at(calendar, state, bucket, np.uint64(calendar.lines[link, k + np.uint64(2)]))
        link = calendar.lines[link, 1]


@inner
def look_at(calendar, state, bucket, i):
    """Announce component i, if it is due in this bucket and at a border."""
    mask = mask_of(calendar, i)
    time = time_of(state, i)
    inside = time < calendar.control[0].end and bucket_of(calendar, time) <= np.int64(bucket)
    if inside and mask & ANNOUNCED != 0 and mask & OWN != 0:
        note_both(calendar, time, i, mask)


@announce.register
def _(calendar: PartCalendar, state, time):
    desk, control, clocks = calendar.desk[0], calendar.control[0], calendar.board.clocks
    if desk.told != time or desk.fresh != 0:
        desk.told = time
        last = buckets_in_window(calendar) - 1
        target = min(last, control.cursor + HORIZON)
        if desk.frontier < target:
            while desk.frontier < target and max(desk.noted[0], desk.noted[1]) < NOTES // 2:
                desk.frontier += 1
                if calendar.flags[np.uint64(desk.frontier)] != 0:
                    look_into_bucket(calendar, state, np.uint64(desk.frontier))
            seen = control.start + (desk.frontier + 1) * control.width
            desk.seen = control.end if desk.frontier == last else min(seen, control.end)
        desk.unnoted = NEVER if desk.unnoted < time else desk.unnoted
        sight = max(min(desk.seen, desk.unnoted), time)
        if sight != desk.sight:
            desk.sight = sight
            store(clocks, LINE * desk.me + 1, np.float64(sight))
        store(clocks, LINE * desk.me, np.float64(time))
        for side in range(2):
            if desk.noted[side] != 0:
                strike_out(calendar, side, time)
    if desk.fresh != 0:
        desk.fresh = 0
        for slot in range(2):
            store(calendar.board.taken, LINE * desk.me + slot, desk.read[slot])


@adapt.register
def _(calendar: PartCalendar, n, longest):
    """All parts lay out their calendars at the same times: nobody waits for another that does."""
    return


# Whose turn it is -------------------------------------------------------------------------------------------


@inner
def nothing_before(calendar, side, now, i):
    """Return whether the part on a side has nothing before now that may touch what an event of component i
    does.
    """
    desk, board = calendar.desk[0], calendar.board
    other = beside(desk, side)
    slot = slot_of(desk, side)
    if desk.unread[np.uint64(slot)] < NEVER:
        read = load(board.taken, LINE * other + slot_of(desk, 1 - side))
        if read == desk.written[np.uint64(slot)]:
            desk.unread[np.uint64(slot)] = NEVER
        elif desk.unread[np.uint64(slot)] <= now or desk.written[np.uint64(slot)] - read > MAIL // 2:
            return False
    clock = load(board.clocks, LINE * other)
    if clock > now or (clock == now and desk.me < other):
        return True
    late = clock + desk.lead * calendar.control[0].width <= now
    if late or load(board.clocks, LINE * other + 1) <= now:
        return False
    strip = calendar.strips[layer_of(calendar.neighbors, i, desk.along)]
    count = calendar.strips[np.uint64(len(calendar.strips) - 1)] + 1
    for k in range(3):
        at = strip + k - 1
        at = at + count if at < 0 else (at - count if at >= count else at)
        if load(board.due, (2 * other + 1 - side) * STRIPS + at) <= now:
            return False
    return True


@inner
def near_to(calendar, places, k, i):
    """Return whether component i is near the k-th place."""
    for axis in range(places.shape[1]):
        layer = layer_of(calendar.neighbors, i, axis)
        if apart_by(layer, places[k, axis], calendar.layers[axis]) > calendar.near[axis]:
            return False
    return True


@inner
def put_place(calendar, places, k, i):
    """Note where component i is as the k-th place."""
    for axis in range(places.shape[1]):
        places[k, axis] = layer_of(calendar.neighbors, i, axis)


@inner
def borders_of(calendar, state, boundary, i):
    """Return the borders in whose zones the event of component i is."""
    mask = mask_of(calendar, i)
    word = np.int64(state.partner[i])
    if word >= 0 and not leaves_first(state, i):
        mask |= mask_of(calendar, np.uint64(index(boundary, word)))
    return mask & ZONES


@inner
def hold(calendar, state, boundary, i, now, borders):
    """Take the locks of borders, and return whether the event of component i is still what it was."""
    desk, board = calendar.desk[0], calendar.board
    for side in range(2):
        if borders & (side + 1) != 0:
            if take(board.locks, border(desk, np.int64(side))) != 0:
                return False
            desk.locked |= side + 1
    # All that others have sent is on its way by now.
    for slot in range(2):
        if load(board.inbox, LINE * desk.me + slot) != desk.read[slot]:
            return False
    still = mask_of(calendar, i) & OWN != 0 and time_of(state, i) == now
    return still and borders_of(calendar, state, boundary, i) & ~borders == 0


@inner
def in_order(calendar, side, i, now):
    """Return whether nothing later was processed near component i at a border, by others; and note it."""
    desk, board = calendar.desk[0], calendar.board
    at = border(desk, np.int64(side))
    b = np.uint64(at // LINE)
    count = board.locks[b, 1]
    highest = -NEVER
    for back in range(min(count, PAST)):
        past = np.uint64((count - 1 - back) & (PAST - 1))
        highest = max(highest, board.highest[b, past])
        if board.highest[b, past] < now:
            break
        later = board.times[b, past] >= now and board.whose[b, past] != desk.me
        if (later and near_to(calendar, board.places[b], past, i)) or back == PAST - 1:
            return False
    k = np.uint64(count & (PAST - 1))
    board.locks[b, 1] = count + 1
    board.highest[b, k] = max(highest, now)
    board.times[b, k] = now
    board.whose[b, k] = desk.me
    put_place(calendar, board.places[b], k, i)
    return True


@inner
def in_own_order(calendar, i, now):
    """Return whether this part has processed nothing later near component i; and note it.

    Late can be only what follows from an event of another part.
    """
    desk = calendar.desk[0]
    k = np.uint64(desk.passed & (PAST - 1))
    if now < desk.latest:
        # What was far from all borders is not remembered, and may concern those that are not near one.
        if mask_of(calendar, i) & ANNOUNCED == 0 or calendar.times[k] > now:
            return False
        for past in range(np.uint64(PAST)):
            if calendar.times[past] > now and near_to(calendar, calendar.places, past, i):
                return False
    desk.latest = max(desk.latest, now)
    desk.passed += 1
    calendar.times[k] = now
    put_place(calendar, calendar.places, k, i)
    return True


@granted.register
def _(calendar: PartCalendar, state, boundary, i, now):
    desk = calendar.desk[0]
    desk.refused += 1
    mask = mask_of(calendar, i)
    if mask & (OWN | RECALLED) == OWN and now >= desk.latest:
        desk.latest = now
        desk.refused = 0
        desk.locked = BUSY | FAR
        return True
    if mask & OWN == 0:  # it has gone over to another part, which knows of it
        pop(calendar)
        return False
    borders = borders_of(calendar, state, boundary, i)
    if borders != 0:
        for side in range(2):
            if borders & (side + 1) != 0 and not nothing_before(calendar, np.int64(side), now, i):
                return False
        if not hold(calendar, state, boundary, i, now, borders):
            return False
        for side in range(2):
            if borders & (side + 1) != 0 and not in_order(calendar, side, i, now):
                stop_all(calendar)
                return False
    if not in_own_order(calendar, i, now):
        stop_all(calendar)
        return False
    desk.refused = 0
    desk.locked |= BUSY
    return True


@weary.register
def _(calendar: PartCalendar):
    desk = calendar.desk[0]
    if desk.refused % desk.patience == 0:
        if desk.locked != 0:
            unlock(calendar)
        let_others()
    stopped = load(calendar.board.inbox, LINE * desk.me + 2) != 0
    if stopped or desk.refused >= TIRED:
        desk.refused = 0
        return True
    return False
