"""Planning for Z, and for the pressure and the contact value, which follow from Z."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from carom.observables.analysis.equilibrium import doubts
from carom.observables.statistics import Estimate
from carom.studies.folder import Record, Task
from carom.studies.planner.choice import Costs
from carom.studies.planner.measures import (
    BLOCKS,
    CALLS,
    SURE,
    PressureRun,
    PressureTrial,
    estimates_of,
)
from carom.studies.planner.pilot import Method, Pilot
from carom.studies.planner.sizes import residual
from carom.studies.planner.system import System

SHORTEST = 16.0
"""Least length of a run over that of its equilibration. An equilibration is some four blocks long that are
independent of each other, and an error bar needs 64 such blocks (``observables.analysis.precision``)."""


class PressureMethod(Method):
    """How a ``quantity`` is measured: "Z", "P" or "g(contact)"."""

    first_size = 256  # for larger N the variance per collision hardly depends on N
    estimators: ClassVar = {
        "virial": "the virial: the momentum that collisions carry",
        "collision rate": "the number of collisions, which are cheaper to count than to weigh",
        "both": "virial and number of collisions, with the weights of least variance",
    }
    sampling = "no frames: every collision counts by itself"
    run, trial = PressureRun, PressureTrial

    def __init__(self, system: System, quantity: str):
        self.system, self.quantity, self.scale = system, quantity, system.scale(quantity)

    def tasks(self, n: int, replicas: int, equilibration: float, length: float, seed: int) -> list[Task]:
        """Return the runs of a plan."""
        spec = self.system.spec(
            n, replicas=replicas, equilibration=equilibration, collisions_per_particle=length, seed=seed,
            blocks=BLOCKS,
        )  # fmt: skip
        return [{**task, "study": "plan for the pressure"} for task in spec.tasks()]

    def found(self, record: Record) -> Pilot:
        """Return the results of a pilot."""
        result = record["result"]
        known = estimates_of(self.system.dimension, result)
        best = next(iter(known.values()))
        # The time of short and of long blocks is that of calls, and that of collisions.
        seconds, blocks = record["provenance"]["cpu_seconds"], len(result["by_virial"])
        part = result["short"] / result["collisions"]
        call = (seconds["calls"] - part * seconds["measuring"]) / (CALLS - part * blocks)
        call = min(max(call, 0.0), 0.5 * seconds["measuring"] / blocks)
        return Pilot.of(
            record,
            {name: each.scaled(self.scale.factor) for name, each in known.items()},
            result["collisions"],
            call * blocks,
            call_seconds=call * BLOCKS,
            value=self.scale.of(best.mean - self.system.shift(result["n"], result["counts"])),
            sure=best.degrees_of_freedom >= SURE,
        )

    def costs(self, found: Pilot, n: int) -> Costs:
        """Return the costs of n particles, from a pilot of any size."""
        return found.costs(
            n,
            variance=found.variances[found.estimator],
            bias=residual(self.system, n) * abs(self.scale.factor),
            shortest=max(SHORTEST * found.equilibration, float(BLOCKS)),
        )

    def reached(self, records: Sequence[Record], estimator: str) -> tuple[Estimate, float, list[str]]:
        """Return the quantity of the infinite system, its possible bias, and doubts about it."""
        results = [record["result"] for record in records]
        n, counts, factor = results[0]["n"], results[0]["counts"], self.scale.factor
        z = estimates_of(self.system.dimension, *results)[estimator]
        value = z.scaled(factor, offset=-(self.system.shift(n, counts) + self.scale.offset) * factor)
        said = [sentence for r in results for sentence in doubts("the pressure", z, r["by_virial"])]
        return value, residual(self.system, n) * abs(factor), list(dict.fromkeys(said))
