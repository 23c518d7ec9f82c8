"""Single questions to an interaction of one's own, in plain Python: where two act on each other."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.models.interfaces.particles import Particles
from carom.simulation.model_validation.setting import time_of

if TYPE_CHECKING:
    from carom.engine.system import System

SPEEDS = (1.0, 1024.0)
"""Speeds of head-on approaches, in units of the thermal speed: an interaction may depend on the speed."""

DOUBLINGS = 64  # how often the distance at which an approach begins is doubled


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
        return time_of("interaction_time", pair, i, j, r * r, -r * v, v * v, 0.0)
    return time_of("step_time", pair, i, j, step, r * r, -r * v, v * v, 0.0)


def kinds_of(model: Any, system: System) -> np.ndarray:
    """Return a number for each component, (n,): equal where no field of the model and no radius differs."""
    n = system.n
    columns = [system.particles.radii, system.particles.masses]
    for values in model:
        if isinstance(values, np.ndarray) and values.ndim > 0 and len(values) >= n:
            columns.append(values[:n].reshape(n, -1).astype(float))
    kinds = np.zeros(n, np.int64)
    for column in columns:  # one after the other: sorting numbers is much faster than sorting rows
        if (column == column[0]).all():
            continue
        several = np.ascontiguousarray(column).reshape(n, -1)
        values = several[:, 0] if several.shape[1] == 1 else several
        which = np.unique(values, axis=0, return_inverse=True)[1].ravel()
        kinds = np.unique(kinds * (which.max() + 1) + which, return_inverse=True)[1].ravel()
    return kinds


def by_kind(kinds: np.ndarray, pairs: np.ndarray, question: Callable[[int, int], float]) -> np.ndarray:
    """Return what a ``question`` of two answers for ``pairs`` (m, 2), asked once for any two ``kinds``."""
    if not len(pairs):
        return np.zeros(0)
    sorted_kinds = np.sort(kinds[pairs], axis=1)
    names = sorted_kinds[:, 0] * (int(kinds.max()) + 1) + sorted_kinds[:, 1]
    _, indices, which = np.unique(names, return_index=True, return_inverse=True)
    return np.array([float(question(i, j)) for i, j in pairs[indices].tolist()])[which.ravel()]
