"""The main cycle of the paper's Figure 2, written once.

It knows the basic functions ``interaction_time``, ``jump`` and ``advance`` (here ``position`` and
``velocity``) and no physics. It departs from the paper in one point: both halves of a collision are processed
in one cycle. If they were processed one at a time, the second would still be pending, with its state from
before the collision, when the first is scheduled at the same time. The printed cycle then stalls
(docs/concepts).
"""

from __future__ import annotations

import numpy as np

from carom.compiling.borrowed import borrowed
from carom.compiling.dispatch import entry
from carom.engine.calendar import (
    ROOM,
    adapt,
    cluttered,
    crowded,
    effort,
    first,
    lay_out,
    pop,
    prefetch_calendar,
)
from carom.engine.collisions import collide, new_epoch, rebound, woken
from carom.engine.company import announce, collect, granted, weary
from carom.engine.constants import (
    IDLE,
    LAMBDA,
    NEEDS_HEAP,
    NEEDS_LOG,
    NEEDS_NEIGHBORS,
    REACHED_COLLISIONS,
    REACHED_TIME,
    SPENT,
)
from carom.engine.events import (
    enqueue,
    offer_newcomer,
    predict,
    recheck_obstacles,
    schedule_transit,
    spread_news,
    start_over,
)
from carom.engine.images import index, lasting, mirror
from carom.engine.neighbors.interface import begin_epoch, change_home, first_newcomer, settle, transit
from carom.engine.neighbors.prefetch import leaves_first
from carom.engine.search import NOBODY_MET, search
from carom.engine.tallies import log_full
from carom.models.interface import NEVER


def _schedule(digest):
    def schedule(model, state, neighbors, calendar, tallies, begin, end):
        """Schedule the components from ``begin`` to ``end`` at the present time.

        The neighbour scheme is built with the first, and the calendar laid out with the last of them.

        Returns
        -------
        done : bool
            False if an array is too small for the neighbour scheme.
        """
        digest  # noqa: B018 (part of the cache's key)
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        calendar, tallies = borrowed(calendar), borrowed(tallies)
        rows = state.rows
        partner = state.partner
        now = state.clock[0].now
        tally = tallies[0]
        n = np.uint64(len(partner))
        if begin == 0:
            if not settle(neighbors, model.motion, model.boundary, state):
                return False
            calendar.control[0].end = -NEVER  # nothing enters the calendar until all is known
            for i in range(n):
                rows[i].due = NEVER
                partner[i] = LAMBDA
        for i in range(np.uint64(begin), np.uint64(end)):
            found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
            predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
            schedule_transit(model, state, neighbors, i, now)
        if np.uint64(end) == n:
            lay_out(calendar, state, model.boundary, now, state.clock[0].length)
        return True

    return schedule


def _run(digest):
    def run(model, state, neighbors, calendar, tallies, log, end_epoch, end_time, collisions, cycles):
        """Run the main cycle and return the reason why it ended, and how many of its cycles are left.

        Parameters
        ----------
        end_epoch, end_time : int, float
            Return before the first event later than this.
        collisions : int
            Return after the collision of this number.
        cycles : int
            Return after so many cycles. Windows and epochs in which nothing happens count, too, so that fewer
            than none may be left.
        """
        digest  # noqa: B018 (part of the cache's key)
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        calendar, tallies = borrowed(calendar), borrowed(tallies)
        log = borrowed(log)
        clock = state.clock[0]
        tally = tallies[0]
        control = calendar.control[0]
        while True:
            collect(calendar, state)
            if control.full != 0:
                cycles -= effort(state)
                lay_out(calendar, state, model.boundary, clock.now, clock.length)
                if crowded(calendar):
                    return NEEDS_HEAP, cycles
            tight = control.waiting + ROOM > len(calendar.due)
            if not tight and spread_news(model.rules, model, state, calendar, clock.now):
                cycles -= 1
                continue
            chosen = np.int64(-2)
            if not tight:
                chosen = first(calendar, state, neighbors, model.boundary, model.motion)
            if chosen == -2:
                if not cluttered(calendar, state):
                    return NEEDS_HEAP, cycles
                control.full = 1
                continue
            last = clock.epoch == end_epoch
            if chosen == -1:
                if last and end_time < control.end:
                    announce(calendar, state, control.end)
                    return REACHED_TIME, cycles
                if tally.collisions >= collisions:  # the present stays that of the last collision
                    return REACHED_COLLISIONS, cycles
                if cycles <= 0:
                    return SPENT, cycles
                cycles -= effort(state)
                announce(calendar, state, control.end)
                adapt(calendar, len(state.partner), clock.length)
                start = control.end
                if start >= clock.length:
                    new_epoch(model, state, neighbors)
                    begin_epoch(neighbors, model, state, tally)
                    start = 0.0
                earliest = lay_out(calendar, state, model.boundary, start, clock.length)
                if control.full != 0:
                    return NEEDS_HEAP, cycles
                if earliest == NEVER:
                    announce(calendar, state, NEVER)
                    return IDLE, cycles
                continue
            i = np.uint64(chosen)
            now = calendar.due[0]
            announce(calendar, state, now)
            if (last and now > end_time) or clock.epoch > end_epoch:
                return REACHED_TIME, cycles
            if tally.collisions >= collisions:
                return REACHED_COLLISIONS, cycles
            if cycles <= 0:
                return SPENT, cycles
            if log_full(log):
                return NEEDS_LOG, cycles
            if not granted(calendar, state, model.boundary, i, now):
                if weary(calendar):
                    return SPENT, cycles
                continue
            cycles -= 1
            control.cycles += 1
            leaves = leaves_first(state, i)
            clock.now = now
            if leaves:
                done, words, begin, count = transit(neighbors, model.motion, model.boundary, state, i, now)
                if not done:
                    return NEEDS_NEIGHBORS, cycles
                pop(calendar)
                tally.transits += 1
                schedule_transit(
                    model, state, neighbors, i, now
                )  # first, so that it does not wait for the search
                enqueue(state, calendar, i)
                if lasting(model.boundary):
                    found = first_newcomer(neighbors, model, state, i, now, words, begin, count)
                    offer_newcomer(model, state, calendar, tally, i, now, found)
                    recheck_obstacles(model, state, calendar, i, now)
                else:
                    start_over(model, state, neighbors, calendar, tally, i, now)
                continue
            pop(calendar)
            word = np.int64(state.partner[i])
            if word < 0:
                thrown = woken(model.rules, model, state, neighbors, log, i, word, now)
                if not thrown:
                    thrown = rebound(model.obstacles, model, state, neighbors, log, i, word, now)
                tally.advancements += np.int64(not thrown)
                found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
                predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
                if thrown:
                    schedule_transit(model, state, neighbors, i, now)
                enqueue(state, calendar, i)
                continue
            j = np.uint64(index(model.boundary, word))
            if j < i:  # the same bits, whichever of the two was found first
                word = np.int64(mirror(model.boundary, np.int64(i), word))
                i, j = j, i
            collide(model, state, neighbors, tally, log, i, word, now)
            change_home(neighbors, model.motion, model.boundary, state, i, now)
            change_home(neighbors, model.motion, model.boundary, state, j, now)
            schedule_transit(model, state, neighbors, i, now)
            schedule_transit(model, state, neighbors, j, now)
            # Two searches that do not wait for each other.
            found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
            prefetch_calendar(calendar, state, model.boundary, found[0])
            other = search(model, state, neighbors, j, now, 1, NOBODY_MET)
            prefetch_calendar(calendar, state, model.boundary, other[0])
            for _ in range(2):
                predict(model, state, neighbors, calendar, tally, i, now, word, found)
                enqueue(state, calendar, i)
                word = np.int64(mirror(model.boundary, np.int64(i), word))
                i, j, found = j, i, other

    return run


schedule = entry(_schedule)
run = entry(_run)
