"""What is tried of drives, contact laws and observers, in plain Python: their events."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.interfaces.observer import Epoch, ObstacleEvent, PairEvent
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.steps import CORE
from carom.simulation.model_validation.setting import TOLERANCE, Record, Setting, number_of

if TYPE_CHECKING:
    from carom.scene.scene import Scene

AT_ONCE = 8  # events of one component that may come at one time, at most


def try_drive(drive: Any, setting: Setting, record: Record, rng: np.random.Generator, i: int) -> None:
    """Try the first events of component i, which flies along its motion between them."""
    unit = setting.particles.unit
    speed = float(unit.to_scene(setting.speed, -1))
    x, v = rng.uniform(size=setting.dimension) * setting.box, speed * rng.normal(size=setting.dimension)
    mass, time = float(setting.particles.masses[i]), 0.0
    first = math.inf
    for _ in range(AT_ONCE):
        next_kick = number_of("next_time", drive, i, x, v, time)
        facts = {"i": i, "x": x.copy(), "v": v.copy(), "time": time, "next_time": next_kick}
        tolerance = TOLERANCE * max(abs(time), setting.size / speed)
        record.note("due", setting.dimension, next_kick >= time - tolerance, **facts)
        if math.isnan(next_kick):
            return
        left = setting.size / speed if next_kick == NEVER else max(next_kick - time, 0.0)
        for part in sorted(rng.uniform(size=2)):
            there, then = flown(setting, x, v, part * left)
            again = number_of("next_time", drive, i, there, then, time + part * left)
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


def try_impact(
    law: Any, value: Any, setting: Setting, record: Record, rng: np.random.Generator, i: int, j: int
) -> None:
    """Try the part of the momentum that the ``law`` of a ``value`` exchanges where i and j touch."""
    distance = setting.size * rng.uniform(0.5, 2.0)
    speed = setting.speed * 10.0 ** rng.uniform(-6.0, 2.0)
    rr, rv = np.float64(distance * distance), np.float64(-speed * distance)
    for part in (number_of("transfer", law, rr, rv), number_of("exchanged_part", law, i, j, rr, rv, 0.0)):
        facts = {"i": i, "j": j, "distance": distance, "normal_speed": speed, "part": part}
        record.note("part", setting.dimension, part >= 0.5 - TOLERANCE, **facts)
        if getattr(value, "elastic", False):
            record.note("elastic", setting.dimension, abs(part - 1.0) <= TOLERANCE, **facts)
        if not getattr(value, "adds_energy", False):
            record.note("gain", setting.dimension, not part > 1.0 + TOLERANCE, **facts)


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
            observer.at_pair(PairEvent(i, j, time, r, places, v, reflected, virial, CORE))
        if fixed:
            momentum = -2.0 * float(normal @ v[0])
            bounced, number = v[0] + momentum * normal, int(rng.integers(0, fixed))
            gained = scene.mass * momentum, 0.0, radii[i]
            observer.at_obstacle(
                ObstacleEvent(i, number, time, normal, places[0], v[0], bounced, *gained),
            )
    observer.at_epoch(Epoch(0.0, scene.positions.copy(), speed * rng.normal(size=(n, d))))
