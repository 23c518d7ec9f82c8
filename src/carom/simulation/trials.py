"""The paper's conditions I to V on random pairs of one model, in plain Python."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom.models import choice
from carom.models.interface import (
    NEVER,
    Particles,
    carry,
    exit_time,
    interaction_time,
    jump,
    mass,
    meeting_time,
    position,
    step_jump,
    step_time,
    thrust,
    transfer,
    velocity,
)
from carom.scene.scene import Scene
from carom.simulation import probes

TOLERANCE = 2.0**-26
"""Relative difference that counts as rounding: the root of that of a double, since roots lose half of it."""

GRAZING = 1e-3
"""Normal over total relative speed below which rounding may decide whether two meet."""

SENTENCES = {
    "I": "interaction_time does not depend on the order of the two",
    "II": "jump does not depend on the order of the two",
    "III": "two flights in a row are one flight as long as both",
    "IV": "a flight brings the interaction nearer by its time",
    "V": "after a jump the two do not interact at once",
    "momentum": "jump keeps the total momentum",
    "relative": "relative to each other two components fly straight",
    "first": "along curves the two are apart until they meet, and touch then",
    "energy": "along curves an elastic contact keeps the kinetic energy",
    "uniform": "without straight = False components fly straight and uniformly",
    "exit": "exit_time is when the coordinate leaves the interval",
    "reach": "no two act on each other beyond reach(scene)",
    "part": "transfer is between 1/2 (all is lost) and 1 (nothing is)",
}
"""What is tried."""

Drawn = tuple[int, int, "int | None", np.ndarray, np.ndarray]
"""Two components, their step, and place and velocity of the second relative to the first, (d,)."""


@dataclass(frozen=True)
class Failure:
    """A condition that does not hold.

    Attributes
    ----------
    condition : str
        The condition, one of ``SENTENCES``.
    dimension : int
        d.
    numbers : dict of str to value
        State of the pair, and the values that violate the condition.
    """

    condition: str
    dimension: int
    numbers: dict[str, Any]

    def __str__(self) -> str:
        facts = ", ".join(f"{name} = {value}" for name, value in self.numbers.items())
        return f"{self.condition}: not so that {SENTENCES[self.condition]}; d = {self.dimension}, {facts}"


class Trial:
    """The conditions of one model in one dimension.

    Parameters
    ----------
    model : model
        What is tried.
    d : int
        The dimension.
    tried, failures : dicts
        Where results go: pairs tried of each condition, and failures by condition and dimension.
    box : sequence of d floats, optional
        Edges in which a motion is tried [length].
    size, speed : float
        Length and speed of which its displacements and velocities are.
    growth : float
        Largest rate at which the distance of contact grows, in units of the speed.
    straight : bool
        Whether the motion is said to be straight and uniform.
    """

    def __init__(
        self,
        model: Any,
        d: int,
        tried: dict[str, int],
        failures: dict[tuple[str, int], Failure],
        *,
        box: Sequence[float] | None = None,
        size: float = 1.0,
        speed: float = 1.0,
        growth: float = 0.05,
        straight: bool = False,
    ):
        self._model, self._d = model, d
        self._tried, self._failures = tried, failures
        self._box = np.full(d, 20.0) if box is None else np.asarray(box)
        self._size, self._speed, self._time = size, speed, size / speed
        self._growth, self._straight = growth, straight

    def _try(self, condition: str, holds: Any, **numbers: Any) -> None:
        self._tried[condition] = self._tried.get(condition, 0) + 1
        if not holds:
            shown = {name: np.asarray(value).tolist() for name, value in numbers.items()}
            self._failures.setdefault((condition, self._d), Failure(condition, self._d, shown))

    def interaction(self, rng: np.random.Generator) -> None:
        """Try I, II, IV and V on a pair from ``rng`` in free flight that is likely to meet."""
        pair = self._model
        drawn = (self._on_a_step if choice.answers(step_time, pair) else self._in_flight)(rng)
        if drawn is None:
            return
        i, j, step, r, u = drawn
        rr, rv, vv = _scalars(r, u)
        t, other = (_time(pair, *both, step, rr, rv, vv, 0.0) for both in ((i, j), (j, i)))
        where = {} if step is None else {"step": step}
        facts: dict[str, Any] = {"i": i, "j": j, **where, "r": r, "v": u, "time": t}
        self._try("I", t == other or _same(t, other), **facts, exchanged=other)
        if not t < NEVER:
            return
        part = rng.uniform(0.0, 1.0) * t
        left = _time(pair, i, j, step, *_scalars(r + part * u, u), part)
        touch = r + t * u
        rr, rv, _ = _scalars(touch, u)
        if abs(rv) < GRAZING * math.sqrt(rr * vv):
            return
        self._try(
            "IV", abs(part + left - t) <= TOLERANCE * (t + 1.0 / math.sqrt(vv)), **facts, part=part, left=left
        )
        ours, theirs, virial, *outcome = _jump(pair, i, j, step, rr, rv, t)
        mine, yours, _, *alike = _jump(pair, j, i, step, rr, rv, t)
        self._try(
            "II",
            _same(ours, yours) and _same(theirs, mine) and outcome == alike,
            **facts,
            jump=(ours, theirs),
            exchanged=(mine, yours),
        )
        balance = mass(pair, i) * ours - mass(pair, j) * theirs
        self._try(
            "momentum",
            abs(balance) <= TOLERANCE * (abs(virial) / rr + abs(mass(pair, i) * ours)),
            **facts,
            lost=balance,
        )
        after = u - (ours + theirs) * touch
        reached = int(outcome[0]) if outcome else None
        again = _time(pair, i, j, reached, *_scalars(touch, after), t)
        self._try("V", again > 0.0, **facts, velocity_after=after, again=again)

    def _in_flight(self, rng: np.random.Generator) -> Drawn:
        """Return two without steps that fly towards each other."""
        i, j = (int(k) for k in rng.choice(8, 2, replace=False))
        r = rng.normal(size=self._d)
        r *= rng.uniform(1.5, 4.0) / np.linalg.norm(r)
        return i, j, None, r, rng.normal(size=self._d) * 0.3 - r * rng.uniform(0.1, 1.0)

    def _on_a_step(self, rng: np.random.Generator) -> Drawn | None:
        """Return two that are somewhere on a step; None for a row that stands for no step."""
        pair = self._model
        step = int(rng.integers(len(pair.energy)))
        i, j = (int(k) for k in rng.choice(8, 2, replace=False))
        low, high = math.sqrt(max(pair.inner[step], 0.0)), math.sqrt(pair.outer[step])
        high = min(high, 2.0 * low + 1.0)
        if not low < high:
            return None
        r = rng.normal(size=self._d)
        r *= rng.uniform(low, high) / np.linalg.norm(r)
        u = (rng.normal(size=self._d) - r * rng.uniform(-1.0, 1.0)) * 10.0 ** rng.uniform(-1.0, 1.0)
        return i, j, step, r, u

    def motion(self, rng: np.random.Generator) -> None:
        """Try III, that relative flight is straight, and exit_time, on a pair from ``rng``."""
        motion = self._model
        if choice.answers(meeting_time, motion):
            if self._d > 1:  # a curve has room to bend
                self._curves(rng)
            return
        x = rng.uniform(0.0, 1.0, (2, self._d)) * self._box
        v = rng.normal(size=(2, self._d)) * self._speed
        first, second = rng.uniform(0.0, 2.0, 2) * self._time
        places, speeds = flown(motion, *flown(motion, x, v, first), second)
        at_once, speeds_at_once = flown(motion, x, v, first + second)
        size = np.abs(x).max() + np.abs(at_once).max() + np.abs(speeds).max() * self._time
        facts = {"x": x[0], "v": v[0], "first": first, "second": second}
        off = max(np.abs(places - at_once).max(), np.abs(speeds - speeds_at_once).max() * self._time)
        self._try("III", off <= TOLERANCE * size, **facts, off=off)
        straight = (x[1] - x[0]) + (first + second) * (v[1] - v[0])
        off = np.abs((at_once[1] - at_once[0]) - straight).max()
        self._try("relative", off <= TOLERANCE * size, **facts, off=off)
        if self._straight:
            off = np.abs(at_once - x - (first + second) * v).max()
            self._try("uniform", off <= TOLERANCE * size, **facts, off=off)
        for axis in range(self._d):
            low, high = x[0, axis] + self._size * (rng.uniform(0.01, 2.0, 2) * (-1.0, 1.0))
            t, up = exit_time(motion, axis, x[0, axis], v[0, axis], low, high)
            if not t < NEVER:
                continue
            end = position(motion, axis, x[0, axis], v[0, axis], t)
            on_the_way = [
                position(motion, axis, x[0, axis], v[0, axis], s * t) for s in np.linspace(0, 1, 33)
            ]
            slack = TOLERANCE * size
            inside = min(on_the_way) >= low - slack and max(on_the_way) <= high + slack
            there = abs(end - (high if up else low)) <= slack
            self._try("exit", inside and there, **facts, axis=axis, interval=(low, high), exit=t, place=end)

    def reach(self, value: Any, particles: Particles) -> None:
        """Try that no two of eight components act on each other beyond the reach of ``value``."""
        places = np.zeros((8, self._d))
        places[:, 0] = 2.5 * np.arange(8)
        scene = Scene(
            places,
            particles.box,
            diameter=2.0 * particles.radii,
            mass=particles.masses,
            species=particles.species,
        )
        reach = probes.reach_of(value, scene)
        radii = particles.radii if getattr(value, "by_radii", False) else np.full(8, 0.5 * reach)
        for i in range(8):
            for j in range(i):
                sum_of_two = float(radii[i] + radii[j])
                found = probes.contact_distance(self._model, i, j, reach)
                beyond = found > sum_of_two * (1.0 + TOLERANCE)
                self._try("reach", not beyond, i=j, j=i, distance=found, reach=sum_of_two)

    def _curves(self, rng: np.random.Generator) -> None:
        """Try I, III, IV and V on two components that move along curves, and what else they must keep."""
        motion, contact, span = self._model, 0.3 * self._size, 20.0 * self._time
        rate = rng.uniform(0.0, 1.0) * self._growth * self._speed
        # To go nowhere is to be put where the motion has its components.
        places = 0.5 * self._box + self._size * rng.uniform(-1.0, 1.0, (2, self._d))
        speeds = rng.normal(size=(2, self._d)) * self._speed
        pair = [_carried(motion, *one, 0.0) for one in zip(places, speeds, strict=True)]
        first, second = rng.uniform(0.0, 2.0, 2) * self._time
        x, v = _carried(motion, *_carried(motion, *pair[0], first), second)
        at_once, then = _carried(motion, *pair[0], first + second)
        facts = {"x": [x for x, _ in pair], "v": [v for _, v in pair]}
        size = np.abs(at_once).max() + np.abs(then).max() * self._time
        off = max(np.abs(x - at_once).max(), np.abs(v - then).max() * self._time)
        self._try("III", off <= TOLERANCE * size, **facts, first=first, second=second, off=off)
        r = pair[1][0] - pair[0][0]
        if float(np.sqrt(r @ r)) <= contact:
            return
        t, other = (_meeting(motion, both, contact, rate, span) for both in (pair, pair[::-1]))
        self._try("I", t == other or _same(t, other), **facts, time=t, exchanged=other)
        if not t < NEVER:
            return
        times = np.linspace(0.0, t, 65)
        flown = [[_carried(motion, *one, s) for one in pair] for s in times]
        apart = np.array([b[0] - a[0] for a, b in flown])
        # A motion may, or may not, look at the images of a periodic box.
        for chords in (apart, apart - self._box * np.rint(apart / self._box)):
            gaps = np.linalg.norm(chords, axis=1) - contact - rate * times
            touches = abs(gaps[-1]) <= TOLERANCE * self._size and gaps.min() >= -TOLERANCE * self._size
            if touches:
                break
        self._try("first", touches, **facts, time=t, least_gap=gaps.min(), last_gap=gaps[-1])
        left = _meeting(motion, flown[21], contact + rate * times[21], rate, span)
        self._try("IV", abs(times[21] + left - t) <= TOLERANCE * (self._time + t), **facts, time=t, left=left)
        (xi, vi), (xj, vj) = flown[-1]
        r, u = chords[-1], vj - vi
        rr, rv = float(r @ r), float(r @ u)
        if abs(rv) < GRAZING * math.sqrt(rr * float(u @ u)):
            return
        push = [thrust(motion, axis, xi[axis], r[axis], rr) for axis in range(self._d)]
        back = [thrust(motion, axis, xj[axis], -r[axis], rr) for axis in range(self._d)]
        after = [(xi, vi + rv / rr * np.array(push)), (xj, vj + rv / rr * np.array(back))]
        energies = [sum(float(w @ w) for _, w in both) for both in (flown[-1], after)]
        self._try("energy", _same(*energies), **facts, energies=energies)
        again = _meeting(motion, after, contact + rate * t, 0.0, span)
        self._try("V", again > 0.0, **facts, again=again)

    def impact(self, rng: np.random.Generator) -> None:
        """Try the part of the momentum that is exchanged, at a speed from ``rng``."""
        distance, speed = rng.uniform(0.5, 2.0), 10.0 ** rng.uniform(-6.0, 2.0)
        part = float(transfer(self._model, distance * distance, -speed * distance))
        self._try("part", 0.5 <= part <= 1.0, distance=distance, normal_speed=speed, part=part)


def _time(pair: Any, i: int, j: int, step: int | None, rr: float, rv: float, vv: float, now: float) -> float:
    """Return when two interact that are on a step, or have none."""
    if step is None:
        return float(interaction_time(pair, i, j, rr, rv, vv, now))
    return float(step_time(pair, i, j, step, rr, rv, vv, now))


def _jump(pair: Any, i: int, j: int, step: int | None, rr: float, rv: float, now: float) -> tuple[Any, ...]:
    """Return what the interaction of two adds, and on which step they are afterwards, if they have steps."""
    if step is None:
        ours, theirs, virial = jump(pair, i, j, rr, rv, now)
        return ours, theirs, virial
    return tuple(step_jump(pair, i, j, step, rr, rv, now))


def _carried(motion: Any, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return place and velocity (d,) of one component on a curve a time later."""
    # What carry leaves out is no number.
    there, then, left = carry(motion, x, v, t, np.full_like(x, np.nan), np.full_like(v, np.nan))
    places = [position(motion, axis, there[axis], then[axis], left) for axis in range(len(x))]
    return np.array(places), np.array([velocity(motion, axis, then[axis], left) for axis in range(len(x))])


def _meeting(motion: Any, pair: Any, contact: float, rate: float, span: float) -> float:
    """Return when two components on curves meet."""
    me, other = (SimpleNamespace(x=x, v=v, t=0.0) for x, v in pair)
    return float(meeting_time(motion, me, other, 0.0, contact, rate, span, span)[0])


def _scalars(r: np.ndarray, v: np.ndarray) -> tuple[float, float, float]:
    return float(r @ r), float(r @ v), float(v @ v)


def _same(a: float, b: float) -> bool:
    return bool(abs(a - b) <= TOLERANCE * max(abs(a), abs(b)))


def flown(motion: Any, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places and velocities (k, d) a time later."""
    places = [
        [position(motion, k, *xv, t) for k, xv in enumerate(zip(*both, strict=True))]
        for both in zip(x, v, strict=True)
    ]
    speeds = [[velocity(motion, k, u, t) for k, u in enumerate(each)] for each in v]
    return np.array(places), np.array(speeds)
