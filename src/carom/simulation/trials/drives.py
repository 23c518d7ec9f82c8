"""What is tried of a drive, in plain Python: its times and its kicks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.questions.particles import NEVER
from carom.simulation.trials.setting import TOLERANCE, Record, Setting, number_of

AT_ONCE = 8  # events of one component that may come at one time, at most


def try_drive(drive: Any, setting: Setting, record: Record, rng: np.random.Generator, i: int) -> None:
    """Try the first events of component i, which flies along its motion between them."""
    unit = setting.particles.unit
    speed = float(unit.to_scene(setting.speed, -1))
    x, v = rng.uniform(size=setting.dimension) * setting.box, speed * rng.normal(size=setting.dimension)
    mass, time = float(setting.particles.masses[i]), 0.0
    first = math.inf
    for _ in range(AT_ONCE):
        next_kick = number_of(drive.next_time, i, x, v, time)
        facts = {"i": i, "x": x.copy(), "v": v.copy(), "time": time, "next_time": next_kick}
        tolerance = TOLERANCE * max(abs(time), setting.size / speed)
        record.note("due", setting.dimension, next_kick >= time - tolerance, **facts)
        if math.isnan(next_kick):
            return
        left = setting.size / speed if next_kick == NEVER else max(next_kick - time, 0.0)
        for part in sorted(rng.uniform(size=2)):
            there, then = flown(setting, x, v, part * left)
            again = number_of(drive.next_time, i, there, then, time + part * left)
            same = again == next_kick or abs(again - next_kick) <= tolerance + TOLERANCE * left
            record.note("asked", setting.dimension, same, **facts, asked=time + part * left, again=again)
        if next_kick == NEVER:
            return
        x, v = flown(setting, x, v, left)
        time = max(next_kick, time)
        first = min(first, time)
        if (returned := drive.kick(i, mass, x, v, time)) is not None:
            raise InputError(
                f"kick of {type(drive).__name__} returns {checks.describe(returned)}; expected nothing: "
                "write the new velocity into v, v[axis] = ..."
            )
        record.note("kick", setting.dimension, np.isfinite(v).all(), **facts, after=v.copy())
        if not np.isfinite(v).all():
            return
    record.note("later", setting.dimension, time > first, i=i, time=time)


def flown(setting: Setting, x: np.ndarray, v: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return place in the box and velocity (d,) a ``time`` later, all in the units of the scene."""
    if setting.curved:
        return np.mod(x + v * time, setting.box), v
    unit = setting.particles.unit
    places, speeds = setting.moved(x[None], unit.to_kernel(v[None], -1), float(unit.to_kernel(time, 1)))
    return np.mod(places[0], setting.box), unit.to_scene(speeds[0], -1).copy()
