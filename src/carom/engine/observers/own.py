"""Observers of the user's own: events as they see them, in the units of the scene."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from carom.compiling import registry
from carom.engine.observers.interface import Observer
from carom.models.questions.memory import GIVEN, ORIGIN, ROOM, UNIT
from carom.models.questions.observer import Epoch, ObstacleEvent, PairEvent, at_epoch, at_obstacle, at_pair


class Own(Observer):
    """An observer of the user's own, and room for what it is told."""

    observer: Annotated[Any, GIVEN]  # the user's NamedTuple
    origin: Annotated[np.ndarray, ORIGIN]
    """When the counting of epochs began, since the start of the run, (1,) float64."""
    exponent: Annotated[int, UNIT]  # the engine's unit of time is two to this power of the scene's
    places: np.ndarray  # place of every obstacle in the scene's order, by the engine's number, int64
    r: Annotated[np.ndarray, ROOM]  # (d,)
    normal: Annotated[np.ndarray, ROOM]  # (d,)
    x: Annotated[np.ndarray, ROOM]  # (2, d)
    before: Annotated[np.ndarray, ROOM]  # (2, d)
    after: Annotated[np.ndarray, ROOM]  # (2, d)
    all_x: Annotated[np.ndarray, ROOM]  # (n, d), empty where nobody observes epochs
    all_v: Annotated[np.ndarray, ROOM]  # (n, d), likewise

    def before_pair(self, model, state, event):
        _write(self, state, event.i, self.before, 0)
        _write(self, state, event.j, self.before, 1)
        for axis in range(len(model.boundary.edges)):
            x = self.x[1, axis] - self.x[0, axis]
            self.r[axis] = model.boundary.separation(event.i, event.ref, axis, x)

    def after_pair(self, model, state, event):
        _write(self, state, event.i, self.after, 0)
        _write(self, state, event.j, self.after, 1)
        at_pair(
            self.observer,
            PairEvent(
                event.i,
                event.j,
                _time(self, state, event.now),
                self.r,
                self.x,
                self.before,
                self.after,
                math.ldexp(np.float64(event.virial), -self.exponent),
                event.kind,
            ),
        )

    def before_obstacle(self, model, state, i, now):
        _write(self, state, i, self.before, 0)

    def after_obstacle(self, model, state, event):
        _write(self, state, event.i, self.after, 0)
        for axis in range(len(model.boundary.edges)):
            self.normal[axis] = model.obstacles.image[axis]
        at_obstacle(
            self.observer,
            ObstacleEvent(
                event.i,
                self.places[event.number],
                _time(self, state, event.now),
                self.normal,
                self.x[0],
                self.before[0],
                self.after[0],
                math.ldexp(np.float64(event.momentum), -self.exponent),
                math.ldexp(np.float64(event.energy), -2 * self.exponent),
            ),
        )

    def at_epoch(self, model, state, length):
        for i in range(len(self.all_x)):
            row = state.rows[i]
            for axis in range(len(row.x)):
                self.all_x[i, axis] = row.x[axis]
                self.all_v[i, axis] = math.ldexp(np.float64(row.v[axis]), -self.exponent)
        if len(self.all_x) > 0:
            time = _time(self, state, length)
            at_epoch(self.observer, Epoch(time, self.all_x, self.all_v))


def make_own(observer, n: int, dimension: int, exponent: int, numbers: list[int], origin: float = 0.0) -> Own:
    """Return what the engine tells an observer of n components; ``numbers`` are those of obstacles."""
    places = np.full(max(numbers, default=-1) + 1, -1)
    places[numbers] = np.arange(len(numbers))
    rows = n if registry.answers(at_epoch, type(observer)) else 0
    return Own(
        observer=observer,
        origin=np.array([origin]),
        exponent=exponent,
        places=places,
        r=np.zeros(dimension),
        normal=np.zeros(dimension),
        x=np.zeros((2, dimension)),
        before=np.zeros((2, dimension)),
        after=np.zeros((2, dimension)),
        all_x=np.zeros((rows, dimension)),
        all_v=np.zeros((rows, dimension)),
    )


def name_of(observer) -> str:
    """Return the name of an observer's class: the user's, where it is their own."""
    return type(observer.observer if isinstance(observer, Own) else observer).__name__


def _write(own, state, i, velocities, slot):
    """Write position and velocity of component i, which is up to date, into a row of the rooms."""
    row = state.rows[i]
    for axis in range(len(row.x)):
        own.x[slot, axis] = row.x[axis]
        velocities[slot, axis] = math.ldexp(np.float64(row.v[axis]), -own.exponent)


def _time(own, state, now):
    """Return the time since the start of the run."""
    clock = state.clock[0]
    return math.ldexp(own.origin[0] + (np.float64(clock.epoch) * clock.length + now), own.exponent)
