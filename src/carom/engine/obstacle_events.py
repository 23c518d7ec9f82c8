"""Contacts with obstacles, as events of one component: when they happen, and what they do."""

from __future__ import annotations

import numpy as np

from carom.compiling.registry import optional
from carom.engine.advance import advance
from carom.engine.constants import LAMBDA, OBSTACLE
from carom.engine.dynamic_obstacles import ObstacleWork
from carom.engine.observers.interface import ObstacleEvent, after_obstacle, before_obstacle, gain, record
from carom.engine.obstacles import Obstacles, gained, reflect_component, soonest
from carom.engine.one_body import earlier_event, event_in_view, retime_event, run_event
from carom.engine.search import FromRows, start_before
from carom.models.motions.free_flight import Inertial
from carom.models.questions.interaction import growth
from carom.models.questions.motion import velocity
from carom.models.questions.particles import NEVER


@earlier_event.register
def _(source: Obstacles, model, state, i, now, t, code):
    touch, number = meet_obstacle(model.timing, model, state, i, now, True, t)
    return (touch, OBSTACLE - number) if touch < t else (t, code)


@event_in_view.register
def _(source: Obstacles, model, state, i, now):
    # Of obstacles that stand in every image of the box, those in the next images are seen.
    until = np.float64(state.rows[i].event_time)
    touch, number = meet_obstacle(model.timing, model, state, i, now, False, until)
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


@retime_event.register
def _(source: Obstacles, model, state, i, code):
    retime_contact(model.motion, source, model, state, i, code)


@optional
def retime_contact(motion, obstacles, model, state, i, code):
    """Compute the contact of i with its obstacle anew; in a field, by default, keep it."""
    return


@retime_contact.register
def _(motion: Inertial, obstacles, model, state, i, code):
    touch, number = meet_resting(obstacles.live, model.timing, model, state, i, 0.0, True, NEVER)
    if OBSTACLE - number == code:
        state.rows[i].event_time = touch


@optional
def meet_obstacle(timing, model, state, i, now, every, until):
    """Return when i touches an obstacle, and the number of that obstacle, or -1; by default as it is computed
    now. ``every`` and ``until`` as for :func:`carom.engine.obstacles.soonest`.
    """
    t, number = soonest(model.obstacles, model, state, i, now, every, until)
    return now + t, number


@meet_obstacle.register
def _(timing: FromRows, model, state, i, now, every, until):
    return meet_in_flight(model.motion, timing, model, state, i, now, every, until)


@optional
def meet_in_flight(motion, timing, model, state, i, now, every, until):
    """Return the same; by default, in a field, as it is computed now."""
    t, number = soonest(model.obstacles, model, state, i, now, every, until)
    return now + t, number


@meet_in_flight.register
def _(motion: Inertial, timing, model, state, i, now, every, until):
    return meet_resting(model.obstacles.live, timing, model, state, i, now, every, until)


@optional
def meet_resting(live, timing, model, state, i, now, every, until):
    """Return the same, computed from the row of i or from shortly before the contact, where all obstacles
    rest.
    """
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


@meet_resting.register
def _(live: ObstacleWork, timing, model, state, i, now, every, until):
    t, number = soonest(model.obstacles, model, state, i, now, every, until)
    return now + t, number
