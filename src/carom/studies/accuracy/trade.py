"""The tasks of ``carom trade``: speed against accuracy, measured on the user's machine and scene."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from carom.observables.statistics import Estimate
from carom.scene.scene import Scene
from carom.scene_file.fields import tuples
from carom.scene_file.sections import SceneSpec
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.accuracy.measures import (
    SAMPLES,
    Faithfulness,
    Track,
    expected_pressure,
    faithfulness,
    measured,
    reversal,
    speed,
    true_track,
)
from carom.studies.accuracy.methods import Method, engine, oracle, pseudo_hard, stepping
from carom.studies.accuracy.scenes import medium_scene, small_scene
from carom.studies.accuracy.statistics import sampling, size
from carom.studies.folder import Task, canonical
from carom.studies.phase import finite

STARTS = 3
"""Small scenes to follow. One is not enough: a grazing collision may end its trajectory early by chance."""

BACK = (5, 10, 20)
"""Collisions per particle forward, and as many back."""

FRAMES = 250
"""Frames at the shortest interval for each second of a row."""

LYAPUNOV = {
    (2, 0.3): (2.377, 1.6201),
    (2, 0.7): (5.13, 9.2062),
    (3, 0.5): (5.627, 7.6244),
}
"""Largest Lyapunov exponent and collision rate of a particle by (d, density), at N = 64 and kT = 1, to 0.7 %.
From tangent-space dynamics after Dellago, Posch and Hoover, Phys. Rev. E 53, 1485 (1996). There 2 K / (d N)
is 1; with kT = 2 K / (d (N - 1)) all rates are smaller by sqrt(63 / 64).
"""


def compared(task: Task, look: Callable[..., object]) -> dict[str, Any]:
    """Return a row of a table: that of a method, of a number of particles, or of an interval of sampling."""
    seed, seconds = task["seed"], task["seconds"]
    where = canonical(task["scene"])
    if task["row"] == "size":
        eta, d = _placed(where, seed).packing_fraction, task["scene"]["dimension"]
        crystal = Scene.crystal(cells=task["cells"], dimension=d, packing_fraction=eta)
        return size(crystal, seed, 0.5 * seconds, look)
    scene, starts = _moving(where, seed)
    mean_free_time = starts[0][1]
    if task["row"] == "interval":
        # 0.1 mean free times is the shortest interval.
        return sampling(
            medium_scene(scene), mean_free_time, seed, 0.1 * round(FRAMES * seconds), task["interval"], look
        )
    tracks = _tracks(where, seed, seconds, look)
    small = starts[0][0]
    if task["row"] == "reference":
        found = measured(small, engine(), mean_free_time, seconds, look)
        return {
            "n": small.n,
            "Z": _pair(found.pressure.Z),
            "D": _pair(found.diffusion),
            "expected": expected_pressure(small),
            "scene": repr(scene),
            "small": repr(small),
            "horizon": _horizon(small, tracks),
        }
    method = method_of(task["method"], mean_free_time)
    followings = [(start, track) for (start, _), track in zip(starts, tracks, strict=True)]
    return _measured(method, scene if method.fast else small, followings, mean_free_time, seconds, look)


def method_of(words: Mapping[str, Any], mean_free_time: float) -> Method:
    """Return the method that a task names."""
    kind = words["kind"]
    if kind == "event-driven":
        single = words["precision"] == "single"
        return engine("float32", precision="single") if single else engine()
    if kind == "naive":
        return oracle(words["digits"])
    if kind == "time-driven":
        return stepping(words["step"], mean_free_time)
    return pseudo_hard(words["step"], mean_free_time)


# What all rows need is made once in a process: a comparison that goes on makes it anew, with the same bits.


@functools.lru_cache(maxsize=1)
def _placed(where: str, seed: int) -> Scene:
    """Return the scene of a task."""
    return SceneSpec(**tuples(json.loads(where))).build(seed)


@functools.lru_cache(maxsize=1)
def _moving(where: str, seed: int) -> tuple[Scene, list[tuple[Scene, float]]]:
    """Return the scene in motion, and small ones with their mean free times."""
    scene, _ = melted(_placed(where, seed), seed)
    return scene, [melted(small_scene(scene), seed + k) for k in range(STARTS)]


@functools.lru_cache(maxsize=1)
def _tracks(where: str, seed: int, seconds: float, look: Callable[..., object]) -> list[Track]:
    """Return the true trajectories of the small scenes; the looks of all tasks of a session are equal."""
    _, starts = _moving(where, seed)
    return [true_track(start, oracle(), starts[0][1], _reach(seconds), look) for start, _ in starts]


def _reach(seconds: float) -> float:
    """Return the collisions per particle of the oracle's trajectory: with 8 s, the horizon of doubles."""
    return min(max(7.5 * seconds, 12.0), 60.0)


def _pair(estimate: Estimate) -> list[float]:
    return [float(estimate.mean), float(estimate.error)]


def _measured(
    method: Method,
    where: Scene,
    followings: list[tuple[Scene, Track]],
    mean_free_time: float,
    seconds: float,
    look: Callable[..., object],
) -> dict[str, Any]:
    """Return the figures of a method, on the scene or on the small one."""
    found = measured(where, method, mean_free_time, seconds, look)
    small, track = followings[0]
    rate, moving = speed(where, method, SAMPLES * mean_free_time, 0.25 * seconds, look)
    # The oracle would only be compared with itself.
    follows = Faithfulness()
    if not method.many_digits:
        follows = median([faithfulness(start, method, true, look) for start, true in followings])
    followed = 2.0 * float(track.collisions[-1]) / small.n
    back = [
        finite(reversal(small, method, count * mean_free_time)) if 2.0 * count <= followed else None
        for count in BACK
    ]
    overlap, energy, momentum = found.motion.faults()
    collisions = found.motion.tally()[1]
    count = found.pressure.Z if method.kind == "pseudo-hard" else found.pressure.Z_from_rate
    return {
        "method": method.name,
        "algorithm": method.kind,
        "n": where.n,
        "bytes_per_particle": finite(moving.bytes_per_particle()),
        "worst_overlap": finite(overlap),
        "energy_drift": energy * 1e6 / collisions,
        "momentum_drift": momentum * 1e6 / collisions,
        "order": finite(min(follows.order, followed)),
        "order_kept": math.isinf(follows.order),
        "position": min(follows.position, followed),
        "position_kept": math.isinf(follows.position),
        "error_1": finite(follows.error),
        "back": back,
        "Z": _pair(found.pressure.Z),
        "count": _pair(count),
        "D": _pair(found.diffusion),
        "expected": expected_pressure(where),
        "timings": {"collisions_per_second": rate, "cpu_seconds": found.seconds},
    }


def melted(scene: Scene, seed: int) -> tuple[Scene, float]:
    """Return the scene in motion, after 200 collisions per particle, and its mean free time."""
    sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
    sim.run(collisions_per_particle=100)
    start, before = sim.time, sim.collisions
    sim.run(collisions_per_particle=100)
    frame = sim.frame()
    moving = scene.replace(positions=frame.positions, velocities=frame.velocities)
    return moving, (sim.time - start) * scene.n / (2 * (sim.collisions - before))


def median(found: list[Faithfulness]) -> Faithfulness:
    """Return the median of each of the figures."""
    middle = np.median([dataclasses.astuple(one) for one in found], axis=0)
    return Faithfulness(*(float(x) for x in middle))


def _horizon(small: Scene, tracks: list[Track]) -> dict[str, float | None]:
    """Return how long doubles can follow a trajectory, by the mean Lyapunov exponent of the oracle's.

    ``lyapunov`` and ``rate`` are [1 / time]; all else is in collisions per particle, ``to_one`` and
    ``to_apart`` until one rounding has grown to one and to 10^-3 diameters.
    """
    eps = float(np.finfo(float).eps)
    density = small.n / math.prod(edge / small.diameter for edge in small.box)
    published = next(
        (
            -math.log(eps) / exponent * rate
            for (d, rho), (exponent, rate) in LYAPUNOV.items()
            if d == small.dimension and abs(density / rho - 1.0) < 0.01
        ),
        None,
    )
    lyapunov = float(np.mean([each.lyapunov for each in tracks]))
    rate = float(np.mean([each.rate for each in tracks]))
    return {
        "lyapunov": lyapunov,
        "rate": rate,
        "to_one": -math.log(eps) / lyapunov * rate,
        "to_apart": math.log(1e-3 / eps) / lyapunov * rate,
        "published_to_one": published,
        "followed": 2.0 * float(tracks[0].collisions[-1]) / small.n,
    }
