"""The calendar of a process: what it schedules for components of others, and when it may go on."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.compiling.instructions import load, store, yield_thread
from carom.engine.calendar import MOST_NEW_ENTRIES, Calendar, buckets_in_window, insert, pop, time_of
from carom.engine.domains.announcements import (
    HORIZON,
    PREFETCH_AHEAD,
    announce_at_borders,
    prefetch_bucket,
    scan_bucket,
    withdraw,
)
from carom.engine.domains.decomposition import (
    ANNOUNCED,
    BORDER_BELOW,
    BORDERS,
    HISTORY,
    OWN,
    PATCHES,
    READ_HALO,
    WRITE_HALO,
)
from carom.engine.domains.lp_state import (
    INTERIOR,
    LINE,
    MOST_ANNOUNCED,
    MOST_MESSAGES,
    PROCESSING,
    Channels,
    abort_window,
    beside,
    mask_of,
    patch_at,
    slot_of,
    unlock,
)
from carom.engine.domains.synchronization import (
    MOST_WAITS,
    borders_of,
    lock_borders,
    no_earlier_event,
    no_straggler,
    no_straggler_at_border,
)
from carom.models.interfaces.particles import NEVER


class LpQueue(Calendar):
    """The calendar of a process."""

    neighbors: Any  # the neighbor scheme, which says where components are
    lp: Any  # one record of type LP_STATE
    channels: Channels
    mask: np.ndarray  # what each layer is to the process, (layers,) uint8
    along: np.ndarray  # two axes along which borders are divided into patches, (2,) int64
    patches: np.ndarray  # into how many, along each of them, (2,) int64
    rows: np.ndarray  # the row of patches that each layer along each of them is in, (2, layers) int64
    layers: np.ndarray  # layers along each axis, (d,) int64
    conflict_range: np.ndarray  # layers between two events up to which they may touch the same, (d,) int64
    history: np.ndarray  # the last events, (HISTORY_LENGTH, 8 or more) float64
    announced_times: np.ndarray  # times of the events announced on each side, (2, MOST_ANNOUNCED) float64
    announced_patches: np.ndarray  # their patches, (2, MOST_ANNOUNCED) int64
    flags: np.ndarray  # whether a bucket may hold one, (buckets,) uint8

    def is_remote(self, i):
        return mask_of(self, i) & OWN == 0

    def count_local(self, start_index, end):
        # Rows of others are not looked at: half of the memory that two processes would ask for.
        count = 0
        for i in range(start_index, end):
            self.component[count] = i
            count += mask_of(self, i) & OWN != 0
        return count

    def local_component(self, start_index, k):
        return self.component[k]

    def send_if_remote(self, i, time):
        lp, channels = self.lp[0], self.channels
        if lp.held_borders & INTERIOR != 0:
            return False
        mask = mask_of(self, i)
        foreign = mask & OWN == 0
        if lp.held_borders & PROCESSING != 0:
            held = mask & BORDERS & lp.held_borders != 0
            inside = held and mask & WRITE_HALO != 0 if foreign else held or mask & READ_HALO == 0
            if not inside:
                abort_window(self)  # further away than an event should reach: somebody else may be at it
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

    def receive(self, state):
        lp, channels, control = self.lp[0], self.channels, self.control[0]
        if lp.held_borders & BORDERS != 0:
            unlock(self)
        lp.held_borders = 0
        for slot in range(2):
            count = load(channels.sent_count, LINE * lp.me + slot)
            while lp.read[slot] != count and control.waiting + MOST_NEW_ENTRIES <= len(self.event_time):
                i = channels.messages[lp.me, slot, lp.read[slot] & (MOST_MESSAGES - 1)]
                lp.read[slot] += 1
                lp.unacknowledged = 1
                insert(self, i, time_of(state, i))

    def note_border_event(self, bucket, time, i):
        if self.lp[0].held_borders & INTERIOR != 0:
            return
        mask = mask_of(self, i)
        if mask & ANNOUNCED != 0:
            if bucket > self.lp[0].scanned_bucket:
                self.flags[bucket] = 1
            else:
                announce_at_borders(self, time, i, mask)

    def clear_notes(self):
        lp = self.lp[0]
        self.flags[:] = 0
        lp.announced_bucket = -2
        lp.scanned_bucket = -1
        lp.scanned_time = lp.announced_time
        lp.first_unannounced = NEVER
        lp.announced_horizon = lp.announced_time  # nothing is announced any more
        store(self.channels.published_time, LINE * lp.me + 1, np.float64(lp.announced_horizon))
        for side in range(2):
            lp.announced_counts[side] = 0
            for patch in range(PATCHES):
                store(self.channels.event_time, patch_at(self, side, lp.me, 0, patch), np.float64(NEVER))

    def publish_time(self, state, time):
        lp, control, published_time = self.lp[0], self.control[0], self.channels.published_time
        # What was said holds on: once a bucket is enough, unless this process waits, has read messages, or
        # comes to the end of what it has to do.
        more = time < control.end and time <= lp.window_end
        if lp.announced_bucket == control.cursor and lp.waits == 0 and lp.unacknowledged == 0 and more:
            return
        lp.announced_bucket = control.cursor
        if lp.announced_time != time or lp.unacknowledged != 0:
            lp.announced_time = time
            last = buckets_in_window(self) - 1
            target = min(last, control.cursor + HORIZON)
            if lp.scanned_bucket < target:
                while (
                    lp.scanned_bucket < target
                    and max(lp.announced_counts[0], lp.announced_counts[1]) < MOST_ANNOUNCED // 2
                ):
                    lp.scanned_bucket += 1
                    prefetch_bucket(self, state, lp.scanned_bucket + PREFETCH_AHEAD)
                    if self.flags[lp.scanned_bucket] != 0:
                        scan_bucket(self, state, lp.scanned_bucket)
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
                    withdraw(self, side, time)
        if lp.unacknowledged != 0:
            lp.unacknowledged = 0
            for slot in range(2):
                store(self.channels.acknowledged, LINE * lp.me + slot, lp.read[slot])

    def choose_width(self, n, longest):
        # All processes lay out their calendars at the same times: nobody waits for another that does.
        return

    def narrow(self, longest):
        """For the same reason a process whose lines run out is given more of them."""
        return False

    def safe_to_process(self, state, boundary, i, now):
        lp = self.lp[0]
        lp.waits += 1
        mask = mask_of(self, i)
        if mask & (OWN | HISTORY) == OWN and now >= lp.local_time:
            lp.local_time = now
            lp.waits = 0
            lp.held_borders = PROCESSING | INTERIOR
            return True
        if mask & OWN == 0:  # it has gone over to another process, which knows of it
            pop(self)
            return False
        borders = borders_of(self, state, boundary, i)
        if borders != 0:
            for side in range(2):
                if borders & (side + 1) != 0 and not no_earlier_event(self, side, now, i):
                    return False
            if not lock_borders(self, state, boundary, i, now, borders):
                return False
            for side in range(2):
                if borders & (side + 1) != 0 and not no_straggler_at_border(self, side, i, now):
                    abort_window(self)
                    return False
        if not no_straggler(self, i, now):
            abort_window(self)
            return False
        lp.waits = 0
        lp.held_borders |= PROCESSING
        return True

    def should_return(self):
        lp = self.lp[0]
        if lp.waits % lp.spins_before_yield == 0:
            if lp.held_borders != 0:
                unlock(self)
            yield_thread()
        stopped = load(self.channels.sent_count, LINE * lp.me + 2) != 0
        if stopped or lp.waits >= MOST_WAITS:
            lp.waits = 0
            return True
        return False
