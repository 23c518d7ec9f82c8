"""What a process announces: when its next event is, and which events will be in the zones of its borders."""

from __future__ import annotations

import numpy as np

from carom.compiling.instructions import load, prefetch, store
from carom.engine.calendar import (
    ENTRIES,
    bucket_of,
    buckets_in_window,
    choose_width,
    clear_notes,
    narrow,
    note_border_event,
    publish_time,
    time_of,
)
from carom.engine.domains.decomposition import ANNOUNCED, MAY_REACH_BORDER, OWN, PATCHES
from carom.engine.domains.lp_state import INTERIOR, LINE, MOST_ANNOUNCED, LpQueue, mask_of, patch_at, row_of
from carom.models.questions.particles import NEVER

HORIZON = 16  # buckets in which a process looks for events in zones in advance

PREFETCH_AHEAD = 4  # buckets by which what they name is asked for before a process looks into them


def note(calendar, side, time, i):
    """Announce an event of component i at a border."""
    lp = calendar.lp[0]
    k = lp.announced_counts[side]
    if k == MOST_ANNOUNCED:
        lp.first_unannounced = min(lp.first_unannounced, time)
        return
    at = patch_at(calendar, side, lp.me, row_of(calendar, i, 0), row_of(calendar, i, 1))
    calendar.announced_times[side, k] = time
    calendar.announced_patches[side, k] = at
    lp.announced_counts[side] += 1
    if time < load(calendar.channels.event_time, at):
        store(calendar.channels.event_time, at, np.float64(time))


def withdraw(calendar, side, now):
    """Withdraw what was announced at a border before now."""
    lp = calendar.lp[0]
    announced_times, announced_patches = calendar.announced_times, calendar.announced_patches
    k = 0
    while k < lp.announced_counts[side]:
        if announced_times[side, k] >= now:
            k += 1
            continue
        lp.announced_counts[side] -= 1
        last = lp.announced_counts[side]
        at = announced_patches[side, k]
        announced_times[side, k] = announced_times[side, last]
        announced_patches[side, k] = announced_patches[side, last]
        earliest = np.float64(NEVER)
        for other in range(last):
            here = announced_patches[side, other] == at and announced_times[side, other] >= now
            earliest = min(earliest, announced_times[side, other]) if here else earliest
        store(calendar.channels.event_time, at, earliest)


def announce_at_borders(calendar, time, i, mask):
    """Announce an event of component i at the borders that it may reach."""
    for side in range(2):
        if mask & (MAY_REACH_BORDER * (side + 1)) != 0:
            note(calendar, side, time, i)


@note_border_event.register
def _note_border_event_of_lp(calendar: LpQueue, bucket, time, i):
    if calendar.lp[0].held_borders & INTERIOR != 0:
        return
    mask = mask_of(calendar, i)
    if mask & ANNOUNCED != 0:
        if bucket > calendar.lp[0].scanned_bucket:
            calendar.flags[bucket] = 1
        else:
            announce_at_borders(calendar, time, i, mask)


@clear_notes.register
def _clear_notes_of_lp(calendar: LpQueue):
    lp = calendar.lp[0]
    calendar.flags[:] = 0
    lp.announced_bucket = -2
    lp.scanned_bucket = -1
    lp.scanned_time = lp.announced_time
    lp.first_unannounced = NEVER
    lp.announced_horizon = lp.announced_time  # nothing is announced any more
    store(calendar.channels.published_time, LINE * lp.me + 1, np.float64(lp.announced_horizon))
    for side in range(2):
        lp.announced_counts[side] = 0
        for patch in range(PATCHES):
            store(calendar.channels.event_time, patch_at(calendar, side, lp.me, 0, patch), np.float64(NEVER))


def prefetch_bucket(calendar, state, bucket):
    """Ask for what looking into a bucket will touch."""
    buckets = calendar.buckets
    if bucket < buckets_in_window(calendar) and calendar.flags[bucket] != 0:
        for k in range(buckets[bucket, 0]):
            i = buckets[bucket, k + 2]
            calendar.neighbors.prefetch_layer(i)
            prefetch(state.rows, i)
            prefetch(state.crossing_time, i)


def scan_bucket(calendar, state, bucket):
    """Announce what a bucket holds at the borders."""
    buckets = calendar.buckets
    for k in range(buckets[bucket, 0]):
        scan_component(calendar, state, bucket, buckets[bucket, k + 2])
    link = buckets[bucket, 1]
    while link > 0:
        for k in range(ENTRIES):
            scan_component(calendar, state, bucket, calendar.lines[link, k + 2])
        link = calendar.lines[link, 1]


def scan_component(calendar, state, bucket, i):
    """Announce component i, if it is due in this bucket and at a border."""
    mask = mask_of(calendar, i)
    time = time_of(state, i)
    inside = time < calendar.control[0].end and bucket_of(calendar, time) <= bucket
    if inside and mask & ANNOUNCED != 0 and mask & OWN != 0:
        announce_at_borders(calendar, time, i, mask)


@publish_time.register
def _publish_time_of_lp(calendar: LpQueue, state, time):
    lp, control, published_time = calendar.lp[0], calendar.control[0], calendar.channels.published_time
    # What was said holds on: once a bucket is enough, unless this process waits, has read messages, or comes
    # to the end of what it has to do.
    more = time < control.end and time <= lp.window_end
    if lp.announced_bucket == control.cursor and lp.waits == 0 and lp.unacknowledged == 0 and more:
        return
    lp.announced_bucket = control.cursor
    if lp.announced_time != time or lp.unacknowledged != 0:
        lp.announced_time = time
        last = buckets_in_window(calendar) - 1
        target = min(last, control.cursor + HORIZON)
        if lp.scanned_bucket < target:
            while (
                lp.scanned_bucket < target
                and max(lp.announced_counts[0], lp.announced_counts[1]) < MOST_ANNOUNCED // 2
            ):
                lp.scanned_bucket += 1
                prefetch_bucket(calendar, state, lp.scanned_bucket + PREFETCH_AHEAD)
                if calendar.flags[lp.scanned_bucket] != 0:
                    scan_bucket(calendar, state, lp.scanned_bucket)
            bucket_end = control.start + (lp.scanned_bucket + 1) * control.width
            lp.scanned_time = control.end if lp.scanned_bucket == last else min(bucket_end, control.end)
        lp.first_unannounced = NEVER if lp.first_unannounced < time else lp.first_unannounced
        horizon = max(min(lp.scanned_time, lp.first_unannounced), time)
        if horizon != lp.announced_horizon:
            lp.announced_horizon = horizon
            store(published_time, LINE * lp.me + 1, np.float64(horizon))
        store(published_time, LINE * lp.me, np.float64(time))
        for side in range(2):
            if lp.announced_counts[side] != 0:
                withdraw(calendar, side, time)
    if lp.unacknowledged != 0:
        lp.unacknowledged = 0
        for slot in range(2):
            store(calendar.channels.acknowledged, LINE * lp.me + slot, lp.read[slot])


@choose_width.register
def _choose_width_of_lp(calendar: LpQueue, n, longest):
    """All processes lay out their calendars at the same times: nobody waits for another that does."""
    return


@narrow.register
def _narrow_of_lp(calendar: LpQueue, longest):
    """For the same reason a process whose lines run out is given more of them."""
    return False
