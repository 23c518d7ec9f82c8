"""The next event of a component: pairs are made, separated and entered into the calendar (lines 14 to 23)."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import cold, optional
from carom.engine.boundary import index, mirror
from carom.engine.calendar import insert, time_of
from carom.engine.constants import LAMBDA, TIMER_EVENT
from carom.engine.neighbors.interface import transit_time
from carom.engine.one_body import event_in_view, retime_contact, schedule_one_body
from carom.engine.search import NO_REF, FromRows, contact_time_of, search
from carom.models.interactions.units import NO_AGENT
from carom.models.questions.particles import NEVER

EARLIER = 2.0**-40
"""Part of an epoch, above rounding, by which whoever has no partner looks for one earlier in the next."""


def predict(model, state, neighbors, calendar, tally, i, now, met, found):
    """Schedule the next event of i (lines 14 to 23 of Figure 6.1) from the result ``found`` of its search.

    ``met`` is the word of the one with which i has just collided, or none. They do not collide again at the
    same time (condition V), even if they overlap and approach by rounding; in a small box they may under
    another word.
    """
    rows = state.rows
    held = np.int64(state.partner[i])
    rows[i].event_time = NEVER
    state.partner[i] = LAMBDA
    event_time = NEVER
    j = np.int64(-1)
    clamped = False
    searched = False
    ref, t = found
    while ref >= 0:
        j = np.int64(index(model.boundary, ref))
        event_time, clamped = contact_time_of(model.timing, model, state, i, ref, now, t)
        repeats = ref == met and event_time == now
        if not repeats and (searched or event_time <= rows[np.uint64(j)].event_time):
            break
        # The two have just met; or the other half of the collision took this candidate after the search.
        searched = True
        event_time = NEVER
        ref, t = search(model, state, neighbors, i, now, 0, met if repeats else NO_REF)
    if not schedule_one_body(model, state, i, now, event_time) and event_time < NEVER:
        pair_up(model, state, calendar, i, ref, event_time)
        tally.clamped += np.int64(clamped)
        tally.returns += np.int64(met >= 0 and j == np.int64(index(model.boundary, met)))
    if held >= 0:
        release(model, state, calendar, i, held)


@optional
def retime(timing, model, state, i):
    """Compute the event of i anew at an epoch's beginning; by default the time carried over holds."""
    return


@retime.register
def _retime_of_from_rows(timing: FromRows, model, state, i):
    rows = state.rows
    slightly = EARLIER * state.clock[0].length
    ref = np.int64(state.partner[i])
    if not slightly < rows[i].event_time < NEVER:
        return
    if ref >= 0:
        j = np.uint64(index(model.boundary, ref))
        if i < j:
            event_time, _ = contact_time_of(timing, model, state, i, ref, 0.0, np.float64(rows[i].event_time))
            rows[i].event_time = event_time
            rows[j].event_time = event_time
    elif ref != LAMBDA:
        retime_contact(model.motion, model.obstacles, model, state, i, ref)
    else:
        # A former partner may still be there then: not a rounding too late for it.
        rows[i].event_time = rows[i].event_time - slightly


def recheck_one_body(model, state, calendar, i, now):
    """Look for the events of component i that have come into view with its last change of sector."""
    held = np.int64(state.partner[i])
    t, code = event_in_view(model.obstacles, model, state, i, now)
    if t < state.rows[i].event_time:
        state.rows[i].event_time = t
        state.partner[i] = code
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


def release(model, state, calendar, i, held):
    """Leave the former partner of i (word ``held``) with an advancement, unless i has chosen it again."""
    j = np.uint64(index(model.boundary, held))
    back = np.int64(state.partner[j])
    if back < 0 or np.uint64(index(model.boundary, back)) != i:
        return
    chosen = np.int64(state.partner[i])
    if chosen < 0 or np.uint64(index(model.boundary, chosen)) != j:
        state.partner[j] = LAMBDA
        enqueue(state, calendar, j)


def pair_up(model, state, calendar, i, ref, event_time):
    """Give i and the component that ``ref`` names their new event; a third party gets an advancement."""
    rows = state.rows
    j = np.uint64(index(model.boundary, ref))
    third_party = np.int64(state.partner[j])
    if third_party >= 0:
        m = np.uint64(index(model.boundary, third_party))
        if m != np.uint64(i):
            state.partner[m] = LAMBDA
            insert(calendar, m, np.float64(rows[j].event_time))
    rows[i].event_time = event_time
    rows[j].event_time = event_time
    state.partner[i] = ref
    state.partner[j] = mirror(model.boundary, np.int64(i), ref)


def enqueue(state, calendar, i):
    """Enter component i into the calendar at its new event, or where it leaves its sector before that.

    Its partner needs no entry: if it leaves its sector first it is entered there, and if i does, i is entered
    again.
    """
    insert(calendar, i, time_of(state, i))


def schedule_transit(model, state, neighbors, i, now):
    """Find when component i leaves its sector (the paper's line 5): its row or its sector is a new one."""
    state.crossing_time[i] = transit_time(neighbors, model.motion, model.boundary, state, i, now)


def offer_newcomer(model, state, calendar, tally, i, now, found):
    """Schedule i with a newcomer to its neighborhood, if they meet before the present event of i."""
    ref, t = found
    if ref < 0:
        return
    rows = state.rows
    j = np.int64(index(model.boundary, ref))
    event_time, clamped = contact_time_of(model.timing, model, state, i, ref, now, t)
    if event_time < rows[i].event_time and event_time <= rows[np.uint64(j)].event_time:
        held = np.int64(state.partner[i])
        pair_up(model, state, calendar, i, ref, event_time)
        tally.clamped += np.int64(clamped)
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@cold
def start_over(model, state, neighbors, calendar, tally, i, now):
    """Schedule i again if its change of sector made the word of its partner invalid."""
    rows = state.rows
    held = np.int64(state.partner[i])
    held_time = rows[i].event_time
    j = np.uint64(0)
    if held >= 0:
        j = np.uint64(index(model.boundary, held))
        rows[j].event_time = NEVER
        state.partner[j] = LAMBDA
        state.partner[i] = LAMBDA
    found = search(model, state, neighbors, i, now, 0, NO_REF)
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
    i = np.uint64(rules.queue[rules.queued[0]])
    if rules.news[i] == NO_AGENT:  # it has been removed meanwhile
        return True
    held = np.int64(state.partner[i])
    state.rows[i].event_time = now
    state.partner[i] = TIMER_EVENT
    enqueue(state, calendar, i)
    if held >= 0:
        release(model, state, calendar, i, held)
    return True
