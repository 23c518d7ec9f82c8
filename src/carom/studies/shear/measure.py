"""One task of a study of sheared fluids: a flow in its balance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from carom.block import Block
from carom.observables.analysis.precision import Goal
from carom.observables.pressure_tensor import about_center
from carom.observables.statistics import Estimate, blocking
from carom.scene.fields import is_elastic, is_equal, is_usual
from carom.scene.scene import Scene
from carom.simulation.measuring import stretches
from carom.studies.fluid import Fluid
from carom.studies.folder import Task
from carom.studies.job import Look
from carom.studies.phase import finite
from carom.studies.transport.windows import mean_fluid

HEAT = 0.1
"""Part of kT by which the flow heats elastic particles, about, before their velocities are scaled. The
viscosity, which goes as the root of kT, then differs from that at the mean kT by 1e-4."""

HEAT_ON_STEPS = 0.02
"""The same on steps, which take up a part of the heat, and whose viscosity is not Enskog's. The mean kT is
within 1 % of the one asked for, even if the flow heats by nothing or by twice as much."""

LEAST_LOSS = 0.1
"""Part of the energy of the normal motion that a contact is thought to lose at least, for the first kT."""


@dataclass
class Flow(Fluid):
    """A flow that comes to its balance and is measured in blocks of equal time.

    Where the velocities are scaled, a block has several pieces, each of them a stretch of its own.
    """

    early: int = 0  # blocks of the equilibration so far
    parts: list[Block] = field(default_factory=list)  # pieces of the present block
    series: dict[str, list[float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.parts = [stretches.recalled(each) for each in self.parts]
        scene, task = self.sim.scene, self.task
        rate, kT = task["rate"], task["scene"]["kT"]
        if self._finds_balance:
            kT = balanced(scene, rate)
        fluid, collision_rate = mean_fluid(scene, kT)
        self.period = task["strains"] / rate / task["blocks"]
        self.settling = math.ceil(task["equilibration"] / collision_rate / self.period)
        self.pieces, self.coldest = 1, kT
        if task["rescale"]:
            power = fluid.shear_viscosity * rate**2 * scene.volume
            heat = self.period * power / (0.5 * scene.dimension * scene.n * kT)
            self.pieces = math.ceil(heat / (HEAT_ON_STEPS if self.sim._state.system.stepped else HEAT))
            self.coldest = kT / (1.0 + 0.5 * heat / self.pieces)  # so that the mean is kT

    @classmethod
    def begin(cls, task: Task) -> Self:
        """Return the flow at its start."""
        flow = super().begin(task)
        if flow._finds_balance:
            flow.sim.rescale(flow.coldest)
        return flow

    @property
    def _finds_balance(self) -> bool:
        """Whether contacts take up the heat of the flow."""
        return not self.task["rescale"] and self.sim.scene.drive is None

    @property
    def done(self) -> int:
        """Blocks measured so far."""
        return len(self.series.get("stress", ()))

    @property
    def fraction(self) -> float:
        """Finished fraction of the stage."""
        return self.early / max(self.settling, 1) if self.equilibrated is None else super().fraction

    def equilibrate(self, look: Look) -> None:
        """Run blocks that nobody looks at."""
        while self.early < self.settling:
            self._pieces(look)
            self.parts.clear()
            self.early += 1

    def prepare(self) -> None:
        """Begin to measure, in the balance."""
        self.wanted = self.task["blocks"]

    def block(self, look: Look) -> None:
        """Measure a block."""
        self._pieces(look)
        for name, value in means(self.sim.scene, self.parts, self.period).items():
            self.series.setdefault(name, []).append(value)
        self.parts.clear()

    def _pieces(self, look: Look) -> None:
        while len(self.parts) < self.pieces:
            if not self.marks:
                self.cut(self.period / self.pieces)
            self.run_block(look)
            self.parts += self.blocks()
            self.marks.clear()
            if self.task["rescale"]:
                self.sim.rescale(self.coldest)

    @property
    def aim(self) -> Goal | None:
        """The relative error of the stress, if one is asked for."""
        error = self.task["relative_error"]
        return None if error is None else Goal(min(error, 1.0))

    def error_bar(self) -> Estimate:
        """Return the stress so far."""
        return stress(self.series)

    def result(self) -> dict[str, Any]:
        """Return what a record holds."""
        scene, statistics = self.sim.scene, self.sim.statistics
        return {
            "n": scene.n,
            "dimension": scene.dimension,
            "packing_fraction": scene.packing_fraction,
            "diameter": scene.diameter,
            "mass": scene.mass,
            "simple": is_usual(scene, "interaction") and is_elastic(scene) and is_equal(scene),
            "duration": self.period,
            "series": self.series,
            "worst_overlap": statistics.worst_overlap,
            "energy_drift": finite(statistics.energy_drift),  # unknown with a drive
            "timings": {"engine_seconds": self.sim._state.seconds},
        }


def stress(series: dict[str, list[float]]) -> Estimate:
    """Return the shear stress ``-P_10`` [energy / length^d]."""
    return blocking(series["stress"])


def balanced(scene: Scene, rate: float) -> float:
    """Return kT at which contacts lose what the flow gives, by Enskog's theory [energy].

    The flow gives ``eta rate^2 V`` a time; a contact of restitution e loses ``(1 - e^2) kT`` in the mean. A
    run starts there: how the flow distorts the velocities makes the true one lower (Montanero et al., J.
    Fluid Mech. 389, 391 (1999)).
    """
    fluid, collision_rate = mean_fluid(scene, 1.0)
    loss = max(1.0 - getattr(scene.impact, "restitution", 1.0) ** 2, LEAST_LOSS)
    return float(2.0 * fluid.shear_viscosity * rate**2 * scene.volume / (scene.n * collision_rate * loss))


def means(scene: Scene, parts: Sequence[Any], duration: float) -> dict[str, float]:
    """Return the means over the ``parts`` of a block: collisions of one particle a time, kT and pressures."""
    fluxes = [part.momentum_flux for part in parts]
    whole = sum(each.carried * about_center(scene) + each.handed_over for each in fluxes)
    whole = whole / (scene.volume * duration)
    along = np.diag(whole)
    found = {
        "collision_rate": 2.0 * sum(part.collisions for part in parts) / (scene.n * duration),
        "kT": math.fsum(part.kT_time for part in parts) / duration,
        "stress": -float(whole[1, 0]),
        "pressure": float(along.mean()),
        "first": float(along[0] - along[1]),
    }
    return found if scene.dimension == 2 else {**found, "second": float(along[1] - along[2])}
