"""One seed of a spherical code: caps on great circles grow until they jam (the paper's secs. 9, 11)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from carom.models.motions.great_circles import GreatCircles
from carom.scene.scene import Scene
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.job import Job, Look

EDGE = 8.0
"""Edge of the box around the unit sphere: no image is near."""

SPARSE = 0.1
"""Diameter at the start over that of caps that would tile the sphere."""

CLOSING = 1e3
"""Reduced pressure from which caps grow ten times as fast: they can no longer order."""

JAMMED = 1e8
"""Reduced pressure at which a compression ends: gaps of contacts are then of order 1e-8."""

HEATING = 0.4
"""Growth rate times collisions per cap between two rescalings, as in :mod:`carom.studies.packings`."""

STRETCHES = 4000
"""Stretches after which a compression ends at any pressure."""


def random_points(n: int, k: int, apart: float, rng: np.random.Generator) -> np.ndarray:
    """Return ``n`` random points of the unit sphere in R^k, (n, k), at least ``apart`` from each other."""
    points = np.empty((0, k))
    while len(points) < n:
        x = rng.standard_normal(k)
        x /= np.linalg.norm(x)
        if not len(points) or np.linalg.norm(points - x, axis=1).min() > apart:
            points = np.vstack([points, x])
    return points


def tiling_diameter(n: int, k: int) -> float:
    """Return the approximate chord between ``n`` points whose caps would tile the sphere."""
    area = 2.0 * math.exp(0.5 * k * math.log(math.pi) - math.lgamma(0.5 * k))
    cap = math.exp(0.5 * (k - 1) * math.log(math.pi) - math.lgamma(0.5 * (k + 1)))
    return min(2.0 * (area / (n * cap)) ** (1.0 / (k - 1)), 2.0)


def scene_of(points: np.ndarray, diameter: float) -> Scene:
    """Return points (n, k) of the unit sphere as caps whose centers touch at a chord of ``diameter``."""
    return Scene(0.5 * EDGE + points, box=EDGE, diameter=diameter, motion=GreatCircles())


@dataclass
class Caps(Job):
    """Random points of a sphere that grow into caps until they jam.

    The task has ``n`` points, the ``dimension`` k of their space, the ``rate`` of growth and the ``seed``.
    """

    what: ClassVar[str] = "a code"

    growth: float = 0.0  # present rate
    pressure: float = 1.0  # reduced pressure of the last stretch
    stretches: int = 0

    @classmethod
    def begin(cls, task: dict[str, Any]) -> Self:
        """Return the points at their start."""
        n, k, rate = task["n"], task["dimension"], task["rate"]
        rng = np.random.default_rng([n, k, task["seed"]])
        start = SPARSE * tiling_diameter(n, k)
        scene = scene_of(random_points(n, k, start, rng), start)
        seed = int(rng.integers(2**31))
        return cls(task, Simulation(scene, seed=seed, growth=rate, tuning=Tuning(images=False)), rate)

    def step(self, look: Look) -> bool:
        """Let them grow for a stretch; return whether they are not jammed yet."""
        n, k, rate = self.task["n"], self.task["dimension"], self.task["rate"]
        block = self.sim.run(collisions_per_particle=max(HEATING / self.growth, 1.0))
        self.stretches += 1
        if block.duration > 0.0:
            heat = 0.5 * (1.0 + self.sim.kT) * block.duration  # kT rises from 1, about linearly in time
            self.pressure = 1.0 + block.virial / ((k - 1) * n * heat)
        if self.pressure >= JAMMED or self.stretches >= STRETCHES:
            return False
        self.growth = 10.0 * rate if self.pressure >= CLOSING else rate
        self.sim.rescale(1.0, growth=self.growth)
        return True

    def jammed(self) -> np.ndarray:
        """Return the points (n, k) on the unit sphere."""
        points = self.sim.frame().positions - 0.5 * EDGE
        return np.asarray(points / np.linalg.norm(points, axis=1)[:, None])

    def result(self) -> dict[str, Any]:
        """Return ``points`` (n, k), the reduced ``pressure`` at the end and ``collisions``."""
        points = self.jammed().tolist()
        return {"points": points, "pressure": self.pressure, "collisions": self.sim.collisions}
