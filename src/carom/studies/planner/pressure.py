"""Planning for Z, and for the pressure and the contact value, which follow from Z."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from carom.observables.analysis.equilibrium import doubts
from carom.observables.statistics import Estimate
from carom.studies.folder import Record, Task
from carom.studies.planner import pilot as trial
from carom.studies.planner.choice import Costs, slowed
from carom.studies.planner.measures import BLOCKS, estimates, measure
from carom.studies.planner.pilot import SIZE, Pilot
from carom.studies.planner.sizes import residual
from carom.studies.planner.system import System

SHORTEST = 16.0
"""Least length of a run over that of its equilibration. An equilibration is some four blocks long that are
independent of each other, and an error bar needs 64 such blocks (``observables.analysis.precision``)."""

ESTIMATORS = {
    "virial": "the virial: the momentum that collisions carry",
    "collision rate": "the number of collisions, which are cheaper to count than to weigh",
    "both": "virial and number of collisions, with the weights of least variance",
}


class PressureMethod:
    """How a ``quantity`` is measured: "Z", "P" or "g(contact)"."""

    measure = staticmethod(measure)
    first_size = SIZE
    estimators = tuple(ESTIMATORS)
    sampling = "no frames: every collision counts by itself"

    def __init__(self, system: System, quantity: str):
        self.system, self.quantity, self.scale = system, quantity, system.scale(quantity)

    def pilot(
        self,
        n: int,
        *,
        seed: int,
        seconds: float,
        equilibration: float | None,
        look: Callable[[float], object],
    ) -> Pilot:
        """Run n particles for some seconds."""
        return trial.pilot(self.system, n, seed=seed, seconds=seconds, equilibration=equilibration, look=look)

    def value(self, found: Pilot) -> float:
        """Return the quantity of the infinite system, to the accuracy of a pilot."""
        return self.scale.of(found.z - self.system.shift(found.n, found.counts))

    def costs(self, found: Pilot, n: int) -> Costs:
        """Return the costs of n particles, from a pilot of any size."""
        factor = abs(self.scale.factor)
        return Costs(
            n=n,
            variance=found.variances[found.estimator] * factor**2,
            bias=residual(self.system, n) * factor,
            collisions_per_second=slowed(found.collisions_per_second, found.n, n),
            setup_seconds=found.setup_seconds * n / found.n,
            overhead_seconds=found.block_seconds * BLOCKS,
            equilibration=found.equilibration,
            shortest=max(SHORTEST * found.equilibration, float(BLOCKS)),
        )

    def tasks(self, n: int, replicas: int, equilibration: float, length: float, seed: int) -> list[Task]:
        """Return the runs of a plan."""
        spec = self.system.spec(
            n, replicas=replicas, equilibration=equilibration, collisions_per_particle=length, seed=seed,
            blocks=BLOCKS,
        )  # fmt: skip
        return [{**task, "study": "plan for the pressure"} for task in spec.tasks()]

    def reached(self, records: Sequence[Record], estimator: str) -> tuple[Estimate, float, list[str]]:
        """Return the quantity of the infinite system, its possible bias, and doubts about it."""
        results = [record["result"] for record in records]
        first = results[0]
        virial, rate = (
            None if first[name] is None else np.concatenate([np.asarray(r[name]) for r in results])
            for name in ("by_virial", "by_rate")
        )
        assert virial is not None
        z = estimates(virial, rate, first["dimension"])[estimator]
        shift = self.system.shift(first["n"], first["counts"])
        factor = self.scale.factor
        value = z.scaled(factor, offset=-(shift + self.scale.offset) * factor)
        said = [
            sentence
            for r in results
            for sentence in doubts("the pressure", z, r["by_virial"])
        ]  # fmt: skip
        return value, residual(self.system, first["n"]) * abs(factor), list(dict.fromkeys(said))

    def route(self, estimator: str) -> str:
        """Return how the quantity is measured, in words."""
        return ESTIMATORS[estimator]
