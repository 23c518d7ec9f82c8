"""A fluid as a job: it comes to equilibrium, and is then measured in blocks, as long as it takes."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Self

import numpy as np

from carom import checks
from carom.block import Block
from carom.observables.analysis.precision import Aim
from carom.observables.statistics import Estimate
from carom.simulation.measuring import stretches
from carom.simulation.measuring.equilibration import Equilibration, StructuralRelaxation, exchanges
from carom.simulation.measuring.equipartition import Thermometer
from carom.studies.folder import Task
from carom.studies.job import Job, Look
from carom.studies.scenes import simulation_of


@dataclass
class Fluid(Job):
    """A scene that is measured in equilibrium; a subclass says what is measured, and for how long."""

    rounds: list[Any] = field(default_factory=list)
    """Beginnings of rounds that bring pairs on steps to a temperature (``measuring.equilibration``)."""
    equilibrated: Sequence[float] | None = None  # collisions and time of the equilibration, once it is over
    wanted: int = 0  # blocks, by present knowledge
    start: str = "0"  # instant at which the present block begins, exact
    duration: float = 0.0  # of a block [time]
    marks: list[Block] = field(default_factory=list)  # sums at the beginning of every block
    temperatures: list[Any] = field(default_factory=list)  # of species at the end of every block
    there: np.ndarray | None = None  # unwrapped positions at the first mark, where they can be followed

    def __post_init__(self) -> None:
        self.marks = [stretches.recalled(each) for each in self.marks]

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the job at its start."""
        return cls(task, simulation_of(task))

    @functools.cached_property
    def thermometer(self) -> Thermometer:
        """The temperatures of species."""
        found = Thermometer(self.sim._state)
        found.series = self.temperatures
        return found

    @property
    def relaxation(self) -> StructuralRelaxation:
        """How far the particles are from where they were at the first mark."""
        return StructuralRelaxation(self.sim._state, self.there)

    @property
    def stage(self) -> str:
        """What is done now."""
        return "Equilibrating" if self.equilibrated is None else "Measuring"

    @property
    def fraction(self) -> float:
        """Finished fraction of the stage."""
        if self.equilibrated is None:
            return float(self.sim.collisions / max(self.target, 1))
        part = (self.sim.time - float(Fraction(self.start))) / self.duration if self.marks else 0.0
        return (self.done + part) / max(self.wanted, 1)

    @property
    def target(self) -> int:
        """Collisions of the equilibration."""
        return checks.collisions_of(self.task["equilibration"], self.sim.n)

    @property
    def kT(self) -> float | None:
        """The temperature to which pairs on steps are brought."""
        return float(self.task["scene"].get("kT", 1.0))

    def step(self, look: Look) -> bool:
        """Equilibrate, or measure a block, or find out how many it takes."""
        if self.equilibrated is None:
            self.equilibrate(look)
            self.equilibrated = self.sim.collisions, self.sim.time
            self.prepare()
        elif self.done < self.wanted:
            self.block(look)
        else:
            self.wanted = self.length()
            return self.wanted > self.done
        return True

    def equilibrate(self, look: Look) -> None:
        """Run to the end of the equilibration; pairs on steps are brought to the temperature."""
        if self.kT is not None and self.sim.scene.velocities is None and exchanges(self.sim):
            rounds = Equilibration(self.sim, self.kT, self.target, self.rounds)
            self.rounds = rounds.begun
            rounds.run(look)
        elif (left := self.target - self.sim.collisions) > 0:
            self.sim.run(collisions=left, progress=look)

    # What a subclass says.

    def prepare(self) -> None:
        """Begin to measure, in equilibrium."""
        self.wanted = self.task["blocks"]
        length = 0.5 * self.sim.n * self.task["collisions_per_particle"]
        self.cut(stretches.time_for(self.sim, length) / self.wanted)
        self.there = self.relaxation.start

    def block(self, look: Look) -> None:
        """Measure a block."""
        self.run_block(look)
        self.thermometer.look()

    @property
    def done(self) -> int:
        """Blocks measured so far."""
        return len(self.marks) - 1

    def length(self) -> int:
        """Return how many blocks it takes, when all that were wanted are measured."""
        if (aim := self.aim) is None:
            return self.done
        found = self.error_bar()
        return self.done if aim.reached(found) else aim.next_look(self.done, found)

    @property
    def aim(self) -> Aim | None:
        """The condition for a stretch to be long enough; None for a length that is given."""
        return None

    def error_bar(self) -> Estimate:
        """Return what is to be known well enough."""
        raise NotImplementedError

    # Blocks of equal time.

    def cut(self, duration: float) -> None:
        """Begin a stretch of blocks of a ``duration`` at the present."""
        self.duration, self.marks = duration, []
        self._mark()

    def run_block(self, look: Look) -> None:
        """Run to the end of the next block."""
        stretches.run_to(self.sim, Fraction(self.start) + Fraction(self.duration), look)
        self._mark()

    def _mark(self) -> None:
        self.start = str(self.sim._state.clock.instant)
        self.marks.append(self.mark())

    def mark(self) -> Block:
        """Return the sums so far."""
        return stretches.mark(self.sim)

    def blocks(self) -> list[Block]:
        """Return the sums over each block so far."""
        return [stretches.between(self.sim, *pair, self.duration) for pair in itertools.pairwise(self.marks)]
