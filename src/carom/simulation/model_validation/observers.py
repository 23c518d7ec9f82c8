"""What is tried of an observer: events that might happen, of which it is told in plain Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from carom.models.questions.observer import (
    Epoch,
    ObstacleEvent,
    PairEvent,
    at_epoch,
    at_obstacle,
    at_pair,
)
from carom.models.questions.steps import CORE

if TYPE_CHECKING:
    from carom.scene.scene import Scene

TRIED = 64  # events that an observer is told of in plain Python, before it is compiled


def try_events(observer: Any, scene: Scene, radii: np.ndarray, fixed: int) -> None:
    """Tell an observer, whose arrays are written to, of events that might happen, in plain Python."""
    rng, n, d = np.random.default_rng(4), scene.n, scene.dimension
    speed = 1.0 if scene.velocities is None else float(np.sqrt(np.mean(scene.velocities**2))) or 1.0
    for _ in range(TRIED):
        i, j = (int(k) for k in rng.integers(0, n, 2))
        normal = rng.normal(size=d)
        normal /= np.sqrt(np.sum(normal**2))
        v = speed * rng.normal(size=(2, d))
        if normal @ (v[1] - v[0]) > 0.0:  # they would fly apart
            v = v[::-1].copy()
        approach = float(normal @ (v[1] - v[0]))
        reflected = v + approach * np.array([normal, -normal])
        r, virial = (radii[i] + radii[j]) * normal, -approach * scene.mass * (radii[i] + radii[j])
        places, time = scene.positions[[i, j]], float(rng.uniform())
        if i != j:
            at_pair(observer, PairEvent(i, j, time, r, places, v, reflected, virial, CORE))
        if fixed:
            momentum = -2.0 * float(normal @ v[0])
            bounced, number = v[0] + momentum * normal, int(rng.integers(0, fixed))
            at_obstacle(
                observer,
                ObstacleEvent(i, number, time, normal, places[0], v[0], bounced, scene.mass * momentum, 0.0),
            )
    at_epoch(observer, Epoch(0.0, scene.positions.copy(), speed * rng.normal(size=(n, d))))
