"""What is tried of a drive, in plain Python: its times and its kicks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom.models.drives import kick, next_time
from carom.models.questions.particles import NEVER
from carom.simulation.trials import TOLERANCE, Record, Setting, number_of

AT_ONCE = 8
"""Events of one component that may come at one time, at most."""


def try_drive(drive: Any, setting: Setting, record: Record, rng: np.random.Generator, i: int) -> None:
    """Try the first events of component i, which flies freely between them.

    Parameters
    ----------
    drive : model
        What kicks it; its memory is written to.
    setting : Setting
        The components.
    record : Record
        Where results go.
    rng : numpy Generator
        Where place and velocity come from.
    i : int
        The component.
    """
    unit = setting.particles.unit
    speed = float(unit.to_scene(setting.speed, -1))
    x, v = rng.uniform(size=setting.dimension) * setting.box, speed * rng.normal(size=setting.dimension)
    mass, time = float(setting.particles.masses[i]), 0.0
    for _ in range(AT_ONCE):
        next_kick = number_of(next_time, drive, i, x, v, time)
        facts = {"i": i, "x": x.copy(), "v": v.copy(), "time": time, "next_time": next_kick}
        tolerance = TOLERANCE * max(abs(time), setting.size / speed)
        record.note("due", setting.dimension, next_kick >= time - tolerance, **facts)
        if math.isnan(next_kick) or next_kick == NEVER:
            return
        x = np.mod(x + v * max(next_kick - time, 0.0), setting.box)
        time = max(next_kick, time)
        kick(drive, i, mass, x, v, time)
        record.note("kick", setting.dimension, np.isfinite(v).all(), **facts, after=v.copy())
        if not np.isfinite(v).all():
            return
    record.note("later", setting.dimension, time > 0.0, i=i, time=time)
