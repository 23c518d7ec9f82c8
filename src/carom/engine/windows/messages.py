"""Messages between parts: what one schedules for a component of another, and the locks of borders."""

from __future__ import annotations

import numpy as np

from carom.compiling.atomics import load, store
from carom.compiling.registry import inner
from carom.engine.calendar import ROOM, insert, time_of
from carom.engine.company import absent, collect, own, own_in, sent
from carom.engine.windows.desk import (
    BUSY,
    FAR,
    LINE,
    MAIL,
    PartCalendar,
    beside,
    border,
    mask_of,
    slot_of,
    stop_all,
)
from carom.engine.windows.slabs import LOWER, OUTER, OWN, RIM, ZONES


@absent.register
def _(calendar: PartCalendar, i):
    return mask_of(calendar, i) & OWN == 0


@own_in.register
def _(calendar: PartCalendar, begin, end):
    # Rows of others are not looked at: half of the memory that two parts would ask for.
    count = np.uint64(0)
    for i in range(begin, end):
        calendar.who[count] = i
        count += np.uint64(mask_of(calendar, i) & OWN != 0)
    return count


@own.register
def _(calendar: PartCalendar, begin, k):
    return np.uint64(calendar.who[k])


@sent.register
def _(calendar: PartCalendar, i, time):
    desk, board = calendar.desk[0], calendar.board
    if desk.locked & FAR != 0:
        return False
    mask = mask_of(calendar, np.uint64(i))
    foreign = mask & OWN == 0
    if desk.locked & BUSY != 0:
        held = mask & ZONES & desk.locked != 0
        inside = held and mask & OUTER != 0 if foreign else held or mask & RIM == 0
        if not inside:
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
        while desk.read[slot] != count and control.waiting + ROOM <= len(calendar.due):
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
