"""What a part announces: when its next event is, and which events will be in the zones of its borders."""

from __future__ import annotations

import numpy as np

from carom.compiling.atomics import load, store
from carom.compiling.prefetch import prefetch
from carom.compiling.registry import inner
from carom.engine.calendar import ENTRIES, adapt, bucket_of, buckets_in_window, narrow, time_of
from carom.engine.company import announce, mark, marks_forgotten
from carom.engine.windows.desk import FAR, LINE, NOTES, PartCalendar, mask_of, patch_at, row_of
from carom.engine.windows.slabs import ANNOUNCED, HEEDED, OWN, PATCHES, prefetch_layer
from carom.models.interface import NEVER

HORIZON = 16
"""Buckets in which a part looks for events in zones in advance."""

ASKED = 4
"""Buckets by which what they name is asked for before a part looks into them."""


@inner
def note(calendar, side, time, i):
    """Announce an event of component i at a border."""
    desk = calendar.desk[0]
    k = np.uint64(desk.noted[side])
    if k == NOTES:
        desk.unnoted = min(desk.unnoted, time)
        return
    at = patch_at(calendar, side, desk.me, row_of(calendar, i, 0), row_of(calendar, i, 1))
    calendar.notes[side, k] = time
    calendar.where[side, k] = at
    desk.noted[side] += 1
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
        at = where[side, k]
        notes[side, k] = notes[side, last]
        where[side, k] = where[side, last]
        earliest = np.float64(NEVER)
        for other in range(last):
            here = where[side, other] == at and notes[side, other] >= now
            earliest = min(earliest, notes[side, other]) if here else earliest
        store(calendar.board.due, at, earliest)


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
    desk.said = -2
    desk.frontier = -1
    desk.seen = desk.told
    desk.unnoted = NEVER
    desk.sight = desk.told  # nothing is announced any more
    store(calendar.board.clocks, LINE * desk.me + 1, np.float64(desk.sight))
    for side in range(2):
        desk.noted[side] = 0
        for patch in range(PATCHES):
            store(calendar.board.due, patch_at(calendar, side, desk.me, 0, patch), np.float64(NEVER))


@inner
def ask_for_bucket(calendar, state, bucket):
    """Ask for what looking into a bucket will touch."""
    buckets = calendar.buckets
    if bucket < buckets_in_window(calendar) and calendar.flags[np.uint64(bucket)] != 0:
        for k in range(np.uint64(buckets[np.uint64(bucket), 0])):
            i = np.int64(buckets[np.uint64(bucket), k + np.uint64(2)])
            prefetch_layer(calendar.neighbors, i)
            prefetch(state.rows, i)
            prefetch(state.leave, i)


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
    # What was said holds on: once a bucket is enough, unless this part waits, has read messages, or comes to
    # the end of what it has to do.
    more = time < control.end and time <= desk.until
    if desk.said == control.cursor and desk.refused == 0 and desk.fresh == 0 and more:
        return
    desk.said = control.cursor
    if desk.told != time or desk.fresh != 0:
        desk.told = time
        last = buckets_in_window(calendar) - 1
        target = min(last, control.cursor + HORIZON)
        if desk.frontier < target:
            while desk.frontier < target and max(desk.noted[0], desk.noted[1]) < NOTES // 2:
                desk.frontier += 1
                ask_for_bucket(calendar, state, desk.frontier + ASKED)
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


@narrow.register
def _(calendar: PartCalendar, longest):
    """For the same reason a part whose lines run out is given more of them."""
    return False
