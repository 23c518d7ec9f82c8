"""A pilot of some seconds: the speed of a run, the variance per collision, and the equilibration."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from carom.errors import InputError
from carom.frame import Frame
from carom.observables.statistics import unwarned
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.studies.planner.measures import BLOCKS, REPLICA, Blocks, estimates, load, of_scene, refuse_unusual
from carom.studies.planner.system import System
from carom.studies.scenes import simulation_of

SIZE = 256
"""Spheres of the first pilot: for larger N the variance per collision hardly depends on N."""

FEWEST = 50.0
"""Least collisions per particle of an equilibration. Velocities relax in a few, waves in some ten."""

OF_CRYSTAL = 200.0
"""Collisions per particle after which the phonons of a crystal are in equilibrium."""

APART = 4.0
"""Mean square displacement of the slowest species at the end of the equilibration of a fluid [squared mean
spacing]. Each particle has then left its cage and its neighbors several times."""

SURE = 80.0
"""Degrees of freedom of an error bar that suffices for a plan: it is known to ``sqrt(1 / 160)``, 8 %."""

COLLISIONS = 3000
"""Least collisions of a block of the pilot."""

PART = 16.0
"""Blocks of the pilot in the time of an equilibration: the noise of shorter ones hides small slow changes."""

SMALL = 0.8
"""Collisions per particle of short blocks, about those of the shortest runs. Short and long blocks together
give the time of the call for a block."""


@dataclass(frozen=True)
class Found:
    """Results of every pilot."""

    n: int
    variances: dict[str, float]
    """By estimator: squared error of the measured quantity times the number of pair collisions."""
    collisions_per_second: float  # per CPU second, in the measurement
    setup_seconds: float  # CPU time to make the scene
    equilibration: float  # collisions per particle
    sure: bool  # whether the error bars had enough blocks to hold for a long run
    seconds: float  # CPU time of the pilot

    @property
    def estimator(self) -> str:
        """The estimator with the smallest variance."""
        return min(self.variances, key=self.variances.__getitem__)


@dataclass(frozen=True)
class Pilot(Found):
    """Results of a pilot for Z; its collision rate excludes the calls for blocks."""

    counts: tuple[int, ...]  # particles of each species
    z: float  # Z of this n, to the accuracy of a pilot
    block_seconds: float  # CPU time of a call for a block


def pilot(
    system: System,
    n: int,
    *,
    seed: int,
    seconds: float,
    equilibration: float | None = None,
    look: Callable[[float], object] = lambda _: None,
) -> Pilot:
    """Run n particles for so many CPU ``seconds``, without compilation.

    ``equilibration`` is in collisions per particle, where it is known; ``look`` is called with the elapsed
    fraction of the time.
    """
    with unwarned():
        load(system.spec(n, seed=seed).tasks()[0])
        watch = Watch(seconds, look)
        sim = begin(system, n, seed)
        setup = watch.passed
        if equilibration is None:
            equilibration = equilibrate(sim, system, watch)
        else:
            sim.run(collisions_per_particle=equilibration, progress=watch.look)
        few, short = _calls(sim)
        blocks, spent = _measured(sim, watch, equilibration)
    values = blocks.result()
    found = estimates(values["by_virial"], values["by_rate"], system.dimension)
    best = next(iter(found.values()))
    collisions = values["collisions"]
    rate = (collisions / len(blocks.durations) - few) / (spent / len(blocks.durations) - short)
    rate = rate if rate > 0.0 else collisions / spent
    return Pilot(
        n=sim.scene.n,
        counts=tuple(of_scene(sim.scene)["counts"]),
        z=best.mean,
        variances={name: z.error**2 * collisions for name, z in found.items()},
        collisions_per_second=rate,
        block_seconds=max(short - few / rate, 0.0),
        setup_seconds=setup,
        equilibration=equilibration,
        sure=best.degrees_of_freedom >= SURE,
        seconds=watch.passed,
    )


class Watch:
    """Measures the CPU time of this thread, and reports the fraction of the available ``seconds``."""

    def __init__(self, seconds: float, tell: Callable[[float], object]):
        self.seconds, self._tell, self._began = seconds, tell, clock.thread_time()

    @property
    def passed(self) -> float:
        """CPU time so far [s]."""
        return clock.thread_time() - self._began

    @property
    def over(self) -> bool:
        """Whether the available time is used up."""
        return self.passed > self.seconds

    def look(self, _: object = None) -> None:
        """Report the elapsed fraction of the time."""
        self._tell(min(self.passed / self.seconds, 1.0))


def begin(system: System, n: int, seed: int) -> Simulation:
    """Return n particles in motion, from a start that no run of a plan has."""
    task = {**system.spec(n, seed=seed).tasks()[0], "replica": REPLICA}
    return simulation_of(task, refuse_unusual)


def _calls(sim: Simulation) -> tuple[float, float]:
    """Return the mean collisions and the mean CPU time [s] of a short block."""
    duration, blocks, count = stretches.time_for(sim, 0.5 * SMALL * sim.scene.n), Blocks(sim), BLOCKS // 4
    began = clock.thread_time()
    for _ in range(count):
        blocks.go_on(duration, 1)
    return blocks.result()["collisions"] / count, (clock.thread_time() - began) / count


def _measured(sim: Simulation, watch: Watch, equilibration: float) -> tuple[Blocks, float]:
    """Return blocks and CPU time, measured until the error bar suffices or the time is over."""
    duration = stretches.time_for(sim, max(0.5 * sim.scene.n * equilibration / PART, float(COLLISIONS)))
    blocks, wanted = Blocks(sim), BLOCKS
    began = clock.thread_time()
    while True:
        for _ in range(wanted - len(blocks.durations)):
            blocks.go_on(duration, 1)
            watch.look()
            if watch.over and len(blocks.durations) >= 64:
                return blocks, clock.thread_time() - began
        values = blocks.result()
        found = estimates(values["by_virial"], values["by_rate"], sim.scene.dimension)
        if next(iter(found.values())).degrees_of_freedom >= SURE:
            return blocks, clock.thread_time() - began
        wanted *= 2


def equilibrate(sim: Simulation, system: System, watch: Watch) -> float:
    """Run until a fluid has forgotten its start; return the collisions per particle that are needed."""
    if system.crystal:
        sim.run(collisions_per_particle=OF_CRYSTAL, progress=watch.look)
        return OF_CRYSTAL
    start, n = sim.frame().unwrapped, sim.scene.n
    sim.run(collisions_per_particle=FEWEST, progress=watch.look)
    while sim.scene.dimension > 1:
        moved = slowest(start, sim.frame())
        done = 2.0 * sim.collisions / n
        if moved >= APART:
            return max(FEWEST, float(f"{done * APART / moved:.3g}"))
        if watch.over:
            name = "its slowest species" if system.mixture else "its particles"
            raise InputError(
                f"The {system} does not come to equilibrium in a pilot of {watch.seconds:g} s. After "
                f"{done:.3g} collisions per particle {name} moved {math.sqrt(moved):.2g} mean spacings; "
                f"{math.sqrt(APART):g} are needed to forget the start. At best it would take "
                f"{done * APART / max(moved, 1e-300):.2g}. Choose a lower density, or a longer --pilot."
            )
        sim.run(collisions_per_particle=0.25 * done, progress=watch.look)
    return FEWEST


def slowest(start: np.ndarray, frame: Frame) -> float:
    """Return the mean square displacement of the slowest species [squares of the mean spacing]."""
    squares = np.sum((frame.unwrapped - start) ** 2, axis=1)
    spacing = (math.prod(frame.box) / frame.n) ** (2.0 / frame.dimension)
    kinds = np.zeros(frame.n, int) if frame.species is None else frame.species
    return min(float(squares[kinds == k].mean()) for k in np.unique(kinds)) / spacing
