"""The tasks of ``carom trade``: speed against accuracy, measured on the user's machine and scene."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from carom.observables.statistics import Estimate
from carom.scene.scene import Scene
from carom.scene_file.fields import tuples
from carom.scene_file.sections import SceneSpec
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.folder import Task, canonical
from carom.studies.job import Job, Look
from carom.studies.phase import finite
from carom.studies.trade.measures import (
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
from carom.studies.trade.methods import Method, engine, oracle, pseudo_hard, stepping
from carom.studies.trade.scenes import medium_scene, small_scene
from carom.studies.trade.statistics import sampling, size

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


_TRACKS: dict[tuple[str, int, float], list[Track]] = {}


def _reach(seconds: float) -> float:
    """Return the collisions per particle of the oracle's trajectory: with 8 s, the horizon of doubles."""
    return min(max(7.5 * seconds, 12.0), 60.0)


def _pair(estimate: Estimate) -> list[float]:
    return [float(estimate.mean), float(estimate.error)]


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


@dataclass
class TradeRow(Job):
    """A row of a table: that of a method, of a number of particles, or of an interval of sampling.

    Its parts take some seconds each; what is known of them is kept.
    """

    parts: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.where = canonical(self.task["scene"])
        self.seed, self.seconds = self.task["seed"], self.task["seconds"]

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the row at its start."""
        return cls(task)

    def step(self, look: Look) -> bool:
        """Measure the next part."""
        names = PARTS[self.task["row"]]
        name = names[len(self.parts)]
        self.parts[name] = getattr(self, name)(look.glance)
        return len(self.parts) < len(names)

    def result(self) -> dict[str, Any]:
        """Return the figures of all parts."""
        found: dict[str, Any] = {}
        for each in self.parts.values():
            found |= {**each, "timings": found.get("timings", {}) | each.get("timings", {})}
        return found

    @property
    def scene(self) -> Scene:
        """The scene in motion."""
        return _moving(self.where, self.seed)[0]

    @property
    def starts(self) -> list[Scene]:
        """Small scenes in motion."""
        return [start for start, _ in _moving(self.where, self.seed)[1]]

    @property
    def mean_free_time(self) -> float:
        """That of the first small scene."""
        return _moving(self.where, self.seed)[1][0][1]

    @property
    def method(self) -> Method:
        """The method of the row."""
        return method_of(self.task["method"], self.mean_free_time)

    @property
    def place(self) -> Scene:
        """Where the method is measured."""
        return self.scene if self.method.fast else self.starts[0]

    def sized(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return Z of a crystal of other size that melts."""
        eta, d = _placed(self.where, self.seed).packing_fraction, self.task["scene"]["dimension"]
        crystal = Scene.crystal(cells=self.task["cells"], dimension=d, packing_fraction=eta)
        return size(crystal, self.seed, 0.5 * self.seconds, look)

    def sampled(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return g(r), sampled at an interval."""
        duration = 0.1 * round(FRAMES * self.seconds)  # 0.1 mean free times is the shortest interval
        how = self.mean_free_time, self.seed, duration, self.task["interval"]
        return sampling(medium_scene(self.scene), *how, look)

    def reference(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return what the engine finds in the small scene."""
        small = self.starts[0]
        found = measured(small, engine(), self.mean_free_time, self.seconds, look)
        return {
            "n": small.n,
            "Z": _pair(found.pressure.Z),
            "D": _pair(found.diffusion),
            "expected": expected_pressure(small),
            "scene": repr(self.scene),
            "small": repr(small),
        }

    def horizon(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return how long trajectories can be followed."""
        return {"horizon": _horizon(self.starts[0], self._tracks(look))}

    def moved(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return Z, D and faults of the method."""
        method, where = self.method, self.place
        found = measured(where, method, self.mean_free_time, self.seconds, look)
        overlap, energy, momentum = found.motion.faults()
        collisions = found.motion.tally()[1]
        count = found.pressure.Z if method.kind == "pseudo-hard" else found.pressure.Z_from_rate
        return {
            "method": method.name,
            "algorithm": method.kind,
            "n": where.n,
            "worst_overlap": finite(overlap),
            "energy_drift": energy * 1e6 / collisions,
            "momentum_drift": momentum * 1e6 / collisions,
            "Z": _pair(found.pressure.Z),
            "count": _pair(count),
            "D": _pair(found.diffusion),
            "expected": expected_pressure(where),
            "timings": {"cpu_seconds": found.seconds},
        }

    def timed(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return the speed of the method, and its memory."""
        interval = SAMPLES * self.mean_free_time
        rate, moving = speed(self.place, self.method, interval, 0.25 * self.seconds, look)
        timings = {"collisions_per_second": rate}
        return {"bytes_per_particle": finite(moving.bytes_per_particle()), "timings": timings}

    def faithful(self, look: Callable[..., object]) -> dict[str, Any]:
        """Return how long the method follows the true trajectories, and whether it comes back."""
        method, starts, tracks = self.method, self.starts, self._tracks(look)
        # The oracle would only be compared with itself.
        follows = Faithfulness()
        if not method.many_digits:
            pairs = zip(starts, tracks, strict=True)
            follows = median([faithfulness(start, method, true, look) for start, true in pairs])
        followed = 2.0 * float(tracks[0].collisions[-1]) / starts[0].n
        back = [
            finite(reversal(starts[0], method, count * self.mean_free_time))
            if 2.0 * count <= followed
            else None
            for count in BACK
        ]
        return {
            "order": finite(min(follows.order, followed)),
            "order_kept": math.isinf(follows.order),
            "position": min(follows.position, followed),
            "position_kept": math.isinf(follows.position),
            "error_1": finite(follows.error),
            "back": back,
        }

    def _tracks(self, look: Callable[..., object]) -> list[Track]:
        """Return the true trajectories of the small scenes."""
        name = self.where, self.seed, self.seconds
        if name not in _TRACKS:
            _TRACKS.clear()
            how = oracle(), self.mean_free_time, _reach(self.seconds), look
            _TRACKS[name] = [true_track(start, *how) for start in self.starts]
        return _TRACKS[name]


PARTS = {
    "size": ("sized",),
    "interval": ("sampled",),
    "reference": ("horizon", "reference"),
    "method": ("moved", "timed", "faithful"),
}
"""The parts of each kind of row."""
