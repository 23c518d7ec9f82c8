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

import numpy as np

from carom.compiling.atomics import let_others, load, take
from carom.compiling.registry import inner
from carom.engine.calendar import pop, time_of
from carom.engine.company import granted, weary
from carom.engine.images import index
from carom.engine.neighbors.prefetch import leaves_first
from carom.engine.windows.desk import (
    BUSY,
    FAR,
    LATEST,
    LINE,
    MAIL,
    PAST,
    PLACE,
    TIME,
    WHOSE,
    PartCalendar,
    beside,
    border,
    mask_of,
    patch_at,
    row_of,
    slot_of,
    stop_all,
)
from carom.engine.windows.messages import unlock
from carom.engine.windows.slabs import ANNOUNCED, OWN, RECALLED, ZONES, apart_by, layer_of
from carom.models.interface import NEVER

TIRED = 1 << 20
"""Refusals after which a thread asks whether all are to stop."""


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
    rows, columns = calendar.patches[0], calendar.patches[1]
    row, column = row_of(calendar, i, 0), row_of(calendar, i, 1)
    for above in range(min(rows, 3)):
        for beyond in range(min(columns, 3)):
            near = patch_at(
                calendar, 1 - side, other, around(row + above - 1, rows), around(column + beyond - 1, columns)
            )
            if load(board.due, near) <= now:
                return False
    return True


@inner
def around(k, count):
    """Return k, which may be one too low or too high, within a ring of so many."""
    return k + count if k < 0 else (k - count if k >= count else k)


@inner
def near_to(calendar, past, k, i):
    """Return whether component i is near the k-th event that is remembered."""
    for axis in range(len(calendar.layers)):
        layer = layer_of(calendar.neighbors, i, axis)
        if apart_by(layer, np.int64(past[k, PLACE + axis]), calendar.layers[axis]) > calendar.near[axis]:
            return False
    return True


@inner
def remember(calendar, past, k, i, now, latest):
    """Remember the event of component i now as the k-th."""
    past[k, TIME] = now
    past[k, LATEST] = latest
    past[k, WHOSE] = calendar.desk[0].me
    for axis in range(len(calendar.layers)):
        past[k, PLACE + axis] = layer_of(calendar.neighbors, i, axis)


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
    past = board.past[b]
    latest = now
    for back in range(min(count, PAST)):
        k = np.uint64((count - 1 - back) & (PAST - 1))
        latest = max(latest, past[k, LATEST])
        if past[k, LATEST] < now:
            break
        later = past[k, TIME] >= now and past[k, WHOSE] != desk.me
        if (later and near_to(calendar, past, k, i)) or back == PAST - 1:
            return False
    board.locks[b, 1] = count + 1
    remember(calendar, past, np.uint64(count & (PAST - 1)), i, now, latest)
    return True


@inner
def in_own_order(calendar, i, now):
    """Return whether this part has processed nothing later near component i; and note it.

    Late can be only what follows from an event of another part.
    """
    desk, past = calendar.desk[0], calendar.past
    place = np.uint64(desk.passed & (PAST - 1))
    if now < desk.latest:
        # What was far from all borders is not remembered, and may concern those that are not near one.
        if mask_of(calendar, i) & ANNOUNCED == 0 or past[place, TIME] > now:
            return False
        for k in range(np.uint64(PAST)):
            if past[k, TIME] > now and near_to(calendar, past, k, i):
                return False
        desk.late += 1
    desk.latest = max(desk.latest, now)
    desk.passed += 1
    remember(calendar, past, place, i, now, desk.latest)
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
