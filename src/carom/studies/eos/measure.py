"""One task of a study of the equation of state."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from carom.frame import Frame
from carom.observables import Estimate, Pressure, PressureResult
from carom.observables.analysis.drift import moved as moved_from
from carom.simulation.measuring import stretches
from carom.studies.eos.order import ORDERS
from carom.studies.fluid import Fluid
from carom.studies.job import Look
from carom.studies.phase import finite

MOST = 16
"""Largest length of a run on its way to the requested error, over the planned length."""

GROWTH = 2.0
"""Largest factor by which a run is lengthened before its error bar is computed again."""

ROOM = 1.05
"""Factor by which a run is longer than its error bar demands, as the error bar is known to some 5 % only."""


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


@dataclass
class Point(Fluid):
    """Z of one run of a study of the equation of state, until its error is reached."""

    moved: float = 0.0  # median displacement in the equilibration [mean spacing]
    orders: list[float] = field(default_factory=list)  # order parameter, from time to time

    @property
    def aim(self) -> Planned:
        """The planned length, and more where it does not suffice."""
        return Planned(self.task["relative_error"], self.task["blocks"])

    @functools.cached_property
    def order(self) -> tuple[str, Callable[[Frame], float]] | None:
        """Name and value of the order parameter, near freezing."""
        return ORDERS.get(self.sim.scene.dimension) if self.task["frames"] else None

    def prepare(self) -> None:
        """Begin to measure, in equilibrium."""
        super().prepare()
        self.moved = moved_from(self.sim.scene.positions, self.sim.frame())

    def block(self, look: Look) -> None:
        """Measure a block, and perhaps the order at its end."""
        super().block(look)
        if self.order is not None and self.done % (self.task["blocks"] // self.task["frames"]) == 0:
            self.orders.append(self.order[1](self.sim.frame()))

    def error_bar(self) -> Estimate:
        """Return Z so far."""
        return self._pressure().Z

    def _pressure(self) -> PressureResult:
        found: PressureResult = stretches.estimate(self.sim, Pressure(), self.blocks())
        return found

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        scene, found, statistics = self.sim.scene, self._pressure(), self.sim.statistics
        diameters, counts = np.unique(scene.diameters, return_counts=True)
        result = {
            "n": scene.n,
            "dimension": scene.dimension,
            "packing_fraction": scene.packing_fraction,
            "kT": found.kT,
            "Z": _plain(found.Z),
            "reduced_pressure": _plain(found.reduced_pressure),
            "collision_rate": _plain(found.collision_rate),
            "block_values": [float(value) for value in found.block_values],
            "time": math.fsum(found.block_durations),
            "equilibration_time": self.equilibrated[1] if self.equilibrated else 0.0,
            "collisions": statistics.collisions,
            "moved": self.moved,
            "moved_at_end": moved_from(scene.positions, self.sim.frame()),
            "species_differ": bool(self.thermometer.differences()),
            "relaxed": not self.relaxation.doubts(),
            "species": [[float(s), int(c)] for s, c in zip(diameters, counts, strict=True)],
            "confined": bool(scene.walls or scene.obstacles),
            "worst_overlap": statistics.worst_overlap,
            "energy_drift": finite(statistics.energy_drift),  # unknown with a drive
            "advancement_fraction": statistics.advancement_fraction,
        }
        if self.order is not None:
            result["order"] = {"name": self.order[0], "values": self.orders}
        return {**result, "timings": {"engine_seconds": self.sim._state.seconds}}


def _plain(estimate: Estimate) -> dict[str, float | None]:
    """Return an estimate as JSON values; numbers that are not finite are None."""
    values = {name: getattr(estimate, name) for name in ("mean", "error", "n_eff", "tau", "blocks")}
    return {name: value if math.isfinite(value) else None for name, value in values.items()}
