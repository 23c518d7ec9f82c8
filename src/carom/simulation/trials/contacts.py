"""What is tried of a contact law, in plain Python: the part of the momentum that it exchanges."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.simulation.trials.setting import TOLERANCE, Record, Setting, number_of


def try_impact(
    law: Any, value: Any, setting: Setting, record: Record, rng: np.random.Generator, i: int, j: int
) -> None:
    """Try the part of the momentum that the ``law`` of a ``value`` exchanges where i and j touch."""
    distance = setting.size * rng.uniform(0.5, 2.0)
    speed = setting.speed * 10.0 ** rng.uniform(-6.0, 2.0)
    rr, rv = np.float64(distance * distance), np.float64(-speed * distance)
    for part in (number_of(law.transfer, rr, rv), number_of(law.exchanged_part, i, j, rr, rv, 0.0)):
        facts = {"i": i, "j": j, "distance": distance, "normal_speed": speed, "part": part}
        record.note("part", setting.dimension, part >= 0.5 - TOLERANCE, **facts)
        if getattr(value, "elastic", False):
            record.note("elastic", setting.dimension, abs(part - 1.0) <= TOLERANCE, **facts)
        if not getattr(value, "adds_energy", False):
            record.note("gain", setting.dimension, not part > 1.0 + TOLERANCE, **facts)
