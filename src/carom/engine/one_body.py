"""Events of one component: a contact with an obstacle (the paper's Q_ik), a call of a rule, a kick.

Each *source*, a part of the model or None, says when it has an event for a component, and runs it. The
earliest is taken here and nowhere else; the partner is then its code (:mod:`carom.engine.constants`).
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from carom.engine.advance import advance, place_at
from carom.engine.constants import LAMBDA, OBSTACLE, TIMER_EVENT
from carom.engine.observers.interface import ObstacleEvent
from carom.engine.obstacles import gained, reflect_component, soonest
from carom.engine.rules import rule_event, run_rule
from carom.engine.search import FromRows, start_before
from carom.models.interfaces.memory import GIVEN, ORIGIN, ROOM, UNIT
from carom.models.interfaces.particles import NEVER
from carom.models.motions.free_flight import Inertial


def schedule_one_body(model, state, i, now, before):
    """Give i its next own event, if before ``before``; tell whether. Ties: the first source."""
    t, code = contact_event(model.obstacles, model, state, i, now, before, LAMBDA)
    t, code = rule_event(model.rules, model, state, i, now, t, code)
    t, code = kick_event(model.timers, model, state, i, now, t, code)
    if t >= before:
        return False
    state.rows[i].event_time = t
    state.partner[i] = code
    return True


def run_one_body(model, state, neighbors, i, code, now):
    """Run the event of component i that the code names; False if it is an advancement."""
    if run_rule(model.rules, model, state, neighbors, i, code, now):
        return True
    if run_kick(model.timers, model, state, neighbors, i, code, now):
        return True
    return run_contact(model.obstacles, model, state, neighbors, i, code, now)


def contact_event(obstacles, model, state, i, now, t, code):
    """Return time and code of i's next contact with an obstacle, if before ``t``; else ``t`` and ``code``."""
    if obstacles is None:
        return t, code
    touch, number = meet_obstacle(obstacles.timing, model, state, i, now, True, t)
    return (touch, OBSTACLE - number) if touch < t else (t, code)


def event_in_view(obstacles, model, state, i, now):
    """Return the same of contacts that a change of sector may bring into view.

    Of obstacles that stand in every image of the box, those in the next images are seen.
    """
    if obstacles is None:
        return NEVER, LAMBDA
    until = np.float64(state.rows[i].event_time)
    touch, number = meet_obstacle(obstacles.timing, model, state, i, now, False, until)
    return touch, OBSTACLE - number


def run_contact(obstacles, model, state, neighbors, i, code, now):
    """Run the contact of component i with an obstacle, if the code names one; tell whether it does."""
    if obstacles is None:
        return False
    if code == LAMBDA:
        return False
    number = OBSTACLE - code
    advance(model, state, neighbors, i, now)
    model.observers.before_obstacle(model, state, i, now)
    momentum = reflect_component(model, state, i, number, now)
    energy = gained(obstacles.live, momentum, model.pair.growth_of(i))
    model.observers.gain(energy, now)
    model.observers.after_obstacle(model, state, ObstacleEvent(i, number, now, momentum, energy))
    model.observers.record(state.clock[0], i, code, momentum)
    return True


def retime_contact(model, state, i, code):
    """Compute i's obstacle contact anew at an epoch's beginning; in a field keep it."""
    if model.obstacles is None or not isinstance(model.motion, Inertial):
        return
    touch, number = meet_obstacle(model.obstacles.timing, model, state, i, 0.0, True, NEVER)
    if OBSTACLE - number == code:
        state.rows[i].event_time = touch


def wall_timing(timing, motion, live) -> FromRows | None:
    """Return how times of contacts are computed: as of pairs if all obstacles rest and flight is straight."""
    rests = live is None and isinstance(motion, Inertial)
    return timing if rests and isinstance(timing, FromRows) else None


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
        v = np.float64(model.motion.velocity(axis, me.v[axis], now - me.t))
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


class Timers(NamedTuple):
    """A drive, and what it is told in the units of the scene."""

    drive: Annotated[Any, GIVEN]  # its model
    free: Any  # which components are not pinned, (n,) bool, or None where none is
    origin: Annotated[np.ndarray, ORIGIN]
    """When the counting of epochs began, since the start of the run, in the engine's unit, (1,) float64."""
    exponent: Annotated[int, UNIT]  # the engine's unit of time is two to this power of the scene's
    x: Annotated[np.ndarray, ROOM]  # room for a position, (d,)
    v: Annotated[np.ndarray, ROOM]  # room for a velocity, (d,)


def make_timers(drive, dimension: int, exponent: int, pinned: np.ndarray | None) -> Timers:
    """Return the events of a drive before the first has happened."""
    scratch = np.zeros(dimension), np.zeros(dimension)
    free = None if pinned is None else ~pinned
    return Timers(drive, free, np.zeros(1), exponent, *scratch)


def kick_event(timers, model, state, i, now, t, code):
    """Return time and code of i's next kick, if before ``t``; else ``t`` and ``code``."""
    if timers is None:
        return t, code
    if not is_free(timers.free, i):
        return t, code
    place_at(model, state, i, now, timers.x, timers.v)
    for axis in range(len(timers.v)):
        timers.v[axis] = math.ldexp(timers.v[axis], -timers.exponent)
    begun = _since(timers, state)
    time = math.ldexp(begun + now, timers.exponent)
    next_kick = timers.drive.next_time(i, timers.x, timers.v, time)
    until = max(math.ldexp(np.float64(next_kick), -timers.exponent) - begun, now)
    return (until, TIMER_EVENT) if until < t else (t, code)


def run_kick(timers, model, state, neighbors, i, code, now):
    """Run the kick of component i, if the code names one; tell whether it does."""
    if timers is None:
        return False
    if code != TIMER_EVENT:
        return False
    advance(model, state, neighbors, i, now)
    model.observers.before_kick(model, state, i, now)
    me = state.rows[i]
    before = 0.0
    for axis in range(len(me.v)):
        v = np.float64(me.v[axis])
        before += v * v
        timers.x[axis] = me.x[axis]
        timers.v[axis] = math.ldexp(v, -timers.exponent)
    weight = model.pair.mass_of(i)
    time = math.ldexp(_since(timers, state) + now, timers.exponent)
    timers.drive.kick(i, weight, timers.x, timers.v, time)
    after = 0.0
    for axis in range(len(me.v)):
        me.v[axis] = math.ldexp(timers.v[axis], timers.exponent)
        v = np.float64(me.v[axis])
        after += v * v
    model.observers.after_kick(model, state, i, now)
    model.observers.gain(0.5 * weight * (after - before), now)
    model.observers.record(state.clock[0], i, code, 0.0)
    return True


def is_free(free, i):
    """Tell whether component i is not pinned; by default none is."""
    return True if free is None else free[i]


def _since(timers, state):
    """Return the time from the start of the run to the beginning of the epoch, in the engine's unit."""
    clock = state.clock[0]
    return timers.origin[0] + np.float64(clock.epoch) * clock.length
