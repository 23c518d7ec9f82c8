"""One run of a plan, measured in blocks that give two estimators of Z."""

from __future__ import annotations

import json
import math
import time as clock
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from carom import theory
from carom.errors import InputError
from carom.models.species import species_count
from carom.observables.statistics import Estimate
from carom.scene.fields import is_usual
from carom.scene.scene import Scene
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.studies.folder import Task
from carom.studies.scenes import simulation_of
from carom.studies.study import Look

BLOCKS = 512
"""Blocks of a run. Their error bar is known to 3 %; each costs a call of the engine."""

FIRST = 1000
"""Collisions after which all code of a run has been called."""

REPLICA = 10**6
"""Replica number of a pilot. No run of a study has it, so that no collisions are counted twice."""

_DONE: set[str] = set()
"""Kinds of tasks whose code is compiled and loaded in this process."""

FEWEST, BEYOND = 64, 2.6
"""Least blocks of the coarsest level; standard errors beyond which a correlation is significant (0.5 %)."""

ESTIMATORS = ("virial", "collision rate", "both")
"""Sources of Z: the virial of collisions, their number, or the best combination."""


def measure(task: Task, look: Look) -> dict[str, Any]:
    """Equilibrate and measure one run of a plan; ``timings`` has the CPU seconds of each stage."""
    load(task)
    began = clock.thread_time()
    sim = simulation_of(task, refuse_unusual)
    made = clock.thread_time()
    sim.run(collisions_per_particle=task["equilibration"], progress=look)
    count = int(task["blocks"])
    duration = stretches.time_for(sim, 0.5 * sim.scene.n * task["collisions_per_particle"]) / count
    ready = clock.thread_time()
    blocks = Blocks(sim)
    for _ in range(count):
        look()
        blocks.go_on(duration, 1)
    done = clock.thread_time()
    seconds = {"setup": made - began, "equilibration": ready - made, "measurement": done - ready}
    return {**of_scene(sim.scene), **blocks.result(), "timings": {"cpu_seconds": seconds}}


def load(task: Task) -> None:
    """Compile or load the code of a task, once in a process, before any time is measured."""
    once(json.dumps(task["scene"], sort_keys=True), lambda: _brief({**task, "replica": REPLICA}))


def _brief(task: Task) -> None:
    """Run a task for a short time."""
    sim = simulation_of(task, refuse_unusual)
    sim.run(collisions=FIRST)
    Blocks(sim).go_on(stretches.time_for(sim, 1.0), 1)


def once(kind: str, do: Callable[[], object]) -> None:
    """Call ``do``, unless it was called for this kind in this process."""
    if kind not in _DONE:
        do()
        _DONE.add(kind)


def refuse_unusual(scene: Scene) -> None:
    """Raise InputError unless spheres move freely and contacts are elastic."""
    if not all(is_usual(scene, kind) for kind in ("motion", "impact")):
        raise InputError("A plan is made for elastic spheres; remove motion and impact.")


def of_scene(scene: Scene) -> dict[str, Any]:
    """Return the facts about a scene that the analysis needs, as plain values."""
    counts = [scene.n] if scene.species is None else np.bincount(scene.species).tolist()
    return {
        "n": scene.n,
        "dimension": scene.dimension,
        "box": list(scene.box),
        "packing_fraction": scene.packing_fraction,
        "counts": [int(c) for c in counts],
    }


class Blocks:
    """Blocks of a run of spheres in a periodic box, and the mean virial of a collision by pair of species."""

    def __init__(self, sim: Simulation):
        self.sim = sim
        self.durations: list[float] = []
        self.virials: list[float] = []
        self.counted: list[float] = []
        self.collisions: list[int] = []
        self._carried = carried(sim)
        self._before = self._count()

    def _count(self) -> np.ndarray:
        """Return the collisions of each pair of species so far."""
        if self.sim.scene.species is None:
            return np.array([[self.sim.collisions]])
        return np.triu(self.sim.collisions_by_species)

    def go_on(self, duration: float, count: int) -> None:
        """Run on for ``count`` blocks of equal time."""
        for block in stretches.blocks(self.sim, duration, count):
            now = self._count()
            self.durations.append(block.duration)
            self.virials.append(block.virial)
            self.collisions.append(block.collisions)
            self.counted.append(float(np.sum((now - self._before) * self._carried)))
            self._before = now

    def result(self) -> dict[str, Any]:
        """Return Z of every block by both routes, as plain values."""
        drive: Any = self.sim.scene.drive
        kT = self.sim.kT if drive is None else drive.kT  # which fluctuates under a thermostat
        scale = self.sim.scene.dimension * self.sim.scene.n * kT * np.array(self.durations)
        by_rate = None if drive is not None else (1.0 + np.array(self.counted) / scale).tolist()
        return {
            "by_virial": (1.0 + np.array(self.virials) / scale).tolist(),
            "by_rate": by_rate,
            "collisions": int(sum(self.collisions)),
        }


def carried(sim: Simulation) -> np.ndarray:
    """Return the mean virial of a collision for every pair of species, (K, K) [mass length^2 / time].

    It is ``sigma_ij sqrt(2 pi mu_ij kT) / c_D`` at constant energy, exact for every N: velocities of two
    spheres in contact are those of any two, weighted with the speed of approach (Chapman and Cowling, sec.
    5.21; c_D is :func:`carom.theory.speed_factor`). Not so on a line, where collisions only exchange the
    initial velocities.
    """
    scene = sim.scene
    if scene.species is None:
        diameters, masses = np.array([scene.diameter]), np.array([scene.mass])
    else:
        at = [int(np.flatnonzero(scene.species == k)[0]) if np.any(scene.species == k) else 0
              for k in range(species_count(scene))]  # fmt: skip
        diameters, masses = scene.diameters[at], scene.masses[at]
    contact = 0.5 * (diameters[:, None] + diameters)
    reduced = masses[:, None] * masses / (masses[:, None] + masses)
    slowing = theory.speed_factor(scene.dimension * (scene.n - 1))
    return contact * np.sqrt(2.0 * math.pi * reduced * sim.kT) / slowing


class Spread(NamedTuple):
    """Z of this N by one of :data:`ESTIMATORS`."""

    estimator: str
    z: Estimate


def estimates(by_virial: ArrayLike, by_rate: ArrayLike | None, dimension: int) -> list[Spread]:
    """Return Z by every estimator, the one with the smallest error first.

    Blocks should be long, because the noise of short ones hides small slow changes. Wells have no estimate by
    the number of collisions, None.
    """
    a = np.asarray(by_virial, np.float64)
    found = [Spread("virial", mean(a))]
    if dimension > 1 and by_rate is not None:
        b = np.asarray(by_rate, np.float64)
        found += [Spread("collision rate", mean(b)), Spread("both", together(a, b))]
    return sorted(found, key=lambda one: one.z.error)


def together(a: np.ndarray, b: np.ndarray) -> Estimate:
    """Return the combination of two estimators with the smallest variance.

    See :func:`carom.observables.combined`. Here blocks may be correlated.
    """
    difference = a - b
    variance = float(np.var(difference, ddof=1))
    weight = float(np.cov(a, difference)[0, 1]) / variance if variance else 0.0
    found = mean(a - weight * difference)
    factor = math.sqrt((a.size - 1.0) / (a.size - 2.0))
    return Estimate(found.mean, found.error * factor, found.n_eff, found.tau, found.blocks)


def mean(values: np.ndarray) -> Estimate:
    """Return the mean of a series whose blocks are long, with its standard error.

    Blocks are paired as in :func:`carom.observables.blocking`, but no level has fewer than 64. A false alarm,
    one in twenty series with that function, could leave 16 blocks, whose error bar is off by a third: too
    much for a comparison with the promise.
    """
    y = values
    while (r := _lag_one(y)) > BEYOND / math.sqrt(y.size) and y.size // 2 >= FEWEST:
        pairs = y.size // 2
        y = 0.5 * (y[0 : 2 * pairs : 2] + y[1 : 2 * pairs : 2])
    square = float(np.var(y, ddof=1)) / y.size * (1.0 + r) / (1.0 - r)
    n_eff = float(np.var(values, ddof=1)) / square if square else math.inf
    tau = values.size / n_eff if n_eff else math.inf
    return Estimate(float(values.mean()), math.sqrt(square), n_eff, tau, y.size)


def _lag_one(y: np.ndarray) -> float:
    """Return the lag-one correlation, corrected for its leading bias (Marriott and Pope 1954)."""
    d = y - y.mean()
    square = float(d @ d)
    r = float(d[1:] @ d[:-1]) / square if square else 0.0
    return min(max(r + (1.0 + 4.0 * r) / y.size, -0.9), 0.9)
