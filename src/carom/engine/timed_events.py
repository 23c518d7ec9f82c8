"""Events of a drive (``carom.models.drives``), as events of one component."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from carom.compiling.registry import answering, inner
from carom.engine import one_body
from carom.engine.advance import advance, place_at
from carom.engine.constants import TIMER_EVENT
from carom.engine.observers.interface import after_kick, before_kick, gain, record
from carom.models.drives import kick, next_time
from carom.models.questions.interaction import mass
from carom.models.questions.memory import GIVEN, ORIGIN, ROOM, UNIT


@answering(one_body)
class Timers(NamedTuple):
    """A drive, and what it is told in the units of the scene."""

    drive: Annotated[Any, GIVEN]  # its model
    free: Any  # which components are not pinned, (n,) bool, or None where none is
    origin: Annotated[np.ndarray, ORIGIN]
    """When the counting of epochs began, since the start of the run, in the engine's unit, (1,) float64."""
    exponent: Annotated[int, UNIT]  # the engine's unit of time is two to this power of the scene's
    x: Annotated[np.ndarray, ROOM]  # room for a position, (d,)
    v: Annotated[np.ndarray, ROOM]  # room for a velocity, (d,)

    def earlier_event(self, model, state, i, now, t, code):
        if not is_free(self.free, i):
            return t, code
        place_at(model, state, i, now, self.x, self.v)
        for axis in range(len(self.v)):
            self.v[axis] = math.ldexp(self.v[axis], -self.exponent)
        begun = _since(self, state)
        time = math.ldexp(begun + now, self.exponent)
        next_kick = next_time(self.drive, np.int64(i), self.x, self.v, time)
        until = max(math.ldexp(np.float64(next_kick), -self.exponent) - begun, now)
        return (until, np.int64(TIMER_EVENT)) if until < t else (t, code)

    def run_event(self, model, state, neighbors, i, code, now):
        if code != TIMER_EVENT:
            return False
        advance(model, state, neighbors, i, now)
        before_kick(model.observers, model, state, i, now)
        me = state.rows[i]
        before = 0.0
        for axis in range(len(me.v)):
            v = np.float64(me.v[axis])
            before += v * v
            self.x[axis] = me.x[axis]
            self.v[axis] = math.ldexp(v, -self.exponent)
        weight = mass(model.pair, np.int64(i))
        time = math.ldexp(_since(self, state) + now, self.exponent)
        kick(self.drive, np.int64(i), weight, self.x, self.v, time)
        after = 0.0
        for axis in range(len(me.v)):
            me.v[axis] = math.ldexp(self.v[axis], self.exponent)
            v = np.float64(me.v[axis])
            after += v * v
        after_kick(model.observers, model, state, i, now)
        gain(model.observers, 0.5 * weight * (after - before), now)
        record(model.observers, state.clock[0], np.int64(i), code, 0.0)
        return True


def make_timers(drive, dimension: int, exponent: int, pinned: np.ndarray | None) -> Timers:
    """Return the events of a drive before the first has happened."""
    scratch = np.zeros(dimension), np.zeros(dimension)
    free = None if pinned is None else ~pinned
    return Timers(drive, free, np.zeros(1), exponent, *scratch)


@inner
def is_free(free, i):
    """Tell whether component i is not pinned; by default none is."""
    return True if free is None else free[i]


@inner
def _since(timers, state):
    """Return the time from the start of the run to the beginning of the epoch, in the engine's unit."""
    clock = state.clock[0]
    return timers.origin[0] + np.float64(clock.epoch) * clock.length
