"""One task of a study: a plain function that equilibrates and measures a scene, for workers anywhere."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.block import Block
from carom.observables import Estimate, Pressure
from carom.observables.analysis.drift import moved as moved_from
from carom.observables.analysis.precision import lengthen
from carom.simulation.measuring import stretches
from carom.simulation.measuring.equilibration import StructuralRelaxation
from carom.simulation.measuring.equipartition import Thermometer
from carom.studies.eos.order import ORDERS
from carom.studies.folder import Task
from carom.studies.phase import finite
from carom.studies.scenes import equilibrate, simulation_of
from carom.studies.study import Look

MOST = 16
"""Largest length of a run on its way to the requested error, over the planned length."""

GROWTH = 2.0
"""Largest factor by which a run is lengthened before its error bar is computed again."""

ROOM = 1.05
"""Factor by which a run is longer than its error bar demands, as the error bar is known to some 5 % only."""


def measure(task: Task, look: Look) -> dict[str, Any]:
    """Equilibrate and measure the run of a ``task`` until its error is reached; ``look`` may end it."""
    sim = simulation_of(task)
    scene = sim.scene
    began_at = sim.frame().unwrapped
    equilibrate(sim, task, look)
    equilibration = sim.time
    moved = moved_from(began_at, sim.frame())
    order, orders = ORDERS.get(scene.dimension) if task["frames"] else None, list[float]()
    every = task["blocks"] // task["frames"] if task["frames"] else 0
    request = Pressure()
    duration = stretches.time_for(sim, 0.5 * scene.n * task["collisions_per_particle"]) / task["blocks"]
    blocks: list[Block] = []
    thermometer, relaxation = Thermometer(sim._state), StructuralRelaxation(sim._state)

    def extend(wanted: int) -> int:
        for block in stretches.blocks(sim, duration, wanted - len(blocks)):
            look()
            blocks.append(block)
            thermometer.look()
            if order is not None and len(blocks) % every == 0:
                orders.append(order[1](sim.frame()))
        return wanted

    def error_bar() -> Estimate:
        return stretches.estimate(sim, request, blocks).Z

    lengthen(Planned(task["relative_error"], task["blocks"]), task["blocks"], extend, error_bar)
    estimate = stretches.estimate(sim, request, blocks)
    statistics = sim.statistics
    diameters, counts = np.unique(scene.diameters, return_counts=True)
    result = {
        "n": scene.n,
        "dimension": scene.dimension,
        "packing_fraction": scene.packing_fraction,
        "kT": estimate.kT,
        "Z": _plain(estimate.Z),
        "reduced_pressure": _plain(estimate.reduced_pressure),
        "collision_rate": _plain(estimate.collision_rate),
        "block_values": [float(value) for value in estimate.block_values],
        "time": math.fsum(estimate.block_durations),
        "equilibration_time": equilibration,
        "collisions": statistics.collisions,
        "moved": moved,
        "moved_at_end": moved_from(began_at, sim.frame()),
        "species_differ": bool(thermometer.differences()),
        "relaxed": not relaxation.doubts(),
        "species": [[float(s), int(c)] for s, c in zip(diameters, counts, strict=True)],
        "confined": bool(scene.walls or scene.obstacles),
        "worst_overlap": statistics.worst_overlap,
        "energy_drift": finite(statistics.energy_drift),  # unknown with a drive
        "advancement_fraction": statistics.advancement_fraction,
    }
    if order is not None:
        result["order"] = {"name": order[0], "values": orders}
    return {**result, "timings": {"engine_seconds": sim._state.seconds}}


@dataclass(frozen=True)
class Planned:
    """The planned length of a run, and more where correlated collisions, as near freezing, need it."""

    relative_error: float | None  # None keeps the planned length
    blocks: int  # planned length, as if collisions were independent

    def reached(self, z: Estimate) -> bool:
        """Return whether the error is small enough."""
        return self.relative_error is None or z.error <= self.relative_error * abs(z.mean)

    def next_look(self, length: int, z: Estimate) -> int:
        """Return the number of blocks after which the error should be small enough."""
        assert self.relative_error is not None
        factor = ROOM * (z.error / (self.relative_error * z.mean)) ** 2
        # With long correlations the error bar of a short run is uncertain, and here mostly too large.
        return min(math.ceil(min(factor, GROWTH) * length), MOST * self.blocks)


def _plain(estimate: Estimate) -> dict[str, float | None]:
    """Return an estimate as JSON values; numbers that are not finite are None."""
    values = {name: getattr(estimate, name) for name in ("mean", "error", "n_eff", "tau", "blocks")}
    return {name: value if math.isfinite(value) else None for name, value in values.items()}
