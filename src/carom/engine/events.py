"""The next event of a component: pairs are made, separated and entered into the calendar (lines 14 to 23)."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import inner, optional
from carom.engine.calendar import insert, time_of
from carom.engine.constants import LAMBDA, OBSTACLE, WAKE
from carom.engine.images import index, mirror
from carom.engine.live import Live
from carom.engine.neighbors.interface import transit_time
from carom.engine.obstacles import Obstacles, soonest
from carom.engine.rules import wait
from carom.engine.search import NOBODY_MET, RowSight, meet, moment_before, search
from carom.models.free_flight import Inertial
from carom.models.interface import NEVER, velocity
from carom.models.units import NOBODY, Units

EARLIER = 2.0**-40
"""Part of an epoch, above rounding, by which whoever has no partner looks for one earlier in the next."""


@inner
def predict(model, state, neighbors, calendar, tally, i, now, met, found):
    """Schedule the next event of component i (lines 14 to 23 of Figure 2).

    ``found`` is the result of the search for i. ``met`` is the word of the component with which i has just
    collided, or none. These two do not collide again at the same time (condition V), even if they overlap and
    approach by rounding. In a small box they may collide again under another word.
    """
    rows = state.rows
    held = np.int64(state.partner[i])
    rows[i].due = NEVER
    state.partner[i] = LAMBDA
    due = NEVER
    j = np.int64(-1)
    clamped = False
    searched = False
    word, t = found
    while word >= 0:
        j = np.int64(index(model.boundary, word))
        due, clamped = meet(model.sight, model, state, i, word, now, t)
        again = word == met and due == now
        if not again and (searched or due <= rows[np.uint64(j)].due):
            break
        # The two have just met; or the other half of the collision took this candidate after the search.
        searched = True
        due = NEVER
        word, t = search(model, state, neighbors, i, now, 0, met if again else NOBODY_MET)
    blocked = head_for_obstacle(model.obstacles, model, state, i, now, due, True)
    blocked = wait(model.rules, state, i, now, due, blocked)
    if due < NEVER and not blocked:
        pair_up(model, state, calendar, i, word, due)
        tally.clamped += np.int64(clamped)
        tally.returns += np.int64(met >= 0 and j == np.int64(index(model.boundary, met)))
    if held >= 0:
        release(model, state, calendar, i, held)


@optional
def head_for_obstacle(obstacles, model, state, i, now, due, every):
    """Give i an event with the obstacle that it touches before the time ``due``; False if there is none."""
    return False


@head_for_obstacle.register
def _(obstacles: Obstacles, model, state, i, now, due, every):
    touch, number = meet_obstacle(model.sight, model, state, i, now, every)
    if touch >= due:
        return False
    state.rows[i].due = touch
    state.partner[i] = OBSTACLE - number
    return True


@optional
def meet_obstacle(sight, model, state, i, now, every):
    """Return when i touches an obstacle, and the number of that obstacle, or -1; by default as it is computed
    now. ``every`` as for :func:`carom.engine.obstacles.soonest`.
    """
    t, number = soonest(model.obstacles, model, state, i, now, every)
    return now + t, number


@meet_obstacle.register
def _(sight: RowSight, model, state, i, now, every):
    return meet_in_flight(model.motion, sight, model, state, i, now, every)


@optional
def meet_in_flight(motion, sight, model, state, i, now, every):
    """Return the same; by default, in a field, as it is computed now."""
    t, number = soonest(model.obstacles, model, state, i, now, every)
    return now + t, number


@meet_in_flight.register
def _(motion: Inertial, sight, model, state, i, now, every):
    return meet_resting(model.obstacles.live, sight, model, state, i, now, every)


@optional
def meet_resting(live, sight, model, state, i, now, every):
    """Return the same, computed from the row of i or from shortly before the contact, where all obstacles
    rest.
    """
    row = state.rows[i]
    vv = 0.0
    for axis in range(len(model.boundary.edges)):
        v = np.float64(velocity(model.motion, axis, row.v[axis], now - row.t))
        vv += v * v
    then = np.float64(row.t)
    start = now if (now - then) * (now - then) * vv > sight.square else then
    t, number = soonest(model.obstacles, model, state, i, start, every)
    due = start + t
    if due < NEVER and (due - then) * (due - then) * vv > sight.square:
        then = moment_before(sight.square, vv, due)
        t, again = soonest(model.obstacles, model, state, i, then, every)
        due = then + t if again == number else due
    return max(due, now), number


@meet_resting.register
def _(live: Live, sight, model, state, i, now, every):
    t, number = soonest(model.obstacles, model, state, i, now, every)
    return now + t, number


@optional
def renew(sight, model, state, i):
    """Compute the event of component i anew, at the beginning of an epoch, which has advanced all rows; by
    default the time carried over from the last epoch holds.
    """
    return


@renew.register
def _(sight: RowSight, model, state, i):
    rows = state.rows
    slightly = EARLIER * state.clock[0].length
    word = np.int64(state.partner[i])
    if not slightly < rows[i].due < NEVER:
        return
    if word >= 0:
        j = np.uint64(index(model.boundary, word))
        if i < j:
            due, _ = meet(sight, model, state, i, word, 0.0, np.float64(rows[i].due))
            rows[i].due = due
            rows[j].due = due
    elif word != LAMBDA:
        renew_touch(model.motion, sight, model, state, i, word)
    else:
        # A former partner may still be there then: not a rounding too late for it.
        rows[i].due = rows[i].due - slightly


@optional
def renew_touch(motion, sight, model, state, i, word):
    """Compute the contact of i with the obstacle that a word names anew; in a field, by default, keep it."""
    return


@renew_touch.register
def _(motion: Inertial, sight, model, state, i, word):
    renew_obstacle(model.obstacles, sight, model, state, i, word)


@optional
def renew_obstacle(obstacles, sight, model, state, i, word):
    """Compute the contact of i with the obstacle that a word names anew."""
    return


@renew_obstacle.register
def _(obstacles: Obstacles, sight, model, state, i, word):
    due, number = meet_resting(obstacles.live, sight, model, state, i, 0.0, True)
    if OBSTACLE - number == word:
        state.rows[i].due = due


@inner
def recheck_obstacles(model, state, calendar, i, now):
    """Look for obstacles in the images of the box that have come into view with the last change of sector."""
    held = np.int64(state.partner[i])
    if head_for_obstacle(model.obstacles, model, state, i, now, state.rows[i].due, False):
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@inner
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


@optional
def spread_news(rules, model, state, calendar, now):
    """Give the next unit in the queue of news an event of its own, now; its partner gets an advancement.

    Return False if the queue is empty.
    """
    return False


@spread_news.register
def _(rules: Units, model, state, calendar, now):
    if rules.queued[0] == 0:
        return False
    rules.queued[0] -= 1
    i = np.uint64(rules.queue[rules.queued[0]])
    if rules.news[i] == NOBODY:  # it has been removed meanwhile
        return True
    held = np.int64(state.partner[i])
    state.rows[i].due = now
    state.partner[i] = WAKE
    enqueue(state, calendar, i)
    if held >= 0:
        release(model, state, calendar, i, held)
    return True


@inner
def pair_up(model, state, calendar, i, word, due):
    """Give i and the component that ``word`` names their new event; a third party gets an advancement."""
    rows = state.rows
    j = np.uint64(index(model.boundary, word))
    third = np.int64(state.partner[j])
    if third >= 0:
        m = np.uint64(index(model.boundary, third))
        if m != np.uint64(i):
            state.partner[m] = LAMBDA
            insert(calendar, m, np.float64(rows[j].due))
    rows[i].due = due
    rows[j].due = due
    state.partner[i] = word
    state.partner[j] = mirror(model.boundary, np.int64(i), word)


@inner
def enqueue(state, calendar, i):
    """Enter component i into the calendar: at its new event, or where it leaves its sector before that.

    The partner of i needs no entry. If the partner leaves its sector first, it is in the calendar with that
    time. If i does, i is entered again then.
    """
    insert(calendar, i, time_of(state, i))


@inner
def schedule_transit(model, state, neighbors, i, now):
    """Find when component i leaves its sector (the paper's line 5): its row or its sector is a new one."""
    state.leave[i] = transit_time(neighbors, model.motion, model.boundary, state, i, now)


@inner
def offer_newcomer(model, state, calendar, tally, i, now, found):
    """Schedule i with a newcomer to its neighbourhood, if they meet before the present event of i."""
    word, t = found
    if word < 0:
        return
    rows = state.rows
    j = np.int64(index(model.boundary, word))
    due, clamped = meet(model.sight, model, state, i, word, now, t)
    if due < rows[i].due and due <= rows[np.uint64(j)].due:
        held = np.int64(state.partner[i])
        pair_up(model, state, calendar, i, word, due)
        tally.clamped += np.int64(clamped)
        enqueue(state, calendar, i)
        if held >= 0:
            release(model, state, calendar, i, held)


@inner
def start_over(model, state, neighbors, calendar, tally, i, now):
    """Schedule i again if its change of sector made the word of its partner invalid."""
    rows = state.rows
    held = np.int64(state.partner[i])
    held_due = rows[i].due
    j = np.uint64(0)
    if held >= 0:
        j = np.uint64(index(model.boundary, held))
        rows[j].due = NEVER
        state.partner[j] = LAMBDA
        state.partner[i] = LAMBDA
    found = search(model, state, neighbors, i, now, 0, NOBODY_MET)
    predict(model, state, neighbors, calendar, tally, i, now, NOBODY_MET, found)
    if held >= 0 and state.partner[j] == LAMBDA and rows[j].due == NEVER:
        rows[j].due = held_due
    if held >= 0:
        enqueue(state, calendar, j)
    enqueue(state, calendar, i)
