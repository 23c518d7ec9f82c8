"""Contacts with obstacles, as events of one component: when they happen, and what they do."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import inner, optional
from carom.engine.advance import advance
from carom.engine.constants import LAMBDA, OBSTACLE
from carom.engine.observers.interface import ObstacleEvent, after_obstacle, before_obstacle, gain, record
from carom.engine.obstacles import Obstacles, gained, reflect_component, soonest
from carom.engine.one_body import earlier_event, run_event
from carom.engine.search import FromRows, start_before
from carom.models.motions.free_flight import Inertial
from carom.models.questions.interaction import growth
from carom.models.questions.motion import velocity
from carom.models.questions.particles import NEVER


@earlier_event.register
def _(source: Obstacles, model, state, i, now, t, code):
    touch, number = meet_obstacle(source.timing, model, state, i, now, True, t)
    return (touch, OBSTACLE - number) if touch < t else (t, code)


@inner
def event_in_view(source, model, state, i, now):
    """Return the same of contacts that a change of sector may bring into view.

    Of obstacles that stand in every image of the box, those in the next images are seen.
    """
    if source is None:
        return NEVER, LAMBDA
    until = np.float64(state.rows[i].event_time)
    touch, number = meet_obstacle(source.timing, model, state, i, now, False, until)
    return touch, OBSTACLE - number


@run_event.register
def _(source: Obstacles, model, state, neighbors, i, code, now):
    if code == LAMBDA:
        return False
    number = OBSTACLE - code
    advance(model, state, neighbors, i, now)
    before_obstacle(model.observers, model, state, i, now)
    momentum = reflect_component(model, state, i, number, now)
    energy = gained(source.live, momentum, growth(model.pair, np.int64(i)))
    gain(model.observers, energy, now)
    after_obstacle(model.observers, model, state, ObstacleEvent(i, number, now, momentum, energy))
    record(model.observers, state.clock[0], np.int64(i), code, momentum)
    return True


@optional
def retime_contact(motion, obstacles, model, state, i, code):
    """Compute i's obstacle contact anew at an epoch's beginning; in a field, by default, keep it."""
    return


@retime_contact.register
def _(motion: Inertial, obstacles, model, state, i, code):
    if obstacles is None:
        return
    touch, number = meet_obstacle(obstacles.timing, model, state, i, 0.0, True, NEVER)
    if OBSTACLE - number == code:
        state.rows[i].event_time = touch


def timing_of(timing, motion, live) -> FromRows | None:
    """Return how times of contacts are computed: as of pairs if all obstacles rest and flight is straight."""
    rests = live is None and isinstance(motion, Inertial)
    return timing if rests and isinstance(timing, FromRows) else None


@inner
def meet_obstacle(timing, model, state, i, now, every, until):
    """Return when i touches an obstacle, and its number, or -1.

    The time is as computed now, or from the row of i or shortly before the contact. ``every`` and ``until``
    are as for :func:`carom.engine.obstacles.soonest`.
    """
    if timing is None:
        t, number = soonest(model.obstacles, model, state, i, now, every, until)
        return now + t, number
    me = state.rows[i]
    vv = 0.0
    for axis in range(len(model.boundary.edges)):
        v = np.float64(velocity(model.motion, axis, me.v[axis], now - me.t))
        vv += v * v
    then = np.float64(me.t)
    start = now if (now - then) * (now - then) * vv > timing.square else then
    t, number = soonest(model.obstacles, model, state, i, start, every, until)
    event_time = start + t
    if event_time < NEVER and (event_time - then) * (event_time - then) * vv > timing.square:
        then = start_before(timing.square, vv, event_time)
        t, repeats = soonest(model.obstacles, model, state, i, then, every, until)
        event_time = then + t if repeats == number else event_time
    return max(event_time, now), number
