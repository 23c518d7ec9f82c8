"""Single questions to an interaction of one's own, in plain Python: where two act on each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom import checks
from carom.models.questions.interaction import interaction_time
from carom.models.questions.particles import Particles
from carom.models.questions.steps import step_time
from carom.simulation.trials import time_of

SPEEDS = (1.0, 1024.0)
"""Speeds of head-on approaches, in units of the thermal speed: an interaction may depend on the speed."""

DOUBLINGS = 64  # how often the distance at which an approach begins is doubled


def contact_range_of(interaction: Any, scene: Any) -> float:
    """Return the reach of an interaction in a scene, checked [length]."""
    name = f"reach(scene) of {type(interaction).__name__}"
    return checks.number(interaction.reach(scene), name, low=0.0, open_low=True)


def outermost(interaction: Any, particles: Particles, i: int, j: int) -> int | None:
    """Return the step of two that are beyond the reach of an interaction, or None without steps."""
    if not hasattr(interaction, "steps"):
        return None
    table = np.asarray(interaction.steps(particles)[1])
    if len(table) == 1 or particles.species is None:
        return int(table[0, 0])
    return int(table[particles.species[i], particles.species[j]])


def contact_distance(
    pair: Any, i: int, j: int, contact_range: float, speed: float = 1.0, step: int | None = None
) -> float:
    """Return the largest distance [length] at which i and j act on each other in a head-on approach, or 0.

    It begins at four times ``contact_range``, or further away if they act there, at the usual ``speed`` and
    on ``step``.
    """
    return max(_distance(pair, i, j, 4.0 * contact_range, float(v), step) for v in np.multiply(SPEEDS, speed))


def _distance(pair: Any, i: int, j: int, far: float, speed: float, step: int | None) -> float:
    """Return where two act on each other that approach from a distance ``far`` or more, or 0."""
    for _ in range(DOUBLINGS):
        t = time(pair, i, j, far, speed, step)
        if t > 0.0:
            return max(0.0, far - speed * t)
        far *= 2.0
    return far


def time(pair: Any, i: int, j: int, distance: Any, speed: Any, step: int | None = None) -> float:
    """Return the time until two act on each other that approach head-on from a distance [length]."""
    r, v = np.float64(distance), np.float64(speed)
    if step is None:
        return time_of(interaction_time, pair, i, j, r * r, -r * v, v * v, 0.0)
    return time_of(step_time, pair, i, j, step, r * r, -r * v, v * v, 0.0)
