"""Runs and pilots of a plan as jobs: fluids whose CPU time is noted; blocks that give two estimators of Z."""

from __future__ import annotations

import json
import math
import time as clock
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from carom import checks, theory
from carom.block import Block
from carom.errors import InputError
from carom.observables.analysis.precision import least_variance
from carom.observables.statistics import Estimate, blocking, unwarned
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.studies.fluid import Fluid
from carom.studies.folder import Task
from carom.studies.job import Look
from carom.studies.scenes import by_species, counts

BLOCKS = 512
"""Blocks of a run. Their error bar is known to 3 %; each costs a call of the engine."""

FEWEST = 64
"""Least blocks of an error bar: one of twenty from 16 blocks, by a false alarm, would be off by a third."""

REPLICA = 10**6
"""Replica number of a pilot. No run of a study has it, so that no collisions are counted twice."""

BRIEF = {"equilibration": 1.0, "collisions_per_particle": 16.0, "blocks": 16, "apart": 0.0}
"""What differs in a run that only compiles and loads code; three of its steps call all of it."""

CALLS, SMALL = 128, 0.4
"""Short blocks of a pilot, and collisions per particle of each: with the long ones they tell how much of the
time of a run is that of calls, a quarter of a short one."""

MORE = 1.25
"""Factor by which an equilibration of a pilot is lengthened before it looks again."""

SURE = 80.0
"""Degrees of freedom of an error bar that suffices for a plan: it is known to ``sqrt(1 / 160)``, 8 %."""

COLLISIONS = 3000
"""Least collisions of a block of the pilot."""

PART = 16.0
"""Blocks of the pilot in the time of an equilibration: the noise of shorter ones hides small slow changes."""

_DONE: set[str] = set()
"""Kinds of tasks whose code is compiled and loaded in this process."""


@dataclass
class Timed(Fluid):
    """A run or a pilot of a plan, which notes its CPU seconds by stage."""

    seconds: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._since = clock.thread_time()

    @classmethod
    def measure(cls, task: Task, look: Look | None = None) -> dict[str, Any]:
        """Return the result of a task; code is compiled and loaded before any time is measured."""
        kind = f"{cls.__qualname__} {json.dumps(task['scene'], sort_keys=True)}"
        if kind not in _DONE:
            cls.load_code(task)
            _DONE.add(kind)
        return super().measure(task, look)

    @classmethod
    def load_code(cls, task: Task) -> None:
        """Compile or load the code of a task."""
        job = super().begin({**task, **BRIEF})
        for _ in range(3):
            job.step(Look())

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the run at its start."""
        began = clock.thread_time()
        found = super().begin(task)
        found.seconds["setup"] = clock.thread_time() - began
        return found

    def step(self, look: Look) -> bool:
        """Go on, and note how long it takes."""
        stage = self.stage
        more = super().step(look)
        self.spend(stage)
        return more

    def spend(self, stage: str) -> None:
        """Note the CPU time since the last call."""
        before, self._since = self._since, clock.thread_time()
        stage = stage.lower()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + self._since - before

    def notes(self) -> dict[str, Any]:
        """Return what is kept beside the simulation."""
        self.spend(self.stage)
        return super().notes()

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        return {**super().result(), "timings": {"cpu_seconds": self.seconds}}


@dataclass
class Trial(Timed):
    """A pilot: a run that finds how long a fluid takes to forget its start, in so many CPU ``seconds``."""

    needed: float = 0.0  # collisions per particle of the equilibration, by present knowledge

    @property
    def target(self) -> int:
        """Collisions of the equilibration."""
        return checks.collisions_of(self.needed, self.sim.n)

    @property
    def fraction(self) -> float:
        """Elapsed fraction of the time."""
        self.spend(self.stage)
        return math.fsum(self.seconds.values()) / float(self.task["seconds"])

    def equilibrate(self, look: Look) -> None:
        """Run until the slowest species has moved apart from its start as far as the task says."""
        self.needed, self.there = self.needed or self.task["equilibration"], self.relaxation.start
        super().equilibrate(look)
        apart = self.task["apart"]
        while apart and (moved := self.moved()) < apart:
            if self.fraction > 1.0:
                raise InputError(
                    f"The fluid does not come to equilibrium in a pilot of {self.task['seconds']:g} s. After "
                    f"{self.needed:.3g} collisions per particle its slowest species moved "
                    f"{math.sqrt(moved):.2g} mean spacings; {math.sqrt(apart):g} are needed to forget the "
                    f"start. At best it would take {self.needed * apart / max(moved, 1e-300):.2g}. Choose a "
                    "lower density, or a longer --pilot."
                )
            self.needed *= MORE
            super().equilibrate(look)
        if apart:
            self.needed = max(self.task["equilibration"], float(f"{self.needed * apart / moved:.3g}"))

    def moved(self) -> float:
        """Return the mean square displacement of the slowest species [squares of the mean spacing]."""
        frame = self.sim.frame()
        squares = np.sum((frame.unwrapped - self.there) ** 2, axis=1)
        spacing = (math.prod(frame.box) / frame.n) ** (2.0 / frame.dimension)
        kinds = np.zeros(frame.n, int) if frame.species is None else frame.species
        return min(float(squares[kinds == k].mean()) for k in np.unique(kinds)) / spacing

    def block(self, look: Look) -> None:
        """Measure a block, the last one if the time is over."""
        super().block(look)
        if self.done >= FEWEST and self.fraction > 1.0:
            self.wanted = self.done

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        return {**super().result(), "equilibration": self.needed}


@dataclass
class Counted(Fluid):
    """A run in blocks that give two estimators of Z: by the virial, and by the number of collisions."""

    pairs: list[Any] = field(default_factory=list)  # collisions of each pair of species, (K, K), at each mark

    def mark(self) -> Block:
        """Return the sums so far."""
        sim = self.sim
        one = sim.scene.species is None
        self.pairs.append([[sim.collisions]] if one else np.triu(sim.collisions_by_species).tolist())
        return super().mark()

    def block(self, look: Look) -> None:
        """Measure a block."""
        self.run_block(look)

    def values(self) -> dict[str, Any]:
        """Return Z of every block by both routes, by collisions where no thermostat changes kT."""
        sim, blocks, drive = self.sim, self.blocks(), self.sim.scene.drive
        kT = sim.kT if drive is None else drive.kT
        scale = sim.scene.dimension * sim.n * kT * np.array([block.duration for block in blocks])
        counted = np.sum(np.diff(np.array(self.pairs), axis=0) * carried(sim), axis=(1, 2))
        return {
            "by_virial": (1.0 + np.array([block.virial for block in blocks]) / scale).tolist(),
            "by_rate": (1.0 + counted / scale).tolist() if drive is None else None,
            "collisions": int(sum(block.collisions for block in blocks)),
        }

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        scene = self.sim.scene
        facts = {name: getattr(scene, name) for name in ("n", "dimension", "packing_fraction")}
        return {**facts, "box": list(scene.box), "counts": counts(scene), **self.values()}


@dataclass
class PressureRun(Timed, Counted):
    """One run of a plan for the pressure."""


@dataclass
class PressureTrial(Trial, Counted):
    """A pilot for the pressure, until its error bar is known."""

    short: int = 0  # collisions of the short blocks that tell what a call costs

    def prepare(self) -> None:
        """Begin to measure, in equilibrium."""
        self.spend(self.stage)
        before = self.sim.collisions
        self.cut(stretches.time_for(self.sim, SMALL * self.sim.n))
        for _ in range(CALLS):
            self.run_block(Look())
        self.short, self.pairs = self.sim.collisions - before, []
        self.spend("calls")
        length = max(0.5 * self.sim.n * self.needed / PART, float(COLLISIONS))
        self.wanted = BLOCKS
        self.cut(stretches.time_for(self.sim, length))

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        return {**super().result(), "short": self.short}

    def length(self) -> int:
        """Return how many blocks it takes, when all that were wanted are measured."""
        best = next(iter(estimates_of(self.sim.scene.dimension, self.values()).values()))
        over = best.degrees_of_freedom >= SURE or self.fraction > 1.0
        return self.done if over else 2 * self.done


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


def estimates_of(dimension: int, *results: dict[str, Any]) -> dict[str, Estimate]:
    """Return the estimates of Z (:func:`estimates`) from the values of runs."""
    virial, rate = ([each[name] for each in results] for name in ("by_virial", "by_rate"))
    return estimates(np.concatenate(virial), None if rate[0] is None else np.concatenate(rate), dimension)


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
