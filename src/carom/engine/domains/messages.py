"""Messages between processes: what one schedules for a component of another, and the locks of borders."""

from __future__ import annotations

from carom.compiling.instructions import load, store
from carom.engine.calendar import (
    MOST_NEW_ENTRIES,
    count_local,
    insert,
    is_remote,
    local_component,
    receive,
    send_if_remote,
    time_of,
)
from carom.engine.domains.decomposition import BORDER_BELOW, BORDERS, OWN, READ_HALO, WRITE_HALO
from carom.engine.domains.lp_state import (
    INTERIOR,
    LINE,
    MOST_MESSAGES,
    PROCESSING,
    LpQueue,
    abort_window,
    beside,
    border,
    mask_of,
    slot_of,
)


@is_remote.register
def _is_remote_of_lp(calendar: LpQueue, i):
    return mask_of(calendar, i) & OWN == 0


@count_local.register
def _count_local_of_lp(calendar: LpQueue, start_index, end):
    # Rows of others are not looked at: half of the memory that two processes would ask for.
    count = 0
    for i in range(start_index, end):
        calendar.component[count] = i
        count += mask_of(calendar, i) & OWN != 0
    return count


@local_component.register
def _local_component_of_lp(calendar: LpQueue, start_index, k):
    return calendar.component[k]


@send_if_remote.register
def _send_if_remote_of_lp(calendar: LpQueue, i, time):
    lp, channels = calendar.lp[0], calendar.channels
    if lp.held_borders & INTERIOR != 0:
        return False
    mask = mask_of(calendar, i)
    foreign = mask & OWN == 0
    if lp.held_borders & PROCESSING != 0:
        held = mask & BORDERS & lp.held_borders != 0
        inside = held and mask & WRITE_HALO != 0 if foreign else held or mask & READ_HALO == 0
        if not inside:
            abort_window(calendar)  # further away than an event should reach: somebody else may be at it
    if not foreign:
        return False
    side = 0 if mask & BORDER_BELOW != 0 else 1
    slot, other = slot_of(lp, side), beside(lp, side)
    back = slot_of(lp, 1 - side)
    k = lp.written[slot]
    channels.messages[other, back, k & (MOST_MESSAGES - 1)] = i
    lp.written[slot] = k + 1
    lp.unread[slot] = min(lp.unread[slot], time)
    store(channels.sent_count, LINE * other + back, k + 1)
    return True


@receive.register
def _receive_of_lp(calendar: LpQueue, state):
    lp, channels, control = calendar.lp[0], calendar.channels, calendar.control[0]
    if lp.held_borders & BORDERS != 0:
        unlock(calendar)
    lp.held_borders = 0
    for slot in range(2):
        count = load(channels.sent_count, LINE * lp.me + slot)
        while lp.read[slot] != count and control.waiting + MOST_NEW_ENTRIES <= len(calendar.event_time):
            i = channels.messages[lp.me, slot, lp.read[slot] & (MOST_MESSAGES - 1)]
            lp.read[slot] += 1
            lp.unacknowledged = 1
            insert(calendar, i, time_of(state, i))


def unlock(calendar):
    """Let others have the borders that this process holds."""
    lp = calendar.lp[0]
    for side in range(2):
        if lp.held_borders & (side + 1) != 0:
            store(calendar.channels.border_locks, border(lp, side), 0)
    lp.held_borders = 0
