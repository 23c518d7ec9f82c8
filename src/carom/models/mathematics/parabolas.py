"""Contacts on parabolas, with fixed and with moving obstacles.

With a fixed plane: the root of a quadratic equation. With what is round or moves: a bracketed root
(``mathematics.roots``), searched as long as the two can be near each other.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from carom.models.interfaces.memory import parameter
from carom.models.interfaces.obstacle import PathModel
from carom.models.interfaces.particles import NEVER
from carom.models.mathematics.roots import Curve, next_fall

SURE = 1.0 + 2.0**-30
"""A contact that comes for certain within a time is looked for so much longer, to allow for rounding."""

HOP = 2.0**-48
"""Part of the longest edge to which what rests on a surface is thrown at least: 32 roundings of a place."""


class Still(PathModel):
    """No displacement."""

    still: bool = True  # always true: an empty tuple would count as false

    def place(self, t):
        return 0.0

    def pace(self, t):
        return 0.0


class Course(NamedTuple):
    """How a body is displaced: to and fro along a unit vector."""

    path: Any  # answers ``place`` and ``pace``
    direction: tuple  # unit vector
    lowest: float  # the least that ``place`` returns [length]
    highest: float  # the most [length]
    bend: Annotated[float, parameter(-2)]  # bound on the magnitude of the acceleration
    period: Annotated[float, parameter(1)]  # after which the path repeats itself


def first_landing(height, speed, acceleration):
    """Return the first time at which ``height + speed t + acceleration t^2 / 2`` is <= 0 and falling.

    The roots keep their digits. What is inside by rounding and moves out lands when it is back, or at its
    turning point.
    """
    if height <= 0.0 and (speed < 0.0 or (speed == 0.0 and acceleration < 0.0)):
        return 0.0
    root = speed * speed - 2.0 * acceleration * height
    if acceleration < 0.0:
        root = np.sqrt(max(root, 0.0))
        return 2.0 * height / (root - speed) if speed < 0.0 else (speed + root) / -acceleration
    if speed >= 0.0 or root < 0.0:
        return NEVER
    return 2.0 * height / (np.sqrt(root) - speed)


def last_passing(height, speed, acceleration):
    """Return the last time at which ``height + speed t + acceleration t^2 / 2`` is <= 0; negative: past."""
    root = speed * speed - 2.0 * acceleration * height
    if root < 0.0:
        return -NEVER
    root = np.sqrt(root)
    if speed > 0.0:
        return -2.0 * height / (speed + root)
    return (root - speed) / acceleration if acceleration > 0.0 else -NEVER


def leaving(x, v, g, low, high):
    """Return the time until ``x + v t + g t^2 / 2`` leaves an interval, and at which end, 0 or 1."""
    up = int(v > 0.0 or (v == 0.0 and g > 0.0))
    root = v * v + 2.0 * g * ((high if up else low) - x)
    if root < 0.0:  # it turns round before, and leaves at the other end
        up = 1 - up
        back = np.sqrt(max(v * v + 2.0 * g * ((high if up else low) - x), 0.0))
        return (abs(v) + back) / abs(g), up
    way = abs(v) + np.sqrt(root)
    return 2.0 * abs((high if up else low) - x) / way if way > 0.0 else NEVER, up


class Lift(Curve):
    """Height of a component above a plane that moves."""

    course: Course
    start: float
    slant: float  # part of the displacement that is along the normal
    height: float
    speed: float
    acceleration: float

    def value(self, t):
        flight = self.height + (self.speed + 0.5 * self.acceleration * t) * t
        return flight - self.slant * self.course.path.place(self.start + t)

    def slope(self, t):
        return self.speed + self.acceleration * t - self.slant * self.course.path.pace(self.start + t)

    def curvature(self, start, end):
        return abs(self.acceleration) + abs(self.slant) * self.course.bend


def time_to_plane(course, start, slant, height, speed, acceleration):
    """Return the time until a component with a height above a plane touches it as it is displaced, or NEVER.

    ``height`` is that above the plane where this is not displaced, ``slant`` the part of the displacement
    that is along the normal.
    """
    low = min(slant * course.lowest, slant * course.highest)
    high = max(slant * course.lowest, slant * course.highest)
    curve = Lift(course, start, slant, height, speed, acceleration)
    if acceleration < 0.0 or (acceleration == 0.0 and speed < 0.0):
        limit = SURE * first_landing(height - low, speed, acceleration)
        over = height - high
        root = speed * speed - 2.0 * acceleration * over
        if over <= 0.0 and (speed <= 0.0 or root < 0.0):
            return next_fall(curve, limit)
        if over <= 0.0:  # it leaves the heights at which the plane may be, or is met before
            t = next_fall(curve, SURE * -2.0 * over / (speed + np.sqrt(root)))
            if t < NEVER:
                return t
        # Nothing happens until it is back, or comes there.
        back = (2.0 - SURE) * first_landing(over, speed, acceleration)
        return back + next_fall(later(curve, back), limit - back)
    if acceleration > 0.0 or speed > 0.0:
        limit = last_passing(height - high, speed, acceleration)
    else:
        limit = course.period if height <= high else -NEVER
    return next_fall(curve, limit) if limit >= 0.0 else NEVER


def later(curve, t):
    """Return the height above a plane as a function of the time since t."""
    return Lift(
        curve.course,
        curve.start + t,
        curve.slant,
        curve.height + (curve.speed + 0.5 * curve.acceleration * t) * t,
        curve.speed + curve.acceleration * t,
        curve.acceleration,
    )


class Gap(Curve):
    """How far a component is from a ball, or from the inside of a container, in squares of distances."""

    course: Course
    start: float
    side: float  # 1 outside of a ball, -1 inside of a container
    along: int  # an axis that does not count, or -1
    center: Any
    contact: float  # distance of contact from the center now [length]
    growth: float  # its rate
    g: tuple
    x: Any
    v: Any

    def value(self, t):
        rr, _, _, _ = gap_at(self, t)
        contact = self.contact + self.growth * t
        return self.side * (rr - contact * contact)

    def slope(self, t):
        _, rv, _, _ = gap_at(self, t)
        return 2.0 * self.side * (rv - self.growth * (self.contact + self.growth * t))

    def curvature(self, start, end):
        rr, _, vv, force = gap_at(self, start)
        t = end - start
        speed = np.sqrt(vv) + force * t
        distance = np.sqrt(rr) + (np.sqrt(vv) + 0.5 * force * t) * t
        return 2.0 * (speed * speed + distance * force + self.growth * self.growth)


def gap_at(curve, t):
    """Return r.r, r.v, v.v, and a bound on the magnitude of the relative acceleration."""
    wall_position, rate = curve.course.path.place(curve.start + t), curve.course.path.pace(curve.start + t)
    rr = 0.0
    rv = 0.0
    vv = 0.0
    gg = 0.0
    for axis in range(len(curve.g)):
        if axis != curve.along:
            fallen = curve.v[axis] + 0.5 * curve.g[axis] * t
            r = curve.x[axis] + fallen * t - curve.center[axis] - curve.course.direction[axis] * wall_position
            v = curve.v[axis] + curve.g[axis] * t - curve.course.direction[axis] * rate
            rr += r * r
            rv += r * v
            vv += v * v
            gg += curve.g[axis] * curve.g[axis]
    return rr, rv, vv, np.sqrt(gg) + curve.course.bend


def time_near(gap):
    """Return the time from which on a component is out of reach for ever; negative if it never is in reach.

    It may also have left for certain what it is in. One that grows must be in a field:
    :func:`straight_growth`.
    """
    course = gap.course
    range_of_wall = gap.contact + max(abs(course.lowest), abs(course.highest))
    gg = 0.0
    vv = 0.0
    rg = 0.0
    vg = 0.0
    rv = 0.0
    rr = 0.0
    for axis in range(len(gap.g)):
        if axis != gap.along:
            r = gap.x[axis] - gap.center[axis]
            gg += gap.g[axis] * gap.g[axis]
            vv += gap.v[axis] * gap.v[axis]
            rg += r * gap.g[axis]
            vg += gap.v[axis] * gap.g[axis]
            rv += r * gap.v[axis]
            rr += r * r
    if gg > 0.0:  # the parabola goes away along the field
        force = np.sqrt(gg)
        return last_passing(rg / force - range_of_wall, vg / force - max(gap.growth, 0.0), force)
    if vv > 0.0:
        return last_passing(0.5 * (rr - range_of_wall * range_of_wall), rv, vv)
    return course.period if rr <= range_of_wall * range_of_wall else -NEVER


def first_touch(gap):
    """Return the time until a component touches a ball, or the inside of a container."""
    limit = time_near(gap)
    return next_fall(gap, SURE * limit) if 0.0 <= limit < NEVER else NEVER


def at_rest(g):
    """Return the course of what does not move."""
    return Course(Still(), g, 0.0, 0.0, 0.0, NEVER)


def straight_growth(g, along, growth):
    """Return whether a component grows, in no field but along one axis: its contact is a quadratic's root.

    It has no last time near what it may touch by growing.
    """
    across = 0.0
    for axis in range(len(g)):
        if axis != along:
            across += abs(g[axis])
    return growth != 0.0 and across == 0.0
