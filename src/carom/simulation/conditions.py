"""The paper's conditions I to V for models of your own, tested on random pairs in any dimension."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom.errors import InputError
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
from carom.units import TimeUnit

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
    "exit": "exit_time is when the coordinate leaves the interval",
    "part": "transfer is between 1/2 (all is lost) and 1 (nothing is)",
}
"""What is tried."""


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


@dataclass(frozen=True)
class Conditions:
    """What :func:`carom.check` found.

    Attributes
    ----------
    tried : dict of str to int
        Number of pairs on which each condition was tested.
    failures : tuple of Failure
        The first failure of each condition and dimension.
    """

    tried: dict[str, int]
    failures: tuple[Failure, ...]

    @property
    def passed(self) -> bool:
        """Whether all conditions held."""
        return not self.failures

    def __str__(self) -> str:
        failed = {failure.condition for failure in self.failures}
        lines = [
            f"{'FAILS' if name in failed else 'holds':<6}{name:<9}{SENTENCES[name]} ({count} pairs)"
            for name, count in self.tried.items()
        ]
        return "\n".join([*lines, *map(str, self.failures)])


def check(
    value: Any, *, dimensions: tuple[int, ...] = (1, 2, 3, 4), pairs: int = 200, seed: int = 0
) -> Conditions:
    """Test the paper's conditions I to V (Lubachevsky 1991, sec. 7) on a model, and further requirements.

    Nothing is compiled: the functions run as plain Python.

    Parameters
    ----------
    value : interaction, motion or impact
        As :class:`carom.Scene` takes it. It is tested with eight components of two species, with diameters
        from 0.6 to 1.4 and masses from 0.3 to 3.
    dimensions : tuple of int
        Dimensions to test. A motion with a value for each axis is tested up to its number of axes.
    pairs : int
        Number of pairs in each dimension.
    seed : int
        Seed of the random pairs.

    Returns
    -------
    Conditions
        ``print`` shows it as a table; ``passed`` says whether all conditions hold.

    Raises
    ------
    InputError
        If the value is neither an interaction, a motion nor an impact, or a required question is not
        answered.

    Examples
    --------
    >>> from carom.models.hard_cores import HardCores
    >>> check(HardCores()).passed
    True
    """
    kind = _kind(value)
    tried: dict[str, int] = {}
    failures: dict[tuple[str, int], Failure] = {}
    for d in dimensions:
        rng = np.random.default_rng([seed, d])
        model = value.model(_some(rng, d))
        if model is None or (kind == "motion" and not _has_axis(model, d - 1)):
            continue
        trial = _Trial(choice.answered(kind, model), d, tried, failures)
        for _ in range(pairs):
            with np.errstate(all="ignore"):
                getattr(trial, kind)(rng)
    return Conditions(tried, tuple(failures.values()))


def _kind(value: Any) -> str:
    """Return which of the three a value is, by the questions that its model answers."""
    if isinstance(value, type) or not callable(getattr(value, "model", None)):
        raise InputError(
            f"check() needs the value of an interaction, a motion or an impact, found {value!r}."
        )
    if callable(getattr(value, "reach", None)):
        return "interaction"
    model = value.model(_some(np.random.default_rng(0), 2))
    return "motion" if choice.answers_any("motion", model) else "impact"


def _has_axis(motion: Any, axis: int) -> bool:
    """Tell whether a motion has a value for so many axes, where it has one for each."""
    try:
        position(motion, axis, 0.0, 0.0, 0.0)
    except IndexError:
        return False
    return True


def _some(rng: np.random.Generator, d: int) -> Particles:
    """Return eight different components of two species."""
    n = 8
    return Particles(
        box=(20.0,) * d,
        radii=rng.uniform(0.3, 0.7, n),
        masses=rng.uniform(0.3, 3.0, n),
        species=np.arange(n) % 2,
        rates=rng.uniform(0.0, 0.05, n),
        equal=False,
        unit=TimeUnit(),
    )


class _Trial:
    """The conditions of one model in one dimension."""

    def __init__(self, model: Any, d: int, tried: dict[str, int], failures: dict[tuple[str, int], Failure]):
        self._model, self._d = model, d
        self._tried, self._failures = tried, failures

    def _try(self, condition: str, holds: Any, **numbers: Any) -> None:
        self._tried[condition] = self._tried.get(condition, 0) + 1
        if not holds:
            shown = {name: np.asarray(value).tolist() for name, value in numbers.items()}
            self._failures.setdefault((condition, self._d), Failure(condition, self._d, shown))

    def interaction(self, rng: np.random.Generator) -> None:
        """Try I, II, IV and V on a pair that is likely to meet, with free flight in between."""
        if choice.answers(step_time, self._model):
            self._steps(rng)
            return
        pair = self._model
        i, j = (int(k) for k in rng.choice(8, 2, replace=False))
        r = rng.normal(size=self._d)
        r *= rng.uniform(1.5, 4.0) / np.linalg.norm(r)
        u = rng.normal(size=self._d) * 0.3 - r * rng.uniform(0.1, 1.0)
        rr, rv, vv = (float(x) for x in (r @ r, r @ u, u @ u))
        t, other = (float(interaction_time(pair, *both, rr, rv, vv, 0.0)) for both in ((i, j), (j, i)))
        facts = {"i": i, "j": j, "r": r, "v": u, "time": t}
        self._try("I", t == other or _same(t, other), **facts, exchanged=other)
        if not t < NEVER:
            return
        part = rng.uniform(0.0, 1.0) * t
        between = r + part * u
        left = float(interaction_time(pair, i, j, *_scalars(between, u), part))
        touch = r + t * u
        rr, rv, _ = _scalars(touch, u)
        if abs(rv) < GRAZING * math.sqrt(rr * vv):
            return
        self._try(
            "IV", abs(part + left - t) <= TOLERANCE * (t + 1.0 / math.sqrt(vv)), **facts, part=part, left=left
        )
        ours, theirs, virial = jump(pair, i, j, rr, rv, t)
        mine, yours, _ = jump(pair, j, i, rr, rv, t)
        self._try(
            "II",
            _same(ours, yours) and _same(theirs, mine),
            **facts,
            jump=(ours, theirs),
            exchanged=(mine, yours),
        )
        scale = abs(virial) / rr
        balance = mass(pair, i) * ours - mass(pair, j) * theirs
        self._try(
            "momentum", abs(balance) <= TOLERANCE * (scale + abs(mass(pair, i) * ours)), **facts, lost=balance
        )
        after = u - (ours + theirs) * touch
        again = float(interaction_time(pair, i, j, *_scalars(touch, after), t))
        self._try("V", again > 0.0, **facts, velocity_after=after, again=again)

    def _steps(self, rng: np.random.Generator) -> None:
        """Try the same of a pair on a step, from somewhere on it."""
        pair = self._model
        step = int(rng.integers(len(self._model.energy)))
        i, j = (int(k) for k in rng.choice(8, 2, replace=False))
        low, high = math.sqrt(max(pair.inner[step], 0.0)), math.sqrt(pair.outer[step])
        high = min(high, 2.0 * low + 1.0)
        if not low < high:  # a row that stands for no step
            return
        r = rng.normal(size=self._d)
        r *= rng.uniform(low, high) / np.linalg.norm(r)
        u = (rng.normal(size=self._d) - r * rng.uniform(-1.0, 1.0)) * 10.0 ** rng.uniform(-1.0, 1.0)
        rr, rv, vv = _scalars(r, u)
        t, other = (float(step_time(pair, *both, step, rr, rv, vv, 0.0)) for both in ((i, j), (j, i)))
        facts = {"i": i, "j": j, "step": step, "r": r, "v": u, "time": t}
        self._try("I", t == other or _same(t, other), **facts, exchanged=other)
        if not t < NEVER:
            return
        part = rng.uniform(0.0, 1.0) * t
        left = float(step_time(pair, i, j, step, *_scalars(r + part * u, u), part))
        touch = r + t * u
        rr, rv, _ = _scalars(touch, u)
        if abs(rv) < GRAZING * math.sqrt(rr * vv):
            return
        self._try(
            "IV", abs(part + left - t) <= TOLERANCE * (t + 1.0 / math.sqrt(vv)), **facts, part=part, left=left
        )
        ours, theirs, virial, after, kind = step_jump(pair, i, j, step, rr, rv, t)
        mine, yours, _, same, alike = step_jump(pair, j, i, step, rr, rv, t)
        self._try(
            "II",
            _same(ours, yours) and _same(theirs, mine) and (after, kind) == (same, alike),
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
        flown = u - (ours + theirs) * touch
        again = float(step_time(pair, i, j, int(after), *_scalars(touch, flown), t))
        self._try("V", again > 0.0, **facts, velocity_after=flown, again=again)

    def motion(self, rng: np.random.Generator) -> None:
        """Try III, that relative flight is straight, and exit_time."""
        motion = self._model
        if choice.answers(meeting_time, motion):
            if self._d > 1:  # a curve has room to bend
                self._curves(rng)
            return
        x, v = rng.uniform(0.0, 20.0, (2, self._d)), rng.normal(size=(2, self._d))
        first, second = rng.uniform(0.0, 2.0, 2)
        places, speeds = _flown(motion, *_flown(motion, x, v, first), second)
        at_once, speeds_at_once = _flown(motion, x, v, first + second)
        size = np.abs(x).max() + np.abs(at_once).max() + np.abs(speeds).max()
        facts = {"x": x[0], "v": v[0], "first": first, "second": second}
        off = max(np.abs(places - at_once).max(), np.abs(speeds - speeds_at_once).max())
        self._try("III", off <= TOLERANCE * size, **facts, off=off)
        straight = (x[1] - x[0]) + (first + second) * (v[1] - v[0])
        off = np.abs((at_once[1] - at_once[0]) - straight).max()
        self._try("relative", off <= TOLERANCE * size, **facts, off=off)
        for axis in range(self._d):
            low, high = x[0, axis] - rng.uniform(0.01, 2.0), x[0, axis] + rng.uniform(0.01, 2.0)
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

    def _curves(self, rng: np.random.Generator) -> None:
        """Try I, III, IV and V on two components that move along curves, and what else they must keep."""
        motion, contact, rate, span = self._model, 0.3, rng.uniform(0.0, 0.05), 20.0
        # To go nowhere is to be put where the motion has its components.
        places, speeds = rng.uniform(9.0, 11.0, (2, self._d)), rng.normal(size=(2, self._d))
        pair = [_carried(motion, *one, 0.0) for one in zip(places, speeds, strict=True)]
        first, second = rng.uniform(0.0, 2.0, 2)
        x, v = _carried(motion, *_carried(motion, *pair[0], first), second)
        at_once, then = _carried(motion, *pair[0], first + second)
        facts = {"x": [x for x, _ in pair], "v": [v for _, v in pair]}
        size = np.abs(at_once).max() + np.abs(then).max()
        off = max(np.abs(x - at_once).max(), np.abs(v - then).max())
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
        chords = np.array([np.linalg.norm(b[0] - a[0]) for a, b in flown])
        gaps = chords - contact - rate * times
        touches = abs(gaps[-1]) <= TOLERANCE and gaps.min() >= -TOLERANCE
        self._try("first", touches, **facts, time=t, gaps=gaps)
        left = _meeting(motion, flown[21], contact + rate * times[21], rate, span)
        self._try("IV", abs(times[21] + left - t) <= TOLERANCE * (1.0 + t), **facts, time=t, left=left)
        (xi, vi), (xj, vj) = flown[-1]
        r, u = xj - xi, vj - vi
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
        """Try the part of the momentum that is exchanged."""
        distance, speed = rng.uniform(0.5, 2.0), 10.0 ** rng.uniform(-6.0, 2.0)
        part = float(transfer(self._model, distance * distance, -speed * distance))
        self._try("part", 0.5 <= part <= 1.0, distance=distance, normal_speed=speed, part=part)


def _carried(motion: Any, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return place and velocity (d,) of one component on a curve a time later."""
    there, then, left = carry(motion, x, v, t, np.empty_like(x), np.empty_like(v))
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


def _flown(motion: Any, x: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places and velocities (k, d) a time later."""
    places = [
        [position(motion, k, *xv, t) for k, xv in enumerate(zip(*both, strict=True))]
        for both in zip(x, v, strict=True)
    ]
    speeds = [[velocity(motion, k, u, t) for k, u in enumerate(each)] for each in v]
    return np.array(places), np.array(speeds)
