"""Obstacles that move, as the engine compiles them: a body displaced along a line by a path."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Annotated, Any

import numpy as np

from carom.models.interfaces.memory import ROOM, parameter, present
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import Particles
from carom.models.mathematics.parabolas import HOP, Course
from carom.models.obstacles.paths import Path


class Displaced(ObstacleModel):
    """A body that is displaced along a course."""

    body: Any  # model of the obstacle without displacement
    course: Course  # the motion along the line
    free: tuple  # acceleration of a component without field: zeros
    rest: Annotated[float, parameter(-1)]  # least speed, relative to the body, after a contact
    begin: Annotated[np.ndarray, present(1)]
    """Time of the path when the counting of epochs began, (1,) float64."""
    phase: Annotated[np.ndarray, present(1)]  # the same at the beginning of this epoch, (1,) float64
    epochs: Annotated[np.ndarray, present()]  # epochs counted, (1,) int64
    away: Annotated[np.ndarray, ROOM]  # displacement at the contact that is asked about, (1,) float64
    shifted: Annotated[np.ndarray, ROOM]  # room for a position, (d,)

    def shift_epoch(self, duration):
        # Products and remainders are exact: the phase does not drift, however many epochs there are.
        self.epochs[0] += 1
        period = self.course.period
        elapsed = (np.float64(self.epochs[0]) * duration) % period
        self.phase[0] = (self.begin[0] + elapsed) % period

    def copy_state(self, before, instant, passed, slower):
        self.begin[0] = self.phase[0] = float(instant % Fraction(self.course.period))
        self.epochs[0] = 0

    def encounter(self, x, v, radius, growth):
        return self.arrival(x, v, radius, growth, 0.0)

    def arrival(self, x, v, radius, growth, now):
        return self.fall(self.free, x, v, radius, growth, now)

    def fall(self, g, x, v, radius, growth, now):
        return self.body.time_to_moving(self.course, self.phase[0] + now, g, x, v, radius, growth)

    def is_periodic(self):
        return self.body.is_periodic()

    def anchor(self, axis):
        return self.body.anchor(axis)

    def at_time(self, now):
        self.away[0] = self.course.path.place(self.phase[0] + now)

    def outward(self, x, axis):
        for k in range(len(self.shifted)):
            self.shifted[k] = x[k] - self.course.direction[k] * self.away[0]
        return self.body.outward(self.shifted, axis)

    def surface_speed(self, normal, now):
        along = 0.0
        for axis in range(len(self.course.direction)):
            along += normal[axis] * self.course.direction[axis]
        return along * self.course.path.pace(self.phase[0] + now)

    def surface_velocity(self, axis, now):
        return self.course.direction[axis] * self.course.path.pace(self.phase[0] + now)

    def rest_speed(self):
        return self.rest

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        approach = growth + self.surface_speed(normal, now)
        for axis in range(len(v)):
            approach -= normal[axis] * v[axis]
        approach = max(approach, 0.0)
        motion.push(approach + max(approach, motion.rest_speed(), self.rest), v, normal)


def displaced(body: Any, direction: tuple[float, ...], path: Path, particles: Particles) -> Displaced:
    """Return a body that a path displaces along a unit vector."""
    unit, d = particles.unit, len(direction)
    course = Course(
        path.model(unit),
        direction,
        float(path.lowest),
        float(path.highest),
        float(unit.to_kernel(path.acceleration, -2)),
        float(unit.to_kernel(path.period, 1)),
    )
    rest = math.sqrt(2.0 * HOP * max(particles.box) * course.bend)
    memory = np.zeros(1), np.zeros(1), np.zeros(1, np.int64), np.zeros(1), np.zeros(d)
    return Displaced(body, course, (0.0,) * d, rest, *memory)
