"""The main cycle of the paper's Figure 6.1, written once: it knows the basic functions, and no physics.

But both halves of a collision are processed in one cycle: otherwise the second is pending in its old state
when the first is scheduled, and the printed cycle stalls (docs/algorithm).
"""

from __future__ import annotations

from carom.compiling.entry import entry
from carom.engine.build import bare_model
from carom.engine.calendar import (
    MOST_NEW_ENTRIES,
    cluttered,
    crowded,
    effort,
    fill_window,
    next_event,
    pop,
    prefetch_calendar,
)
from carom.engine.collisions import collide
from carom.engine.constants import (
    IDLE,
    LAMBDA,
    NEEDS_EVENTS,
    NEEDS_HEAP,
    NEEDS_LOG,
    NEEDS_NEIGHBORS,
    REACHED_COLLISIONS,
    REACHED_HIT,
    REACHED_TIME,
    SPENT,
)
from carom.engine.epochs import new_epoch
from carom.engine.events import (
    enqueue,
    notify_next,
    offer_newcomer,
    predict,
    recheck_one_body,
    schedule_transit,
    start_over,
)
from carom.engine.neighbors.prefetch import leaves_first
from carom.engine.one_body import run_one_body
from carom.engine.search import NO_REF
from carom.models.interfaces.particles import NEVER


@entry
def schedule(model, state, neighbors, calendar, tallies, start_index, end):
    """Schedule a range of components now; return False if an array of the neighbor scheme is too small.

    The scheme is built with the first of them, and the calendar laid out with the last.
    """
    rows = state.rows
    partner = state.partner
    now = state.clock[0].now
    tally = tallies[0]
    n = len(partner)
    if start_index == 0:
        if not neighbors.build(model.motion, model.boundary, state):
            return False
        calendar.control[0].end = -NEVER  # nothing enters the calendar until all is known
        for i in range(n):
            rows[i].event_time = NEVER
            partner[i] = LAMBDA
    for i in range(start_index, end):
        found = neighbors.earliest_partner(model, state, i, now, 0, NO_REF)
        predict(model, state, neighbors, calendar, tally, i, now, NO_REF, found)
        schedule_transit(model, state, neighbors, i, now)
    if end == n:
        fill_window(calendar, state, model.boundary, now, state.clock[0].length)
    return True


@entry
def run(model, state, neighbors, calendar, tallies, end_epoch, end_time, collisions, cycles):
    """Run the main cycle and return the reason why it ended, and how many of its cycles are left.

    It ends before the first event later than (``end_epoch``, ``end_time``), after collision number
    ``collisions``, or after ``cycles``. Empty windows and epochs count as cycles, so that fewer than none may
    be left.
    """
    bare = bare_model(model)  # the functions that scheduling has had compiled
    clock = state.clock[0]
    tally = tallies[0]
    control = calendar.control[0]
    while True:
        if model.observers.ends_run():
            return REACHED_HIT, cycles
        calendar.receive(state)
        if control.full != 0:
            cycles -= effort(state)
            fill_window(calendar, state, model.boundary, clock.now, clock.length)
            if crowded(calendar):
                return NEEDS_HEAP, cycles
        tight = control.waiting + MOST_NEW_ENTRIES > len(calendar.event_time)
        if not tight and notify_next(model.rules, model, state, calendar, clock.now):
            cycles -= 1
            continue
        i = -2
        if not tight:
            i = next_event(calendar, state, neighbors, model.boundary, model.motion)
        if i == -2:
            if not cluttered(calendar, state):
                return NEEDS_HEAP, cycles
            control.full = 1
            continue
        last = clock.epoch == end_epoch
        if i == -1:
            if last and end_time < control.end:
                calendar.publish_time(state, control.end)
                return REACHED_TIME, cycles
            if tally.collisions >= collisions:  # the present stays that of the last collision
                return REACHED_COLLISIONS, cycles
            if cycles <= 0:
                return SPENT, cycles
            cycles -= effort(state)
            calendar.publish_time(state, control.end)
            calendar.choose_width(len(state.partner), clock.length)
            start = control.end
            if start >= clock.length:
                if new_epoch(model, state, neighbors):
                    return NEEDS_EVENTS, cycles
                neighbors.begin_epoch(model, state, tally)
                start = 0.0
            earliest = fill_window(calendar, state, model.boundary, start, clock.length)
            if control.full != 0:
                return NEEDS_HEAP, cycles
            if earliest == NEVER:
                calendar.publish_time(state, NEVER)
                return IDLE, cycles
            continue
        now = calendar.event_time[0]
        calendar.publish_time(state, now)
        if (last and now > end_time) or clock.epoch > end_epoch:
            return REACHED_TIME, cycles
        if tally.collisions >= collisions:
            return REACHED_COLLISIONS, cycles
        if cycles <= 0:
            return SPENT, cycles
        if model.observers.is_full():
            return NEEDS_LOG, cycles
        if not calendar.safe_to_process(state, model.boundary, i, now):
            if calendar.should_return():
                return SPENT, cycles
            continue
        cycles -= 1
        control.cycles += 1
        leaves = leaves_first(state, i)
        clock.now = now
        if leaves:
            done, refs, start_index, count = neighbors.cross(model.motion, model.boundary, state, i, now)
            if not done:
                return NEEDS_NEIGHBORS, cycles
            pop(calendar)
            neighbors.prefetch_first(model.boundary, state, calendar.component[0])
            tally.transits += 1
            schedule_transit(bare, state, neighbors, i, now)  # first, so that it does not wait for the search
            enqueue(state, calendar, i)
            if model.boundary.lasting():
                found = neighbors.earliest_newcomer(bare, state, i, now, refs, start_index, count)
                offer_newcomer(bare, state, calendar, tally, i, now, found)
                recheck_one_body(bare, state, calendar, i, now)
            else:
                start_over(bare, state, neighbors, calendar, tally, i, now)
            continue
        pop(calendar)
        neighbors.prefetch_first(model.boundary, state, calendar.component[0])
        ref = state.partner[i]
        if ref < 0:
            happened = run_one_body(model, state, neighbors, i, ref, now)
            tally.advancements += not happened
            found = neighbors.earliest_partner(bare, state, i, now, 0, NO_REF)
            predict(bare, state, neighbors, calendar, tally, i, now, NO_REF, found)
            if happened:
                schedule_transit(bare, state, neighbors, i, now)
            enqueue(state, calendar, i)
            continue
        j = model.boundary.index(ref)
        if j < i:  # the same bits, whichever of the two was found first
            ref = model.boundary.mirror(i, ref)
            i, j = j, i
        collide(model, state, neighbors, tally, i, ref, now)
        neighbors.rebin(model.motion, model.boundary, state, i, now)
        neighbors.rebin(model.motion, model.boundary, state, j, now)
        schedule_transit(bare, state, neighbors, i, now)
        schedule_transit(bare, state, neighbors, j, now)
        # Two searches that do not wait for each other.
        found = neighbors.earliest_partner(bare, state, i, now, 0, NO_REF)
        prefetch_calendar(calendar, state, model.boundary, found[0])
        other = neighbors.earliest_partner(bare, state, j, now, 1, NO_REF)
        prefetch_calendar(calendar, state, model.boundary, other[0])
        for _ in range(2):
            predict(bare, state, neighbors, calendar, tally, i, now, ref, found)
            enqueue(state, calendar, i)
            ref = model.boundary.mirror(i, ref)
            i, j, found = j, i, other
