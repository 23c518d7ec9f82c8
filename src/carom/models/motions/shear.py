"""Uniform shear: a periodic lattice that tilts with the flow (Lees and Edwards, J. Phys. C 5 (1972) 1921).

The stream is along axis 0 and grows along axis 1. With the tilt s, the strain since the lattice was
rectangular, ``y_0 = x_0 - s x_1``, and *peculiar* velocities have ``u_0 = v_0 - rate x_1``; other axes stay.
In these the box is a torus: who crosses a face keeps its velocity.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.arithmetic import cosine_and_sine
from carom.declared import number
from carom.errors import InputError
from carom.models.declared_values import ABOVE, Value
from carom.models.interfaces.memory import parameter, present
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.particles import Particles
from carom.models.mathematics.parabolas import leaving

LONGEST_STRAIN = 0.125
"""Strain of an epoch, at most: sectors are wide enough for the tilt at its end."""

LISTED_STRAIN = 0.25  # strain for which neighbor lists are made

STAGES = 32  # stretches of constant rate in a period


@dataclass(frozen=True)
class Shear(Value):
    """A uniform shear flow, in two dimensions or more, in a box that is periodic along all axes.

    Parameters
    ----------
    rate : float
        Shear rate [1 / time]: the stream is ``rate x_1`` along axis 0.
    tilt : float
        Strain of the lattice at the start: the image of a particle one edge up along axis 1 is shifted by
        ``tilt`` of that edge along axis 0.
    period : float, optional
        The rate oscillates from the start of a run on, as ``rate cos(2 pi t / period)`` [time]. The amplitude
        of the strain is ``rate period / (2 pi)``.

    Raises
    ------
    InputError
        If a value is not a finite number.

    Notes
    -----
    Velocities of scenes and frames are peculiar ones, relative to the stream. No force acts: the stream is
    kept by the images that move (Lees and Edwards). The energy of the peculiar motion grows by ``-rate P_01
    V`` a time.

    An oscillating rate is constant in each 32nd part of a period, at whose ends the strain is that of the
    sine. Peculiar velocities stay where it jumps.

    Examples
    --------
    >>> Shear(0.5).rate
    0.5
    """

    type = "shear"
    after = " of Shear"
    rate: Annotated[float, number(low=-checks.FASTEST, high=checks.FASTEST)]
    tilt: Annotated[float, number()] = 0.0
    period: Annotated[float | None, ABOVE] = None

    straight = False

    def check(self, scene: Any) -> None:
        """Raise InputError if a ``scene`` cannot be sheared."""
        if scene.dimension < 2:
            raise InputError("Shear is a flow along one axis that grows along another; found one dimension.")
        if not all(scene.periodic):
            raise InputError("Shear needs a box that is periodic along all axes; leave out the walls.")
        if scene.obstacles or scene.pinned is not None:
            raise InputError(
                "Obstacles and pinned particles would hold the stream; leave them out, or Shear."
            )

    def stretch(self, box: tuple[float, ...], strain: float = LONGEST_STRAIN) -> tuple[float, ...]:
        """Return how much longer a vector may be along each axis of the lattice than it is.

        That holds until the lattice has tilted by ``strain``.
        """
        most = 0.5 * box[0] / box[1] + strain
        return (math.hypot(1.0, most), *(1.0,) * (len(box) - 1))

    def longest_epoch(self) -> float:
        """Return the longest time in which the tilt changes little [time]."""
        return LONGEST_STRAIN / abs(self.rate) if self.rate else math.inf

    def pace(self, diameter: float) -> float:
        """Return the difference of the stream over a ``diameter`` [length / time]."""
        return abs(self.rate) * diameter

    def tilted(self, tilt: float) -> Shear:
        """Return the same flow in a lattice of another tilt."""
        return dataclasses.replace(self, tilt=tilt)

    def in_stage(self, stage: int) -> Shear:
        """Return the flow of constant rate in a stage of the period; itself if it does not oscillate."""
        if self.period is None:
            return self
        _, sines = cosine_and_sine(np.array([stage % STAGES, stage % STAGES + 1]) / STAGES)
        return Shear(self.rate * float(sines[1] - sines[0]) * STAGES / (2.0 * math.pi), self.tilt)

    def strain(self, time: float, stage: int) -> float:
        """Return the strain that a run has had in a ``time`` from its start, which ends in a stage."""
        if self.period is None:
            return self.rate * time
        _, (sine,) = cosine_and_sine(np.array([stage % STAGES]) / STAGES)
        amplitude, since = self.rate * self.period / (2.0 * math.pi), time - stage * self.period / STAGES
        return amplitude * float(sine) + self.in_stage(stage).rate * since

    def model(self, particles: Particles) -> Sheared:
        """Return the model that the engine compiles."""
        ratio = particles.box[0] / particles.box[1]
        tilt = start_tilt(self, particles.box)
        return Sheared(float(particles.unit.to_kernel(self.rate, -1)), ratio, np.array([tilt]))


def start_tilt(motion: Any, box: Sequence[float]) -> float:
    """Return the tilt at the start less whole boxes, at most half of the edges' ratio; 0 without shear."""
    if not isinstance(motion, Shear):
        return 0.0
    ratio = box[0] / box[1]
    return motion.tilt - ratio * round(motion.tilt / ratio)


GRADIENT = 1
"""The axis along which a stream grows; it flows along axis 0."""


class Sheared(MotionModel):
    """A tilting lattice."""

    rate: Annotated[float, parameter(-1)]
    """Shear rate."""
    ratio: float
    """Edge along the stream over that along its gradient: lattices whose tilts differ by it are the same."""
    tilt: Annotated[np.ndarray, present()]
    """Tilt at the beginning of the epoch, (1,) float64."""

    def position(self, axis, x, v, t):
        return x + v * t

    def velocity(self, axis, v, t):
        return v

    def position_at(self, axis, x, v, t, now):
        speed = v[axis] - tilt_at(self, now) * v[GRADIENT] if axis == 0 else np.float64(v[axis])
        return x[axis] + speed * t

    def velocity_at(self, axis, v, t):
        return v[axis] - self.rate * v[GRADIENT] * t if axis == 0 else np.float64(v[axis])

    def in_space(self, axis, x, now):
        return x[axis] + tilt_at(self, now) * x[GRADIENT] if axis == 0 else np.float64(x[axis])

    def relative_to(self, boundary, i, ref, me, other, now):
        rr = 0.0
        rv = 0.0
        vv = 0.0
        for axis in range(len(boundary.edges)):
            r = _apart(self, boundary, i, ref, axis, me, other, now)
            v = np.float64(self.velocity_at(axis, other.v, now - other.t)) - np.float64(
                self.velocity_at(axis, me.v, now - me.t)
            )
            if axis == 0:
                up = _apart(self, boundary, i, ref, 1, me, other, now)
                r += tilt_at(self, now) * up
                v += self.rate * up
            rr += r * r
            rv += r * v
            vv += v * v
        return rr, rv, vv

    def candidate_relative_to(self, boundary, i, ref, me, block, k, now):
        dimension = len(boundary.edges)
        elapsed = now - block[dimension, k]
        rr = 0.0
        rv = 0.0
        vv = 0.0
        for axis in range(dimension):
            r = _candidate_apart(self, boundary, i, ref, axis, me, block, k, now)
            v = np.float64(block[dimension + 1 + axis, k])
            if axis == 0:
                up = _candidate_apart(self, boundary, i, ref, 1, me, block, k, now)
                r += tilt_at(self, now) * up
                v += self.rate * (up - block[dimension + 2, k] * elapsed)
            v -= self.velocity_at(axis, me.v, now - me.t)
            rr += r * r
            rv += r * v
            vv += v * v
        return rr, rv, vv

    def contact_vector(self, boundary, i, ref, axis, me, other, now):
        r = boundary.separation(i, ref, axis, np.float64(other.x[axis]) - np.float64(me.x[axis]))
        if axis == 0:
            r += tilt_at(self, now) * _gradient_apart(boundary, i, ref, me, other)
        return r

    def contact_velocity(self, boundary, i, ref, axis, me, other):
        v = np.float64(other.v[axis]) - np.float64(me.v[axis])
        if axis == 0:
            v += self.rate * _gradient_apart(boundary, i, ref, me, other)
        return v

    def exit_time_at(self, axis, me, now, low, high):
        x = self.position_at(axis, me.x, me.v, now - me.t, now)
        v = np.float64(self.velocity_at(axis, me.v, now - me.t))
        g = 0.0
        if axis == 0:  # along the tilting axis a flight is a parabola
            v -= tilt_at(self, now) * me.v[GRADIENT]
            g = -2.0 * self.rate * me.v[GRADIENT]
        return leaving(x, v, g, low, high)


def tilt_at(motion, now):
    """Return the tilt at a time of the epoch."""
    return motion.tilt[0] + motion.rate * now


def _apart(motion, boundary, i, ref, axis, me, other, now):
    x = motion.position_at(axis, me.x, me.v, now - me.t, now)
    y = motion.position_at(axis, other.x, other.v, now - other.t, now)
    return boundary.separation(i, ref, axis, y - x)


def _candidate_apart(motion, boundary, i, ref, axis, me, block, k, now):
    dimension = len(boundary.edges)
    elapsed = now - block[dimension, k]
    x = motion.position_at(axis, me.x, me.v, now - me.t, now)
    speed = np.float64(block[dimension + 1 + axis, k])
    if axis == 0:
        speed -= tilt_at(motion, now) * block[dimension + 2, k]
    return boundary.separation(i, ref, axis, block[axis, k] + speed * elapsed - x)


def _gradient_apart(boundary, i, ref, me, other):
    difference = np.float64(other.x[GRADIENT]) - np.float64(me.x[GRADIENT])
    return boundary.separation(i, ref, 1, difference)
