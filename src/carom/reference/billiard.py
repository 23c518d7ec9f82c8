"""The paper's basic functions for hard spheres in a periodic box, with and without sectors (sec. 2).

``interaction_time``, ``jump`` and ``advance`` are the only physics in :mod:`carom.reference.figures`, apart
from crossings of sectors. Diameter and mass are constant parts of a particle's state, as in sec. 11.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError
from carom.reference.arithmetic import NEVER, ArithmeticName, make_arithmetic
from carom.reference.meeting import Contacts, NoMeetingFound, contact_time, next_meeting

# Windows of a quarter edge through which an unsectored pair is followed. A pair that flies further without
# meeting is assumed to be in one of the channels of the torus, and never to meet.
_CHANNEL = 2**14


class State(NamedTuple):
    """State of one particle: unwrapped position (d,), velocity (d,), diameter, mass and sector.

    `sector` holds the unwrapped integer coordinates of the sector, or None in an unsectored space. It is part
    of the state because rounding must not decide on which side of a boundary a ball is.
    """

    position: np.ndarray
    """Unwrapped position of the center, (d,) [length]."""
    velocity: np.ndarray
    """[length / time]"""
    diameter: Any
    """[length]"""
    mass: Any
    """[mass]"""
    sector: tuple[int, ...] | None
    """Unwrapped coordinates of the sector."""


class Billiard:
    """Balls on a periodic table of any dimension.

    Parameters
    ----------
    positions, velocities : (n, d) arrays
        Positions [length] and velocities [length / time] at time 0.
    box : (d,) sequence
        Edges of the table [length].
    diameter : number or (n,) sequence
        Diameters [length].
    masses : (n,) sequence, optional
        Masses; by default all 1.
    sectors : sequence of d int, optional
        Number of sectors along each edge, at least 3, with no side below the largest diameter. By default
        there are no sectors, and a collision is the earliest one over all images that can be met.
    arithmetic, digits
        As for :class:`carom.reference.NaiveSystem`.

    Raises
    ------
    InputError
        If shapes do not fit, or the sectors are too few or too small.
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        diameter: Any = 1,
        masses: Any = None,
        sectors: Any = None,
        arithmetic: ArithmeticName = "float",
        digits: int = 50,
    ) -> None:
        self.arithmetic = make_arithmetic(arithmetic, digits)
        array = self.arithmetic.array
        x, v = array(positions, "positions"), array(velocities, "velocities")
        self.box = array(box, "box")
        if x.ndim != 2 or 0 in x.shape or v.shape != x.shape or self.box.shape != x.shape[1:]:
            raise InputError(
                f"positions, velocities and box have shapes {x.shape}, {v.shape} and {self.box.shape}; "
                "expected (n, d), (n, d) and (d,)."
            )
        self.n, self.dimension = x.shape
        diameters = array(np.broadcast_to(np.array(diameter, dtype=object), self.n), "diameter")
        m = array([1] * self.n if masses is None else masses, "masses")
        self.sectors: np.ndarray | None = None
        self.sides = self.box
        self.obstacles = 0
        if sectors is not None:
            counts = np.array(sectors, dtype=np.int64)
            fits = counts.shape == self.box.shape and (counts >= 3).all()
            self.sides = self.box / array(counts, "sectors") if fits else self.box
            if not fits or (self.sides < max(diameters)).any():
                raise InputError(
                    f"sectors is {sectors!r}; expected {self.dimension} counts of at least 3, none so "
                    "large that a side is shorter than the largest diameter."
                )
            self.sectors = counts
            # K of the paper: a ball meets the two faces of its sector along each axis.
            self.obstacles = 2 * self.dimension
        self.initial = [State(x[i], v[i], diameters[i], m[i], self._sector_of(x[i])) for i in range(self.n)]

    def _sector_of(self, position: np.ndarray) -> tuple[int, ...] | None:
        if self.sectors is None:
            return None
        return tuple(int(c) for c in np.floor((position / self.sides).astype(float)))

    def advance(self, state: State, time0: Any, time1: Any) -> State:
        """State at `time1` of a particle in `state` at `time0`, without interactions."""
        return state._replace(position=state.position + state.velocity * (time1 - time0))

    def interaction_time(self, state1: State, time1: Any, state2: State, time2: Any) -> Any:
        """Time of the next collision of two particles by themselves, or NEVER.

        The particles have `state1` at `time1` and `state2` at `time2`. With sectors the time is also NEVER
        for particles that are not in the same or in neighboring sectors.
        """
        time = max(time1, time2)
        x1 = state1.position + state1.velocity * (time - time1)
        x2 = state2.position + state2.velocity * (time - time2)
        r, u = x2 - x1, state2.velocity - state1.velocity
        if self.sectors is not None:
            assert state1.sector is not None
            assert state2.sector is not None
            apart = np.subtract(state2.sector, state1.sector)
            image = -np.rint(apart / self.sectors).astype(np.int64)
            if (np.abs(apart + image * self.sectors) > 1).any():
                return NEVER
            contact = (state1.diameter + state2.diameter) / 2
            delay = contact_time(r + image * self.box, u, contact, self.arithmetic.sqrt)
            return NEVER if delay is None else time + delay
        zero = r * 0
        try:
            meeting = next_meeting(
                np.stack([zero, self.nearest(r)]),
                np.stack([zero, u]),
                Contacts(
                    np.array([state1.diameter, state2.diameter]),
                    self.arithmetic.array([0, 0], "growth"),
                ),
                self.box,
                self.arithmetic,
                windows_limit=_CHANNEL,
            )
        except NoMeetingFound:
            return NEVER
        return NEVER if meeting is None else time + meeting.delay

    def nearest(self, r: np.ndarray) -> np.ndarray:
        """The shortest of the periodic images of the separation `r`."""
        return r - np.rint((r / self.box).astype(float)).astype(np.int64) * self.box

    def crossing_time(self, state: State, time: Any, obstacle: int) -> Any:
        """Time at which a particle in `state` at `time` reaches face `obstacle` (1 to K) of its sector.

        Odd faces are the lower ones: 1, 2 along the first axis, 3, 4 along the second, and so on.
        """
        assert state.sector is not None
        axis, upper = divmod(obstacle - 1, 2)
        speed = state.velocity[axis]
        if speed == 0 or (speed > 0) != bool(upper):
            return NEVER
        face = (state.sector[axis] + upper) * self.sides[axis]
        # Rounding may have put the ball past the face; it then crosses now.
        return (
            time + max(face - state.position[axis], 0) / speed
            if upper
            else (time + min(face - state.position[axis], 0) / speed)
        )

    def cross(self, state: State, obstacle: int) -> State:
        """State of a particle in `state` after it crosses face `obstacle`: only the sector changes."""
        assert state.sector is not None
        axis, upper = divmod(obstacle - 1, 2)
        sector = list(state.sector)
        sector[axis] += 1 if upper else -1
        return state._replace(sector=tuple(sector))

    def jump(self, state1: State, state2: State) -> tuple[State, State]:
        """Both states immediately after an elastic collision of particles in `state1` and `state2`.

        At contact no image is nearer than the one that is touched, so the nearest one is used.
        """
        r, u = self.nearest(state2.position - state1.position), state2.velocity - state1.velocity
        scale = 2 * state1.mass * state2.mass / (state1.mass + state2.mass) * sum(r * u) / sum(r * r)
        return (
            state1._replace(velocity=state1.velocity + r * (scale / state1.mass)),
            state2._replace(velocity=state2.velocity - r * (scale / state2.mass)),
        )
