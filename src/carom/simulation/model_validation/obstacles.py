"""Obstacles and walls, tried on flights of single components towards them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from carom.models import model_checks
from carom.models.interfaces.memory import copied
from carom.models.interfaces.particles import NEVER
from carom.models.obstacles import walls
from carom.models.obstacles.box_walls import cushions
from carom.models.obstacles.surfaces import Lossy, Thermostat
from carom.models.obstacles.with_properties import Dressed
from carom.simulation.model_validation.setting import (
    GRAZING,
    TOLERANCE,
    Record,
    Setting,
    direction,
    number_of,
    time_of,
)

LOOKS = 65  # times at which the way of a component is looked at

TRIAL_MARGIN = 2.0**-48
"""Part of its coordinates by which a component is put inside an obstacle, as rounding might."""

FAST = 2.0**40
"""Factor with which a component is so fast that no temperature and no motion of an obstacle counts."""

Start = tuple[np.ndarray, np.ndarray, float]  # place and velocity (d,) of a component, and its radius


class ObstacleTrial:
    """The conditions of an obstacle, as a scene takes it, in one setting, where radii grow at a rate."""

    def __init__(self, value: Any, setting: Setting, record: Record, growth: float = 0.0):
        self._value, self._setting, self._record, self._growth = value, setting, record, growth
        self._live = hasattr(value, "live")
        self.model = copied(value.live(setting.particles) if self._live else value.model())
        self._moves = _moves(self.model)
        self._edges = np.where(setting.periodic, setting.box, 0.0)

    def starts(self, rng: np.random.Generator, places: np.ndarray, radii: np.ndarray) -> Iterator[Start]:
        """Yield components at places (m, d) outside of the obstacle, most of which fly towards it."""
        gaps = self.gaps(places, radii, 0.0)
        d, speed = self._setting.dimension, self._setting.speed
        for k in np.flatnonzero(gaps > 0.0).tolist():
            step = 2.0**-12 * float(min(gaps[k], radii[k]) or gaps[k])
            gaps_nearby = self.gaps(places[k] + step * np.eye(d), np.full(d, radii[k]), 0.0)
            towards = -(gaps_nearby - gaps[k]) / step
            if not np.isfinite(towards).all():
                towards = np.zeros(d)
            v = 10.0 ** rng.uniform(0.0, 2.0) * towards + direction(rng, d)
            v *= speed * 10.0 ** rng.uniform(-1.0, 1.0) / np.linalg.norm(v)
            yield places[k], v, float(radii[k])

    def gaps(self, places: np.ndarray, radii: np.ndarray, times: Any) -> np.ndarray:
        """Return the distances (m,) of components at places (m, d) at ``times`` from the obstacle."""
        setting = self._setting
        moment = (times, setting.particles.unit) if isinstance(self._value, Dressed) else ()
        found = self._value.gap(places, radii, tuple(setting.particles.box), setting.periodic, *moment)
        return np.asarray(found, np.float64)

    def of(self, x: np.ndarray, v: np.ndarray, radius: float) -> bool:
        """Try the flight of one component, and return whether it meets the obstacle."""
        setting = self._setting
        times = self._inside(x, v)
        t = self._time(x, v, radius, 0.0)
        facts: dict[str, Any] = {"x": x, "v": v, "radius": radius, "time": t}
        scale = float(np.abs(x).max()) + setting.size + float(np.linalg.norm(v)) * min(t, float(times[-1]))
        if t <= times[-1]:
            times = np.append(times[times < t], t)
        if known_to_move(self._value, self.model):
            places = setting.course(x[None], v[None], times)[:, 0]
            gaps = self.gaps(places, radius + self._growth * times, times)
            slack = TOLERANCE * scale
            holds = gaps.min() >= -slack and (times[-1] != t or abs(gaps[-1]) <= slack)
            self._note("encounter", holds, **facts, least_gap=gaps.min(), last_gap=gaps[-1], until=times[-1])
            if not holds:
                return True
        if times[-1] != t or t == NEVER:
            return False
        part = 0.37 * t
        (there,), (then,) = setting.moved(x[None], v[None], part)
        left = self._time(there, then, radius + self._growth * part, part)
        speed_of_trial = float(np.linalg.norm(v)) or setting.speed
        self._note(
            "IV",
            abs(part + left - t) <= TOLERANCE * (t + scale / speed_of_trial),
            **facts,
            part=part,
            left=left,
        )
        self._thrown(x, v, radius, t, scale, facts)
        return True

    def _note(self, condition: str, holds: Any, **numbers: Any) -> None:
        self._record.note(condition, self._setting.dimension, holds, **numbers)

    def _inside(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return times until a component leaves the box, or has had the time to cross it."""
        setting = self._setting
        speed_of_trial = float(np.abs(v).max()) or setting.speed
        times = np.linspace(0.0, 2.0 * float(setting.box.max()) / speed_of_trial, 4 * LOOKS)
        places = setting.course(x[None], v[None], times)[:, 0]
        out = ((places < 0.0) | (places > setting.box)).any(axis=1)
        last = int(np.argmax(out)) if out.any() else len(times)
        return np.linspace(0.0, float(times[max(last - 1, 1)]), LOOKS)

    def _time(self, x: np.ndarray, v: np.ndarray, radius: float, now: float) -> float:
        """Return when a component meets the obstacle, in any image of the box in which it stands."""
        best, motion = NEVER, self._setting.motion
        plain = self._setting.free and not self._moves and model_checks.answers("encounter", self.model)
        for place_ in self._images(x):
            way = (place_, v, radius, self._growth)
            asked = ("encounter", self.model, *way) if plain else (motion.meeting, self.model, *way, now)
            best = min(best, time_of(*asked))
        return best

    def _images(self, x: np.ndarray) -> Iterator[np.ndarray]:
        if not self.model.is_periodic():
            yield x.copy()
            return
        turns = np.floor([self._turns(axis) for axis in range(len(x))])
        for step in itertools.product((-1.0, 0.0, 1.0), repeat=len(x)):
            yield x + (turns + step) * self._edges

    def _turns(self, axis: int) -> float:
        edge = float(self._edges[axis])
        return float(self.model.anchor(axis)) / edge if edge > 0.0 else 0.0

    def _facing(self, x: np.ndarray) -> np.ndarray:
        """Return the image of a place that is nearest to the obstacle."""
        if not self.model.is_periodic():
            return x.copy()
        image = x.copy()
        for axis in np.flatnonzero(self._edges):
            edge = self._edges[axis]
            image[axis] -= edge * np.rint((x[axis] - self.model.anchor(int(axis))) / edge)
        return image

    def _thrown(
        self, x: np.ndarray, v: np.ndarray, radius: float, t: float, scale: float, facts: dict[str, Any]
    ) -> None:
        """Try the normal where a component touches, and how it is thrown back."""
        setting, d, growth = self._setting, self._setting.dimension, self._growth
        (x,), (v,) = setting.moved(x[None], v[None], t)
        size = radius + growth * t
        self.model.at_time(t)
        image = self._facing(x)
        normal = np.array([number_of("outward", self.model, image, axis) for axis in range(d)])
        length = float(np.linalg.norm(normal))
        speed = growth + number_of("surface_speed", self.model, normal, t)
        approach = speed - float(normal @ v)
        away = True
        if not self._moves:
            step = 2.0**-12 * size
            there, beyond = self.gaps(np.array([x, x + step * normal]), np.full(2, size), t)
            away = beyond > there
        sound = abs(length - 1.0) <= TOLERANCE and approach >= -GRAZING * np.linalg.norm(v) and away
        self._note("outward", sound, **facts, place=x, normal=normal, length=length)
        if not sound or approach < GRAZING * float(np.linalg.norm(v)):
            return
        if not self._moves:
            hair = TRIAL_MARGIN * scale
            next_time = self._time(x - hair * normal, v, size, t)
            self._note(
                "touching", next_time * approach <= TOLERANCE * scale, **facts, place=x, next_time=next_time
            )
        after = self._recoiled(x, v, normal, t)
        if self._live and not getattr(self._value, "adds_energy", False):
            fast = self._recoiled(x, FAST * v, normal, t)
            held = float(fast @ fast) <= (1.0 + TOLERANCE) * FAST * FAST * float(v @ v)
            self._note("gain", held, **facts, before=FAST * v, after=fast)
        next_time = self._time(x, after, size, t)
        self._note("V", next_time > 0.0, **facts, velocity_after=after, next_time=next_time)

    def _recoiled(self, x: np.ndarray, v: np.ndarray, normal: np.ndarray, t: float) -> np.ndarray:
        after, mass = np.array(v), float(self._setting.particles.masses[0])
        self.model.recoil(self._setting.motion, 0, mass, x.copy(), after, normal.copy(), self._growth, t)
        return after


def _moves(model: Any) -> bool:
    """Tell whether a model is of an obstacle that moves; a surface passes this on from what it covers."""
    while isinstance(model, Lossy | Thermostat):
        model = model.body
    return any(model_checks.answers(question, model) for question in ("arrival", "at_time", "surface_speed"))


def known_to_move(value: Any, model: Any) -> bool:
    """Tell whether it is known where an obstacle is at any time: it rests, or a path displaces it."""
    return (isinstance(value, Dressed) and value.path is not None) or not _moves(model)


def try_walls(setting: Setting, record: Record, rng: np.random.Generator, growth: float = 0.0) -> None:
    """Try the time at which a component meets a wall of the box in a motion, on a flight from ``rng``."""
    d, box = setting.dimension, setting.box
    built = cushions(box.tolist(), setting.periodic)
    i = int(rng.integers(setting.n))
    radius = float(setting.particles.radii[i])
    low, high = np.full(d, radius), box - radius
    if not (low < high).all():
        return
    x = rng.uniform(low, high)
    v = rng.normal(size=d) * setting.speed
    (x,), (v,) = setting.moved(x[None], v[None], 0.0)
    try:
        t, number = setting.motion.wall_meeting(built, x, v, radius, growth)
    except (ArithmeticError, ValueError):
        t, number = NEVER, -1
    until = float(t) if t < NEVER else 8.0 * float(box.max()) / setting.speed
    times = np.linspace(0.0, until, 4 * LOOKS)
    places = setting.course(x[None], v[None], times)[:, 0]
    radii = radius + growth * times
    found = {
        2 * axis + side: (places[:, axis] if side == 0 else box[axis] - places[:, axis]) - radii
        for axis in range(d)
        if not setting.periodic[axis]
        for side in (0, 1)
    }
    slack = TOLERANCE * (float(box.max()) + float(np.abs(places).max()))
    least = min(float(gaps.min()) for gaps in found.values())
    last = float(found[int(number)][-1]) if t < NEVER and int(number) in found else math.nan
    holds = least >= -slack and (not t < NEVER or abs(last) <= slack)
    names = [wall.name for wall in walls(box.tolist(), list(setting.periodic))]
    wall = dict(zip(found, names, strict=True)).get(int(number), "none")
    record.note(
        "encounter",
        d,
        holds,
        x=x,
        v=v,
        radius=radius,
        time=float(t),
        wall=wall,
        least_gap=least,
        last_gap=last,
    )
