"""Charges in a magnetic field, a curved motion of one's own: between walls, around balls, and growing."""

import math

import numpy as np

import carom
from carom.models import own
from carom.models.mathematics.roots import Curve, next_fall
from carom.models.obstacles.named_walls import axes_without


class Circling(Curve):
    """A charge relative to another, or to a ball: the square of their distance, less that of contact."""

    x: float
    y: float
    u: float
    v: float
    w: float
    contact: float
    rate: float

    def value(self, t):
        s, c = math.sin(self.w * t) / self.w, 2.0 * math.sin(0.5 * self.w * t) ** 2 / self.w
        x, y = self.x + self.u * s + self.v * c, self.y + self.v * s - self.u * c
        return x * x + y * y - (self.contact + self.rate * t) ** 2

    def slope(self, t):
        s, c = math.sin(self.w * t) / self.w, 2.0 * math.sin(0.5 * self.w * t) ** 2 / self.w
        x, y = self.x + self.u * s + self.v * c, self.y + self.v * s - self.u * c
        u, v = self.u - self.w * (self.u * c - self.v * s), self.v - self.w * (self.v * c + self.u * s)
        return 2.0 * (x * u + y * v) - 2.0 * (self.contact + self.rate * t) * self.rate

    def curvature(self, start, end):
        speed = math.sqrt(self.u * self.u + self.v * self.v)
        far = math.sqrt(self.x * self.x + self.y * self.y) + speed * min(2.0 / self.w, end)
        return 2.0 * speed * (speed + far * self.w) + 2.0 * self.rate * self.rate


class Height(Curve):
    """The gap between a charge and a wall: ``u`` is the velocity towards it, ``v`` that which turns to it."""

    gap: float
    u: float
    v: float
    w: float
    rate: float

    def value(self, t):
        return (
            self.gap
            - self.rate * t
            - (self.u * math.sin(self.w * t) + self.v * 2.0 * math.sin(0.5 * self.w * t) ** 2) / self.w
        )

    def slope(self, t):
        return -self.rate - self.u * math.cos(self.w * t) - self.v * math.sin(self.w * t)

    def curvature(self, start, end):
        return self.w * math.sqrt(self.u * self.u + self.v * self.v)


LONG = 8.0 * math.pi
"""Phases to look ahead: some turns, for what grows."""


def turn(w, x, v, t, there, then):
    """Write place and velocity of a charge a time ``t`` later."""
    vx, vy = v[0], v[1]
    s, c = math.sin(w * t), 2.0 * math.sin(0.5 * w * t) ** 2
    there[0] = x[0] + (vx * s + vy * c) / w
    there[1] = x[1] + (vy * s - vx * c) / w
    then[0] = vx + vy * s - vx * c
    then[1] = vy - vx * s - vy * c


@own.motion
class Magnetic:
    """Equal charges of equal mass in a magnetic field: they turn with one frequency."""

    frequency: own.Rate
    wraps: tuple[int, int] = (0, 0)
    straight = False
    curved = True

    @own.prepared
    def box(self, particles):
        return tuple(map(float, particles.box))

    def conserves(self, axis):
        return False

    def position(self, axis, x, v, t):
        return x + v * t

    def velocity(self, axis, v, t):
        return v

    def carry(self, x, v, t, there, then):
        turn(self.frequency, x, v, t, there, then)
        return there, then, 0.0

    def meeting_time(self, me, other, now, contact, rate, limit, span):
        w = self.frequency
        a, b = np.empty(2), np.empty(2)
        u, v = np.empty(2), np.empty(2)
        turn(w, me.x, me.v, now - me.t, a, u)
        turn(w, other.x, other.v, now - other.t, b, v)
        best, clamped = own.NEVER, False
        for kx in range(-self.wraps[0], self.wraps[0] + 1):
            for ky in range(-self.wraps[1], self.wraps[1] + 1):
                x, y = b[0] - a[0] + kx * self.box[0], b[1] - a[1] + ky * self.box[1]
                curve = Circling(x, y, v[0] - u[0], v[1] - u[1], w, contact, rate)
                t = next_fall(curve, min(span, 2.0 * math.pi / w) if rate == 0.0 else span)
                if t < best:
                    best, clamped = t, t == 0.0 and curve.value(0.0) < 0.0
        return best, clamped

    def meeting(self, obstacle, x, v, radius, growth, now):
        center, contact = obstacle.center, obstacle.radius + radius
        w = self.frequency
        curve = Circling(x[0] - center[0], x[1] - center[1], v[0], v[1], w, contact, growth)
        return next_fall(curve, LONG / w)

    def wall_meeting(self, walls, x, v, radius, growth):
        best, number = own.NEVER, np.int64(-1)
        for axis in range(2):
            if self.wraps[axis] == 0:
                turned = v[1] if axis == 0 else -v[0]
                for side in range(2):
                    sense = 1.0 if side == 1 else -1.0
                    gap = (self.box[axis] - x[axis] if side == 1 else x[axis]) - radius
                    curve = Height(gap, sense * v[axis], sense * turned, self.frequency, growth)
                    t = next_fall(curve, LONG / self.frequency)
                    if t < best:
                        best, number = t, np.int64(2 * axis + side)
        return best, number


def charges(n, box, wraps, obstacles=(), seed=1):
    """Return charges in a box with walls along the axes along which it does not wrap."""
    start = carom.Scene.random(
        n, box=box, seed=seed, walls=axes_without([bool(k) for k in wraps]), obstacles=obstacles
    )
    return start.replace(motion=Magnetic(1.5, wraps))


def least_gap(frame, scene):
    """Return the least gap between a charge and what is fixed [length]."""
    gaps = [
        gap
        for axis in range(2)
        if not scene.periodic[axis]
        for gap in (frame.positions[:, axis], scene.box[axis] - frame.positions[:, axis])
    ]
    least = min(float((gap - 0.5 * frame.diameters).min()) for gap in gaps)
    fixed = [
        each.gap(frame.positions, 0.5 * frame.diameters, scene.box, scene.periodic)
        for each in scene.obstacles
    ]
    return min([least, *(float(gap.min()) for gap in fixed)])
