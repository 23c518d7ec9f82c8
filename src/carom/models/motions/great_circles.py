"""Great circles: components on a sphere in R^d around the middle of the box (the paper's sec. 11).

Positions and tangent velocities are of R^d, distances along chords: caps of angular diameter ``theta`` on the
unit sphere are hard spheres of diameter ``2 sin(theta / 2)`` (Smith's codes), with cores and contact laws as
usual.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import positive
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.models.interactions.hard_cores import HardCores
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.mathematics.roots import Curve, next_fall

NEARLY = 2.0**-30
"""Part of the radius by which a position may be off the sphere, and of the speed by which a velocity may
point out of it. Both are brought onto the sphere.
"""


@dataclass(frozen=True)
class GreatCircles(Value):
    """Motion on a sphere in the middle of the box, on great circles.

    Parameters
    ----------
    radius : float
        Radius of the sphere [length]. Every edge of the box must be more than four times as long, so that no
        image is near.

    Raises
    ------
    InputError
        If the radius is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from carom import Scene
    >>> poles = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    >>> scene = Scene(4.0 + poles, box=8.0, diameter=0.5, motion=GreatCircles())
    >>> round(scene.packing_fraction, 4)  # three caps of the sphere
    0.0476
    """

    type = "great-circles"
    after = " of the sphere"
    radius: Annotated[float, positive] = 1.0
    straight = False
    curved = True
    """Two components do not fly straight relative to each other."""

    def conserves(self, axis: int) -> bool:
        """Return False for every ``axis``: the forces that keep particles on the sphere change momentum."""
        return False

    def check(self, scene: Any) -> None:
        """Raise InputError if the scene does not fit on the sphere."""
        if scene.dimension < 2:
            raise InputError("Great circles need a sphere in two dimensions or more, found one.")
        if not isinstance(scene.interaction, HardCores):
            raise InputError(
                f"On great circles hard cores meet, found the interaction {type(scene.interaction).__name__}."
            )
        if not all(scene.periodic) or scene.obstacles:
            raise InputError("On great circles components meet no walls or obstacles: leave them out.")
        if min(scene.box) <= 4.0 * self.radius:
            raise InputError(
                f"A sphere of radius {self.radius:g} needs edges of more than {4.0 * self.radius:g}, so that "
                f"no image is near; the shortest is {min(scene.box):g}."
            )
        arms = scene.positions - 0.5 * np.asarray(scene.box)
        lengths = np.linalg.norm(arms, axis=1)
        off = int(np.abs(lengths - self.radius).argmax())
        if abs(lengths[off] - self.radius) > NEARLY * self.radius:
            raise InputError(
                f"Component {off} is {lengths[off]:.9g} from the middle of the box; expected "
                f"{self.radius:.9g}, the radius of the sphere."
            )
        if scene.velocities is not None:
            speeds = np.linalg.norm(scene.velocities, axis=1)
            out = np.abs(np.einsum("ij,ij->i", arms, scene.velocities)) / self.radius
            worst = int((out - NEARLY * speeds).argmax())
            if out[worst] > NEARLY * speeds[worst]:
                raise InputError(
                    f"The velocity of component {worst} points out of the sphere, by {out[worst]:.3g} of "
                    f"{speeds[worst]:.3g}; take a tangent one, or none to have them drawn."
                )

    def degrees_of_freedom(self, n: int, dimension: int) -> int:
        """Return the degrees of freedom of ``n`` velocities, ``n (dimension - 1)``."""
        return n * (dimension - 1)

    def tangent(self, positions: np.ndarray, velocities: np.ndarray, box: Sequence[float]) -> np.ndarray:
        """Return the part of ``velocities`` (n, d) that is tangent to the sphere at ``positions`` (n, d)."""
        arms = (positions - 0.5 * np.asarray(box)) / self.radius
        return velocities - np.einsum("ij,ij->i", arms, velocities)[:, None] * arms

    def packing_fraction(self, diameters: np.ndarray, box: Sequence[float]) -> float:
        """Return the fraction of the sphere that caps of ``diameters`` (n,) cover."""
        from scipy.special import betainc

        sine = np.minimum(0.5 * np.asarray(diameters) / self.radius, 1.0)
        return float(np.sum(0.5 * betainc(0.5 * (len(box) - 1), 0.5, sine * sine)))

    def model(self, particles: Particles) -> Circles:
        """Return the model that the engine compiles."""
        return Circles(tuple(0.5 * edge for edge in particles.box), self.radius)


class Circles(MotionModel):
    """Motion on a sphere."""

    center: tuple  # center of the sphere [length]
    radius: float  # radius of the sphere [length]

    def carry(self, x, v, t, there, then):
        angular_speed = speed_of(v) / self.radius
        c, s = cosine_and_sine(angular_speed * t)
        length = s / angular_speed if angular_speed > 0.0 else t
        square = 0.0
        out = 0.0
        for axis in range(len(self.center)):
            arm = x[axis] - self.center[axis]
            u = v[axis]
            there[axis] = arm * c + u * length
            then[axis] = u * c - arm * (angular_speed * s)
            square += there[axis] * there[axis]
            out += there[axis] * then[axis]
        # Rounding does not add up: back onto the sphere, and tangent.
        scale = self.radius / np.sqrt(square)
        out /= square
        for axis in range(len(self.center)):
            then[axis] -= out * there[axis]
            there[axis] = there[axis] * scale + self.center[axis]
        return there, then, 0.0

    def position(self, axis, x, v, t):
        return x  # carry() has moved it

    def velocity(self, axis, v, t):
        return v

    def push_direction(self, axis, x, r, rr):
        # r without its part along the radius, so much longer that the chord shrinks as in free flight.
        square = self.radius * self.radius
        tangent = r + (x - self.center[axis]) * (0.5 * rr / square)
        return tangent / (1.0 - 0.25 * rr / square)

    def meeting_time(self, me, other, now, contact, rate, limit, span):
        speed_i, speed_j = speed_of(me.v), speed_of(other.v)
        # r.r = 2 R^2 - 2 x_i.x_j, and the second derivative of x_i.x_j is at most (|v_i| + |v_j|)^2.
        bound = 2.0 * ((speed_i + speed_j) * (speed_i + speed_j) + rate * rate)
        curve = Gap(
            me, other, self.center, speed_i / self.radius, speed_j / self.radius, now, contact, rate, bound
        )
        gap = curve.value(0.0)
        # Nothing shrinks the gap faster than both speeds and the growth together.
        if gap > 0.0 and np.sqrt(gap + contact * contact) - contact > (speed_i + speed_j + rate) * limit:
            return NEVER, False
        t = next_fall(curve, span)
        return t, (t == 0.0) & (gap < 0.0)


HALF_TURN_HIGH, HALF_TURN_LOW = 1.57079632673412561417, 6.07710050650619224932e-11
"""pi / 2 in two parts: a small multiple of the first is exact."""


def cosine_and_sine(angle):
    """Return cosine and sine to 1e-16, to angles of 1e5, by arithmetic alone (fdlibm's polynomials)."""
    turns = np.rint(angle * (2.0 / math.pi))
    x = (angle - turns * HALF_TURN_HIGH) - turns * HALF_TURN_LOW
    z = x * x
    s = 2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)
    s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * s)
    sine = x + x * z * (-1.66666666666666324348e-01 + z * s)
    c = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    c = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * c)
    c = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * c)
    half = 0.5 * z
    cosine = (1.0 - half) + (((1.0 - (1.0 - half)) - half) + z * z * c)
    quarter = int(turns) & 3
    a = sine if quarter & 1 else cosine
    b = cosine if quarter & 1 else sine
    return (-a if (quarter == 1) | (quarter == 2) else a), (-b if quarter >= 2 else b)


def speed_of(v):
    """Return the magnitude of the velocity ``v``, (d,)."""
    square = 0.0
    for axis in range(len(v)):
        square += v[axis] * v[axis]
    return np.sqrt(square)


class Gap(Curve):
    """The gap of two components: ``r.r - (contact + rate t)^2`` along their great circles."""

    me: Any  # old event of the one
    other: Any  # old event of the other
    center: tuple  # center of the sphere [length]
    mine: float  # angular speed of the one [1 / time]
    its: float  # angular speed of the other [1 / time]
    now: float  # time since the beginning of the epoch
    contact: float  # distance of contact now [length]
    rate: float  # rate at which the distance of contact grows
    bound: float  # bound on the magnitude of the second derivative of the gap

    def value(self, t):
        me, other = self.me, self.other
        c, s = cosine_and_sine(self.mine * (self.now + t - me.t))
        e, z = cosine_and_sine(self.its * (self.now + t - other.t))
        s = s / self.mine if self.mine > 0.0 else 0.0
        z = z / self.its if self.its > 0.0 else 0.0
        rr = 0.0
        for axis in range(len(self.center)):
            x = (me.x[axis] - self.center[axis]) * c + me.v[axis] * s
            y = (other.x[axis] - self.center[axis]) * e + other.v[axis] * z
            rr += (y - x) * (y - x)
        core = self.contact + self.rate * t
        return rr - core * core

    def slope(self, t):
        me, other = self.me, self.other
        c, s = cosine_and_sine(self.mine * (self.now + t - me.t))
        e, z = cosine_and_sine(self.its * (self.now + t - other.t))
        along = s / self.mine if self.mine > 0.0 else 0.0
        its_along = z / self.its if self.its > 0.0 else 0.0
        rv = 0.0
        for axis in range(len(self.center)):
            mine, its = me.x[axis] - self.center[axis], other.x[axis] - self.center[axis]
            x, y = mine * c + me.v[axis] * along, its * e + other.v[axis] * its_along
            u = other.v[axis] * e - its * (self.its * z) - (me.v[axis] * c - mine * (self.mine * s))
            rv += (y - x) * u
        return 2.0 * (rv - (self.contact + self.rate * t) * self.rate)

    def curvature(self, start, end):
        return self.bound
