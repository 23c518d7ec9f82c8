"""Lookahead: a process announces when its next event is, and which ones will be in the zones of borders."""

from __future__ import annotations

import numpy as np

from carom.compiling.instructions import load, prefetch, store
from carom.engine.calendar import (
    ENTRIES,
    bucket_of,
    buckets_in_window,
    time_of,
)
from carom.engine.domains.decomposition import ANNOUNCED, MAY_REACH_BORDER, OWN
from carom.engine.domains.lp_state import MOST_ANNOUNCED, mask_of, patch_at, row_of
from carom.models.interfaces.particles import NEVER

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
