"""Observers of the user's own: events as they see them, in the units of the scene."""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np

from carom.compiling import registry
from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import GIVEN, ORIGIN, ROOM, UNIT
from carom.models.interfaces.observer import Epoch, ObstacleEvent, PairEvent


class Own(Observer):
    """An observer of the user's own, and room for what it is told."""

    observer: Annotated[Any, GIVEN]  # the user's model
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
        _write(self, model, state, event.i, event.now, self.before[0], self.x[0])
        _write(self, model, state, event.j, event.now, self.before[1], self.x[1])
        me, other = state.rows[event.i], state.rows[event.j]
        for axis in range(len(self.r)):
            self.r[axis] = model.motion.contact_vector(
                model.boundary, event.i, event.ref, axis, me, other, event.now
            )

    def after_pair(self, model, state, event):
        _write(self, model, state, event.i, event.now, self.after[0], self.x[0])
        _write(self, model, state, event.j, event.now, self.after[1], self.x[1])
        self.observer.at_pair(
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
        _write(self, model, state, i, now, self.before[0], self.x[0])

    def after_obstacle(self, model, state, event):
        _write(self, model, state, event.i, event.now, self.after[0], self.x[0])
        for axis in range(len(model.boundary.edges)):
            self.normal[axis] = model.obstacles.image[axis]
        self.observer.at_obstacle(
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
                np.float64(model.pair.radius_of(event.i, event.now)),
            ),
        )

    def at_epoch(self, model, state, length):
        for i in range(len(self.all_x)):
            _write(self, model, state, i, length, self.all_v[i], self.all_x[i])
        if len(self.all_x) > 0:
            time = _time(self, state, length)
            self.observer.at_epoch(Epoch(time, self.all_x, self.all_v))


def make_own(observer, n: int, dimension: int, exponent: int, numbers: list[int], origin: float = 0.0) -> Own:
    """Return what the engine tells an observer of n components; ``numbers`` are those of obstacles."""
    places = np.full(max(numbers, default=-1) + 1, -1)
    places[numbers] = np.arange(len(numbers))
    rows = n if registry.answers("at_epoch", type(observer)) else 0
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


def _write(own, model, state, i, now, v, x):
    """Write velocity and position of component i, which is up to date at ``now``, into rooms (d,)."""
    row = state.rows[i]
    for axis in range(len(row.x)):
        x[axis] = model.motion.in_space(axis, row.x, now)
        v[axis] = math.ldexp(np.float64(row.v[axis]), -own.exponent)


def _time(own, state, now):
    """Return the time since the start of the run."""
    clock = state.clock[0]
    return math.ldexp(own.origin[0] + (np.float64(clock.epoch) * clock.length + now), own.exponent)
