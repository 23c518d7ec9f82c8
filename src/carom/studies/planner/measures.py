"""One run of a plan, measured block by block in a way that two estimators of Z follow from."""

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
from carom.observables.statistics import Estimate
from carom.scene.scene import Scene
from carom.simulation.simulation import Simulation
from carom.studies.executors import Stopped
from carom.studies.tasks import Record, Task
from carom.studies.worker import Stopwatch, refuse_other_version, simulation_of

BLOCKS = 512
"""Blocks of a run. Their error bar is known to 3 %; each costs a call of the engine."""

FIRST = 1000
"""Collisions after which everything that a run calls was called."""

REPLICA = 10**6
"""Number of the replica that a pilot is: none of a study's, so that its collisions are not counted twice."""

_DONE: set[str] = set()
"""What is compiled and loaded in this process."""

FEWEST, BEYOND = 64, 2.6
"""Blocks of the coarsest level, and standard errors beyond which a correlation is no chance (0.5 %)."""

ESTIMATORS = ("virial", "collision rate", "both")
"""From what Z follows: the momentum that collisions carry, their number, or the best combination."""


def measure(task: Task, stop: Callable[[], bool] = lambda: False) -> Record:
    """Equilibrate and measure one run.

    Parameters
    ----------
    task : dict
        As :meth:`carom.studies.planner.study.ZStudy.tasks` makes it.
    stop : callable, optional
        Asked now and then; if true, the run ends with :class:`carom.studies.executors.Stopped`.

    Returns
    -------
    dict
        ``task``; ``result``, whose bits depend on the task alone; and ``provenance``, with the CPU seconds
        of each stage.
    """
    refuse_other_version(task)
    load(task)
    watch, began = Stopwatch(), clock.thread_time()

    def look(_: object = None) -> None:
        if stop():
            raise Stopped

    sim = simulation_of(task, refuse_unusual)
    made = clock.thread_time()
    sim.run(collisions_per_particle=task["equilibration"], progress=look)
    count = int(task["blocks"])
    duration = sim.time_for(0.5 * sim.scene.n * task["collisions_per_particle"]) / count
    ready = clock.thread_time()
    blocks = Blocks(sim)
    for _ in range(count):
        look()
        blocks.go_on(duration, 1)
    done = clock.thread_time()
    record = watch.record(task, {**of_scene(sim.scene), **blocks.result()}, sim)
    record["provenance"]["cpu_seconds"] = {
        "setup": made - began,
        "equilibration": ready - made,
        "measurement": done - ready,
    }
    return record


def load(task: Task) -> None:
    """Compile what a task calls, or load it: once in a process, before any time is taken."""
    once(json.dumps(task["scene"], sort_keys=True), lambda: _brief({**task, "replica": REPLICA}))


def _brief(task: Task) -> None:
    sim = simulation_of(task, refuse_unusual)
    sim.run(collisions=FIRST)
    Blocks(sim).go_on(sim.time_for(1.0), 1)


def once(kind: str, do: Callable[[], object]) -> None:
    """Do something, unless it was done for this kind in this process."""
    if kind not in _DONE:
        do()
        _DONE.add(kind)


def refuse_unusual(scene: Scene) -> None:
    """Raise InputError where what acts between spheres is not a collision of hard cores."""
    if not (scene.usual("interaction") and scene.usual("motion") and scene.usual("impact")):
        raise InputError("A plan is made for elastic hard cores; remove interaction, motion and impact.")


def of_scene(scene: Scene) -> dict[str, Any]:
    """Return what the analysis has to know of a scene, as plain values."""
    counts = [scene.n] if scene.species is None else np.bincount(scene.species).tolist()
    return {
        "n": scene.n,
        "dimension": scene.dimension,
        "box": list(scene.box),
        "packing_fraction": scene.packing_fraction,
        "counts": [int(c) for c in counts],
    }


class Blocks:
    """Blocks of a run, and what collisions of each pair of species must carry on the average.

    Parameters
    ----------
    sim : carom.Simulation
        Of spheres in a periodic box.
    """

    def __init__(self, sim: Simulation):
        self.sim = sim
        self.durations: list[float] = []
        self.virials: list[float] = []
        self.counted: list[float] = []
        self.collisions: list[int] = []
        self._carried = carried(sim)
        self._before = self._count()

    def _count(self) -> np.ndarray:
        if self.sim.scene.species is None:
            return np.array([[self.sim.collisions]])
        return np.triu(self.sim.collisions_by_species)

    def go_on(self, duration: float, count: int) -> None:
        """Run on for ``count`` blocks of equal time."""
        for block in self.sim.blocks(duration, count):
            now = self._count()
            self.durations.append(block.duration)
            self.virials.append(block.virial)
            self.collisions.append(block.collisions)
            self.counted.append(float(np.sum((now - self._before) * self._carried)))
            self._before = now

    def result(self) -> dict[str, Any]:
        """Return Z of every block by both routes, as plain values."""
        scale = self.sim.scene.dimension * self.sim.scene.n * self.sim.kT * np.array(self.durations)
        return {
            "by_virial": (1.0 + np.array(self.virials) / scale).tolist(),
            "by_rate": (1.0 + np.array(self.counted) / scale).tolist(),
            "collisions": int(sum(self.collisions)),
        }


def carried(sim: Simulation) -> np.ndarray:
    """Return the mean virial of a collision for every pair of species, (K, K) [mass length^2 / time].

    Notes
    -----
    ``sigma_ij sqrt(2 pi mu_ij kT) / c_D`` at constant energy, exact for every N: the velocities of two that
    touch are those of any two, weighted with the speed at which they meet (Chapman and Cowling, sec. 5.21;
    c_D is :func:`carom.theory.speed_factor`). On a line collisions only exchange the velocities of the start,
    and their number depends on those.
    """
    scene = sim.scene
    if scene.species is None:
        diameters, masses = np.array([scene.diameter]), np.array([scene.mass])
    else:
        at = [int(np.flatnonzero(scene.species == k)[0]) if np.any(scene.species == k) else 0
              for k in range(scene.species_count)]  # fmt: skip
        diameters, masses = scene.diameters[at], scene.masses[at]
    contact = 0.5 * (diameters[:, None] + diameters)
    reduced = masses[:, None] * masses / (masses[:, None] + masses)
    slowing = theory.speed_factor(scene.dimension * (scene.n - 1))
    return contact * np.sqrt(2.0 * math.pi * reduced * sim.kT) / slowing


class Spread(NamedTuple):
    """Z by one estimator.

    Attributes
    ----------
    estimator : str
        One of :data:`ESTIMATORS`.
    z : Estimate
        Of this N.
    """

    estimator: str
    z: Estimate


def estimates(by_virial: ArrayLike, by_rate: ArrayLike, dimension: int) -> list[Spread]:
    """Return Z by every estimator there is, the one with the smallest error first.

    Blocks should be long: slow changes of small size hide in the noise of short ones.
    """
    a, b = np.asarray(by_virial, np.float64), np.asarray(by_rate, np.float64)
    found = [Spread("virial", mean(a))]
    if dimension > 1:
        found += [Spread("collision rate", mean(b)), Spread("both", together(a, b))]
    return sorted(found, key=lambda one: one.z.error)


def together(a: np.ndarray, b: np.ndarray) -> Estimate:
    """Return the combination of two estimators with the smallest variance; see
    :func:`carom.observables.combined`. Here blocks may be correlated.
    """
    difference = a - b
    variance = float(np.var(difference, ddof=1))
    weight = float(np.cov(a, difference)[0, 1]) / variance if variance else 0.0
    found = mean(a - weight * difference)
    factor = math.sqrt((a.size - 1.0) / (a.size - 2.0))
    return Estimate(found.mean, found.error * factor, found.n_eff, found.tau, found.blocks)


def mean(values: np.ndarray) -> Estimate:
    """Return the mean of a series whose blocks are long, with its standard error.

    Notes
    -----
    Blocks are paired until neighbours look uncorrelated, and what is left of their correlation is corrected
    for, as :func:`carom.observables.blocking` does. But no level has less than 64 blocks. A false alarm, of
    which there blocking has one in twenty series, then costs little: an error bar from 16 blocks is off by a
    third, and no promise could be compared with it.
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
    """Return the lag-one correlation, freed of its leading bias (Marriott and Pope 1954)."""
    d = y - y.mean()
    square = float(d @ d)
    r = float(d[1:] @ d[:-1]) / square if square else 0.0
    return min(max(r + (1.0 + 4.0 * r) / y.size, -0.9), 0.9)
