"""Whose turn it is: processes that share one state process what both can touch in the order of time.

Each runs ahead in the middle of its slab by its own calendar. An event in the *zone* of a border waits until
the other process has nothing earlier there, and holds the border's lock. What is scheduled for another's
component is sent as a message. Borders and processes remember their last events: one that comes too late for
those, a straggler, rolls the window back (:mod:`.rollback`).
"""

from __future__ import annotations

from carom.compiling.instructions import load, take
from carom.engine.calendar import time_of
from carom.engine.domains.decomposition import ANNOUNCED, BORDERS, OWN, layers_apart
from carom.engine.domains.lp_state import (
    HISTORY_LENGTH,
    LATEST,
    LINE,
    MOST_MESSAGES,
    PLACE,
    TIME,
    WHOSE,
    beside,
    border,
    mask_of,
    patch_at,
    row_of,
    slot_of,
)
from carom.engine.neighbors.prefetch import leaves_first
from carom.models.interfaces.particles import NEVER

MOST_WAITS = 1 << 20  # refusals after which a thread asks whether all are to stop


def no_earlier_event(calendar, side, now, i):
    """Return whether the process on a side has nothing before now that may touch what an event of i does."""
    lp, channels = calendar.lp[0], calendar.channels
    other = beside(lp, side)
    slot = slot_of(lp, side)
    if lp.unread[slot] < NEVER:
        read = load(channels.acknowledged, LINE * other + slot_of(lp, 1 - side))
        if read == lp.written[slot]:
            lp.unread[slot] = NEVER
        elif lp.unread[slot] <= now or lp.written[slot] - read > MOST_MESSAGES // 2:
            return False
    safe_time = load(channels.published_time, LINE * other)
    if safe_time > now or (safe_time == now and lp.me < other):
        return True
    too_far = safe_time + lp.time_window * calendar.control[0].width <= now
    if too_far or load(channels.published_time, LINE * other + 1) <= now:
        return False
    rows, columns = calendar.patches[0], calendar.patches[1]
    patch_row, column = row_of(calendar, i, 0), row_of(calendar, i, 1)
    for above in range(min(rows, 3)):
        for beyond in range(min(columns, 3)):
            facing = patch_at(
                calendar,
                1 - side,
                other,
                around(patch_row + above - 1, rows),
                around(column + beyond - 1, columns),
            )
            if load(channels.event_time, facing) <= now:
                return False
    return True


def around(k, count):
    """Return k, which may be one too low or too high, within a ring of so many."""
    return k + count if k < 0 else (k - count if k >= count else k)


def near_to(calendar, history, k, i):
    """Return whether component i is near the k-th event that is remembered."""
    for axis in range(len(calendar.layers)):
        layer = calendar.neighbors.layer_of(i, axis)
        if (
            layers_apart(layer, int(history[k, PLACE + axis]), calendar.layers[axis])
            > calendar.conflict_range[axis]
        ):
            return False
    return True


def record_history(calendar, history, k, i, now, local_time):
    """Remember the event of component i now as the k-th."""
    history[k, TIME] = now
    history[k, LATEST] = local_time
    history[k, WHOSE] = calendar.lp[0].me
    for axis in range(len(calendar.layers)):
        history[k, PLACE + axis] = calendar.neighbors.layer_of(i, axis)


def borders_of(calendar, state, boundary, i):
    """Return the borders in whose zones the event of component i is."""
    mask = mask_of(calendar, i)
    ref = state.partner[i]
    if ref >= 0 and not leaves_first(state, i):
        mask |= mask_of(calendar, boundary.index(ref))
    return mask & BORDERS


def lock_borders(calendar, state, boundary, i, now, borders):
    """Take the locks of borders, and return whether the event of component i is still what it was."""
    lp, channels = calendar.lp[0], calendar.channels
    for side in range(2):
        if borders & (side + 1) != 0:
            if take(channels.border_locks, border(lp, side)) != 0:
                return False
            lp.held_borders |= side + 1
    # All that others have sent is on its way by now.
    for slot in range(2):
        if load(channels.sent_count, LINE * lp.me + slot) != lp.read[slot]:
            return False
    still = mask_of(calendar, i) & OWN != 0 and time_of(state, i) == now
    return still and borders_of(calendar, state, boundary, i) & ~borders == 0


def no_straggler_at_border(calendar, side, i, now):
    """Return whether nothing later was processed near component i at a border, by others; and note it."""
    lp, channels = calendar.lp[0], calendar.channels
    at = border(lp, side)
    b = at // LINE
    count = channels.border_locks[b, 1]
    history = channels.history[b]
    local_time = now
    for back in range(min(count, HISTORY_LENGTH)):
        k = (count - 1 - back) & (HISTORY_LENGTH - 1)
        local_time = max(local_time, history[k, LATEST])
        if history[k, LATEST] < now:
            break
        later = history[k, TIME] >= now and history[k, WHOSE] != lp.me
        if (later and near_to(calendar, history, k, i)) or back == HISTORY_LENGTH - 1:
            return False
    channels.border_locks[b, 1] = count + 1
    record_history(calendar, history, count & (HISTORY_LENGTH - 1), i, now, local_time)
    return True


def no_straggler(calendar, i, now):
    """Note component i, and return whether this process has processed nothing later near it."""
    lp, history = calendar.lp[0], calendar.history
    entry = lp.processed & (HISTORY_LENGTH - 1)
    if now < lp.local_time:
        # What was far from all borders is not remembered, and may concern those that are not near one.
        if mask_of(calendar, i) & ANNOUNCED == 0 or history[entry, TIME] > now:
            return False
        for k in range(HISTORY_LENGTH):
            if history[k, TIME] > now and near_to(calendar, history, k, i):
                return False
        lp.stragglers += 1
    lp.local_time = max(lp.local_time, now)
    lp.processed += 1
    record_history(calendar, history, entry, i, now, lp.local_time)
    return True
