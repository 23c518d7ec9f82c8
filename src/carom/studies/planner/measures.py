"""One run of a plan, measured in blocks that give two estimators of Z."""

from __future__ import annotations

import functools
import json
import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from carom import theory
from carom.errors import InputError
from carom.observables.analysis.precision import least_variance
from carom.observables.statistics import Estimate, blocking, unwarned
from carom.scene.fields import is_usual
from carom.scene.scene import Scene
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.studies.fluid import Fluid
from carom.studies.folder import Task
from carom.studies.job import Look
from carom.studies.scenes import by_species, counts, simulation_of

BLOCKS = 512
"""Blocks of a run. Their error bar is known to 3 %; each costs a call of the engine."""

FIRST = 1000
"""Collisions after which all code of a run has been called."""

FEWEST = 64
"""Least blocks of an error bar: one of twenty from 16 blocks, by a false alarm, would be off by a third."""

REPLICA = 10**6
"""Replica number of a pilot. No run of a study has it, so that no collisions are counted twice."""

_DONE: set[str] = set()
"""Kinds of tasks whose code is compiled and loaded in this process."""


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
    return {
        "n": scene.n,
        "dimension": scene.dimension,
        "box": list(scene.box),
        "packing_fraction": scene.packing_fraction,
        "counts": counts(scene),
    }


class Blocks:
    """Blocks of a run of spheres in a periodic box, and the mean virial of a collision by pair of species."""

    def __init__(self, sim: Simulation, series: dict[str, list[Any]] | None = None):
        self.sim = sim
        self.series = {} if series is None else series  # what is known of earlier blocks
        names = "durations", "virials", "counted", "collisions"
        self.durations, self.virials, self.counted, self.collisions = (
            self.series.setdefault(name, []) for name in names
        )
        # By the temperature at the beginning, which changes by rounding.
        self._carried = np.array(self.series.setdefault("carried", carried(sim).tolist()))
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


@dataclass
class Timed(Fluid):
    """A run of a plan, which notes its CPU seconds by stage."""

    seconds: dict[str, float] = field(default_factory=dict)

    @staticmethod
    def warm_up(task: Task) -> None:
        """Compile or load the code of a task, before any time is measured."""
        raise NotImplementedError

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the run at its start."""
        cls.warm_up(task)
        began = clock.thread_time()
        found = super().begin(task)
        found.seconds["setup"] = clock.thread_time() - began
        return found

    def step(self, look: Look) -> bool:
        """Go on, and note how long it takes."""
        stage, began = self.stage.lower(), clock.thread_time()
        more = super().step(look)
        self.seconds[stage] = self.seconds.get(stage, 0.0) + clock.thread_time() - began
        return more

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        return {**super().result(), "timings": {"cpu_seconds": self.seconds}}


@dataclass
class Counted(Fluid):
    """One run of a plan, in blocks that give two estimators of Z."""

    series: dict[str, list[Any]] = field(default_factory=dict)

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the run at its start."""
        return cls(task, simulation_of(task, refuse_unusual))

    @functools.cached_property
    def sums(self) -> Blocks:
        """The blocks so far."""
        return Blocks(self.sim, self.series)

    @property
    def done(self) -> int:
        """Blocks measured so far."""
        return len(self.sums.durations)

    def block(self, look: Look) -> None:
        """Measure a block; what it counts is not kept in its middle."""
        self.sums.go_on(self.duration, 1)

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        return {**of_scene(self.sim.scene), **self.sums.result()}


@dataclass
class Planned(Timed, Counted):
    """One run of a plan for the pressure."""

    warm_up = staticmethod(load)


measure = Planned.measure


def carried(sim: Simulation) -> np.ndarray:
    """Return the mean virial of a collision for every pair of species, (K, K) [mass length^2 / time].

    It is ``sigma_ij sqrt(2 pi mu_ij kT) / c_D`` at constant energy, exact for every N: velocities of two
    spheres in contact are those of any two, weighted with the speed of approach (Chapman and Cowling, sec.
    5.21; c_D is :func:`carom.theory.speed_factor`). Not so on a line, where collisions only exchange the
    initial velocities.
    """
    scene = sim.scene
    diameters, masses = by_species(scene, scene.diameters), by_species(scene, scene.masses)
    contact = 0.5 * (diameters[:, None] + diameters)
    reduced = masses[:, None] * masses / (masses[:, None] + masses)
    slowing = theory.speed_factor(scene.dimension * (scene.n - 1))
    return contact * np.sqrt(2.0 * math.pi * reduced * sim.kT) / slowing


def estimates(by_virial: ArrayLike, by_rate: ArrayLike | None, dimension: int) -> dict[str, Estimate]:
    """Return Z of this N by virial, number of collisions (None of wells) and both, the best one first."""
    a = np.asarray(by_virial, np.float64)
    series = {"virial": a}
    if dimension > 1 and by_rate is not None:
        b = np.asarray(by_rate, np.float64)
        series |= {"collision rate": b, "both": least_variance(a, b)}
    with unwarned():  # the error bar shows where samples are few
        found = {name: blocking(values, least=FEWEST) for name, values in series.items()}
    return dict(sorted(found.items(), key=lambda one: one[1].error))
