"""Models of one's own with the faults that are looked for: interactions, motions, curves."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from carom.models import own
from carom.models.mathematics.contact import elastic, first_contact
from carom.models.questions.interaction import interaction_time, jump
from carom.models.questions.motion import carry, meeting_time, position, velocity
from carom.models.questions.particles import NEVER


class Two(NamedTuple):
    """Hard cores: unlike kinds touch at one distance, like ones at another."""

    like: float
    unlike: float
    kinds: np.ndarray
    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Two, i, j, rr, rv, vv, now):
    return first_contact(rr - (pair.like if pair.kinds[i] == pair.kinds[j] else pair.unlike), rv, vv)


@jump.register
def _(pair: Two, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


@dataclass(frozen=True)
class Parity:
    """Components with even and odd numbers."""

    like: float = 1.0
    unlike: float = 0.6
    far: object = 1.0
    change: tuple = ()
    penetrable = True

    def reach(self, scene):
        return self.far

    def model(self, particles):
        kinds = particles.with_ghost(np.arange(len(particles.radii)) % 2, np.int64)
        sizes = particles.with_ghost(particles.radii), particles.with_ghost(particles.masses)
        return Two(self.like**2, self.unlike**2, kinds, *sizes)._replace(**dict(self.change))


@own.motion
class Drag:
    """Drag: v' = -g v."""

    g: own.Rate
    straight = False

    def conserves(self, axis):
        return False

    def position(self, axis, x, v, t):
        return x - v * math.expm1(-self.g * t) / self.g

    def velocity(self, axis, v, t):
        return v * math.exp(-self.g * t)

    def exit_time(self, axis, x, v, low, high):
        way = max(high - x, 0.0) if v > 0.0 else max(x - low, 0.0)
        part = self.g * way / abs(v) if v != 0.0 else 1.0
        return (-math.log1p(-part) / self.g if part < 1.0 else NEVER), np.int64(v > 0.0)


@own.interaction
class DragCores:
    """Hard cores whose times are those of the drag."""

    g: own.Rate

    def reach(self, scene):
        return 1.0

    def interaction_time(self, i, j, rr, rv, vv, now):
        part = self.g * first_contact(rr - 1.0, rv, vv)
        return -math.log1p(-part) / self.g if part < 1.0 else NEVER

    def jump(self, i, j, rr, rv, now):
        return elastic(self, i, j, rr, rv)


class Curve(NamedTuple):
    """Free flight, as if it were a curve."""

    edges: tuple
    images: bool


@position.register
def _(motion: Curve, axis, x, v, t):
    return x


@velocity.register
def _(motion: Curve, axis, v, t):
    return v


@carry.register
def _(motion: Curve, x, v, t, there, then):
    for axis in range(len(x)):
        there[axis], then[axis] = x[axis] + v[axis] * t, v[axis]
    return there, then, 0.0


@meeting_time.register
def _(motion: Curve, me, other, now, contact, rate, limit, span):
    soonest, most = NEVER, 6 if motion.images else 0
    for left in range(-most, most + 1):
        for up in range(-most, most + 1):
            rr, rv, vv = -contact * contact, -contact * rate, -rate * rate
            for axis in range(2):
                r = other.x[axis] - me.x[axis] + (left, up)[axis] * motion.edges[axis]
                r += other.v[axis] * (now - other.t) - me.v[axis] * (now - me.t)
                u = other.v[axis] - me.v[axis]
                rr, rv, vv = rr + r * r, rv + r * u, vv + u * u
            soonest = min(soonest, first_contact(rr, rv, vv))
    return soonest, False


@dataclass(frozen=True)
class Curved:
    images: bool
    straight = False
    curved = True

    def conserves(self, axis):
        return True

    def model(self, particles):
        return Curve(particles.box, self.images)
