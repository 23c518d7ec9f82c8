"""The next event of a component: pairs are made, separated and entered into the calendar (lines 14 to 23)."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import cold
from carom.engine.calendar import insert, time_of
from carom.engine.constants import LAMBDA, TIMER_EVENT
from carom.engine.one_body import event_in_view, retime_contact, schedule_one_body
from carom.engine.search import NO_REF, FromRows
from carom.models.interactions.units import NO_AGENT
from carom.models.interfaces.particles import NEVER

EARLIER = 2.0**-40
"""Part of an epoch, above rounding, by which whoever has no partner looks for one earlier in the next."""


def predict(model, state, neighbors, calendar, tally, i, now, met, found):
    """Schedule the next event of i (lines 14 to 23 of Figure 6.1) from the result ``found`` of its search.

    ``met`` is the ref of the one with which i has just collided, or none. They do not collide again at the
    same time (condition V), even if they overlap and approach by rounding; in a small box they may under
    another ref.
    """
    rows = state.rows
    held = state.partner[i]
    rows[i].event_time = NEVER
    state.partner[i] = LAMBDA
    event_time = NEVER
    j = -1
    clamped = False
    searched = False
    ref, t = found
    while ref >= 0:
        j = model.boundary.index(ref)
        event_time, clamped = model.timing.found_time(model, state, i, ref, now, t)
        repeats = ref == met and event_time == now
        if not repeats and (searched or event_time <= rows[j].event_time):
            break
        # The two have just met; or the other half of the collision took this candidate after the search.
        searched = True
        event_time = NEVER
        ref, t = neighbors.earliest_partner(model, state, i, now, 0, met if repeats else NO_REF)
    if not schedule_one_body(model, state, i, now, event_time) and event_time < NEVER:
        pair_up(model, state, calendar, i, ref, event_time)
        tally.clamped += clamped
        tally.returns += met >= 0 and j == model.boundary.index(met)
    if held >= 0:
        release(model, state, calendar, i, held)


def retime(model, state, i):
    """Compute the event of i anew at an epoch's beginning, where that follows from rows; else it holds."""
    if not isinstance(model.timing, FromRows):
        return
    rows = state.rows
    slightly = EARLIER * state.clock[0].length
    ref = state.partner[i]
    if not slightly < rows[i].event_time < NEVER:
        return
    if ref >= 0:
        j = model.boundary.index(ref)
        if i < j:
            event_time, _ = model.timing.contact_time(
                model, state, i, ref, 0.0, np.float64(rows[i].event_time)
            )
            rows[i].event_time = event_time
            rows[j].event_time = event_time
    elif ref != LAMBDA:
        retime_contact(model, state, i, ref)
    else:
        # A former partner may still be there then: not a rounding too late for it.
        rows[i].event_time = rows[i].event_time - slightly


def recheck_one_body(model, state, calendar, i, now):
    """Look for the events of component i that have come into view with its last change of sector."""
    held = state.partner[i]
    t, code = event_in_view(model.obstacles, model, state, i, now)
    if t < state.rows[i].event_time:
        state.rows[i].event_time = t
        state.partner[i] = code
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


def release(model, state, calendar, i, held):
    """Leave the former partner of i (ref ``held``) with an advancement, unless i has chosen it again."""
    j = model.boundary.index(held)
    back = state.partner[j]
    if back < 0 or model.boundary.index(back) != i:
        return
    chosen = state.partner[i]
    if chosen < 0 or model.boundary.index(chosen) != j:
        state.partner[j] = LAMBDA
        enqueue(state, calendar, j)


def pair_up(model, state, calendar, i, ref, event_time):
    """Give i and the component that ``ref`` names their new event; a third party gets an advancement."""
    rows = state.rows
    j = model.boundary.index(ref)
    third_party = state.partner[j]
    if third_party >= 0:
        m = model.boundary.index(third_party)
        if m != i:
            state.partner[m] = LAMBDA
            insert(calendar, m, np.float64(rows[j].event_time))
    rows[i].event_time = event_time
    rows[j].event_time = event_time
    state.partner[i] = ref
    state.partner[j] = model.boundary.mirror(i, ref)


def enqueue(state, calendar, i):
    """Enter component i into the calendar at its new event, or where it leaves its sector before that.

    Its partner needs no entry: if it leaves its sector first it is entered there, and if i does, i is entered
    again.
    """
    insert(calendar, i, time_of(state, i))


def schedule_transit(model, state, neighbors, i, now):
    """Find when component i leaves its sector (the paper's line 5): its row or its sector is a new one."""
    state.crossing_time[i] = neighbors.transit_time(model.motion, model.boundary, state, i, now)


def offer_newcomer(model, state, calendar, tally, i, now, found):
    """Schedule i with a newcomer to its neighborhood, if they meet before the present event of i."""
    ref, t = found
    if ref < 0:
        return
    rows = state.rows
    j = model.boundary.index(ref)
    event_time, clamped = model.timing.contact_time(model, state, i, ref, now, t)
    if event_time < rows[i].event_time and event_time <= rows[j].event_time:
        held = state.partner[i]
        pair_up(model, state, calendar, i, ref, event_time)
        tally.clamped += clamped
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@cold
def start_over(model, state, neighbors, calendar, tally, i, now):
    """Schedule i again if its change of sector made the ref of its partner invalid."""
    rows = state.rows
    held = state.partner[i]
    held_time = rows[i].event_time
    j = 0
    if held >= 0:
        j = model.boundary.index(held)
        rows[j].event_time = NEVER
        state.partner[j] = LAMBDA
        state.partner[i] = LAMBDA
    found = neighbors.earliest_partner(model, state, i, now, 0, NO_REF)
    predict(model, state, neighbors, calendar, tally, i, now, NO_REF, found)
    if held >= 0 and state.partner[j] == LAMBDA and rows[j].event_time == NEVER:
        rows[j].event_time = held_time
    if held >= 0:
        enqueue(state, calendar, j)
    enqueue(state, calendar, i)


def notify_next(rules, model, state, calendar, now):
    """Give the next unit in the queue of news an event now, its partner an advancement; False if empty."""
    if rules is None or rules.queued[0] == 0:
        return False
    rules.queued[0] -= 1
    i = rules.queue[rules.queued[0]]
    if rules.news[i] == NO_AGENT:  # it has been removed meanwhile
        return True
    held = state.partner[i]
    state.rows[i].event_time = now
    state.partner[i] = TIMER_EVENT
    enqueue(state, calendar, i)
    if held >= 0:
        release(model, state, calendar, i, held)
    return True
