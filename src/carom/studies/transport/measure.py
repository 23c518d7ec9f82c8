"""One task of a transport study."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

from carom.errors import InputError
from carom.frame import Frame
from carom.models.interfaces.particles import species_count
from carom.observables.analysis.moments import HelfandCurrents, HelfandMoments, mean_squares
from carom.observables.dynamics import Dynamics
from carom.scene.fields import is_simple, is_usual
from carom.scene.scene import Scene
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.studies.fluid import Fluid
from carom.studies.folder import Task
from carom.studies.job import Look
from carom.studies.phase import finite
from carom.studies.scenes import by_species, counts, simulation_of
from carom.studies.transport import windows


@dataclass
class Currents(Fluid):
    """Helfand's moments and displacements of one run of a transport study."""

    samples: int = 0  # of the moments in a block
    found: list[dict[str, Any]] = field(default_factory=list)  # of each block

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the job at its start."""
        return cls(task, simulation_of(task, _refuse_other_interactions, observers=[HelfandCurrents()]))

    @property
    def done(self) -> int:
        """Blocks measured so far."""
        return len(self.found)

    def prepare(self) -> None:
        """Begin to measure, in equilibrium."""
        task, every = self.task, self.task["every"]
        self.wanted = windows.blocks_within(task["collisions_per_particle"], task["blocks"])
        if self.sim._state.system.stepped:
            # Crossings of steps count as collisions, but carry little: the length is in free times of cores.
            duration = task["collisions_per_particle"] * windows.PER_FREE_TIME * every / self.wanted
        else:
            length = 0.5 * self.sim.n * task["collisions_per_particle"]
            duration = stretches.time_for(self.sim, length) / self.wanted
        self.samples = max(int(duration / every), windows.SHORTEST)

    def block(self, look: Look) -> None:
        """Measure a block; no file holds its samples, so that it is measured again after a kill."""
        self.found.append(_block(self.sim, self.task["every"], self.samples, look.glance))

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        sim, scene, statistics = self.sim, self.sim.scene, self.sim.statistics
        stepped = sim._state.system.stepped
        return {
            "n": scene.n,
            "dimension": scene.dimension,
            "box": list(scene.box),
            "packing_fraction": scene.packing_fraction,
            "kT": math.fsum(block["kT"] for block in self.found) / self.done if stepped else sim.kT,
            "U": sim.potential_energy / scene.n if stepped else 0.0,
            "masses": by_species(scene, scene.masses).tolist(),
            "diameters": by_species(scene, scene.diameters).tolist(),
            "counts": counts(scene),
            "simple": is_simple(scene),
            "every": self.task["every"],
            "samples": self.samples,
            "wave_time": windows.wave_time(scene, sim.kT),
            "blocks": self.found,
            "worst_overlap": statistics.worst_overlap,
            "energy_drift": finite(statistics.energy_drift),
            "timings": {"engine_seconds": sim._state.seconds},
        }


def _refuse_other_interactions(scene: Scene) -> None:
    if not is_usual(scene, "interaction") and not hasattr(scene.interaction, "steps"):
        raise InputError(
            "Transport is measured of hard cores and of steps; what another interaction adds to the currents "
            "is not known."
        )


def _block(sim: Simulation, every: float, count: int, look: Callable[[], object]) -> dict[str, Any]:
    """Run one block, and return its mean squares, displacements and collisions as plain values."""
    kinds = species_count(sim.scene) if sim.scene.species is not None else 0
    dynamics = [Dynamics(species=k if kinds else None) for k in range(max(kinds, 1))]

    def see(frame: Frame) -> None:
        look()
        for each in dynamics:
            each.add(frame)

    before = stretches.tally(sim)
    moments: HelfandMoments = sim.helfand(every=every, count=count, look=see, look_every=windows.FRAME)
    after = stretches.tally(sim)
    lags = [lag for lag in windows.LAGS if lag * windows.SHORTEST <= count]
    duration = after.duration - before.duration
    change = moments.pressure[-1] - moments.pressure[0]
    rate = float(f"{change / (every * (count - 1)):.6g}")  # near the mean, so that squares keep their digits
    found = mean_squares(moments, lags, rate)
    longest = every * count / windows.SHORTEST
    mean_kT = sim.kT
    if before.kT_time is not None and after.kT_time is not None:
        mean_kT = (after.kT_time - before.kT_time) / duration
    moved = []
    for each in dynamics:
        times, means = each.means()
        kept = times <= longest
        moved.append({"times": times[kept].tolist(), "means": means[kept].tolist()})
    return {
        "collisions": after.collisions - before.collisions,
        "virial": after.virial - before.virial,
        "duration": duration,
        "kT": mean_kT,
        "change": float(change),
        "rate": rate,
        "shear": found.shear.tolist(),
        "heat": found.heat.tolist(),
        "bulk": found.bulk.tolist(),
        "fluxes": found.fluxes.tolist(),
        "moved": moved,
    }
