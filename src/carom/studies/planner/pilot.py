"""Pilots, and how they and the runs of a plan are carried out: as tasks of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from carom.errors import InputError
from carom.observables.statistics import Estimate
from carom.spec import Spec
from carom.studies.folder import Record, Task
from carom.studies.grid_study import GridStudy
from carom.studies.planner.choice import Costs, slowed
from carom.studies.planner.measures import REPLICA, Timed, Trial
from carom.studies.planner.system import System

FEWEST = 50.0
"""Least collisions per particle of an equilibration. Velocities relax in a few, waves in some ten."""

OF_CRYSTAL = 200.0
"""Collisions per particle after which the phonons of a crystal are in equilibrium."""

APART = 4.0
"""Mean square displacement of the slowest species at the end of the equilibration of a fluid [squared mean
spacing]. Each particle has then left its cage and its neighbors several times."""


@dataclass(frozen=True)
class Pilot:
    """Results of a pilot."""

    n: int
    value: float  # the quantity of infinitely many, to the accuracy of a pilot
    variances: Mapping[str, float]
    """By estimator: squared error of the quantity times the number of pair collisions."""
    collisions_per_second: float  # per CPU second, in the measurement
    setup_seconds: float  # CPU time to make the scene
    call_seconds: float  # CPU time of the calls for the blocks of a run
    equilibration: float  # collisions per particle
    sure: bool  # whether the error bars had enough blocks to hold for a long run
    seconds: float  # CPU time of the pilot

    @classmethod
    def of(
        cls, record: Record, found: Mapping[str, Estimate], collisions: int, calls: float = 0.0, **more: Any
    ) -> Self:
        """Return the results in a record, with what was ``found`` by each estimator in so many collisions."""
        seconds = record["provenance"]["cpu_seconds"]
        return cls(
            n=record["result"]["n"],
            variances={name: each.error**2 * collisions for name, each in found.items()},
            collisions_per_second=collisions / (seconds["measuring"] - calls),
            setup_seconds=seconds["setup"],
            equilibration=record["result"]["equilibration"],
            seconds=math.fsum(seconds.values()),
            **more,
        )

    @property
    def estimator(self) -> str:
        """The estimator with the smallest variance."""
        return min(self.variances, key=self.variances.__getitem__)

    def costs(self, n: int, *, variance: float, bias: float, shortest: float) -> Costs:
        """Return the costs of n particles, whose rate and setup are estimated from those here."""
        rate = slowed(self.collisions_per_second, self.n, n)
        setup = self.setup_seconds * n / self.n + self.call_seconds
        return Costs(n, variance, bias, rate, setup, self.equilibration, shortest)


class Method:
    """How a quantity is measured, from pilot to result; a subclass says of which quantity."""

    first_size: ClassVar[int]  # particles of the first pilot
    estimators: ClassVar[Mapping[str, str]]  # and what they do, in words
    sampling: ClassVar[str]
    run: ClassVar[type[Timed]]
    trial: ClassVar[type[Trial]]
    tasks: Callable[[int, int, float, float, int], list[Task]]
    system: System

    def trial_length(self, n: int) -> float:
        """Return the collisions per particle of a pilot of n particles; any if it finds its own."""
        return 1.0

    def pilot(self, n: int, *, seed: int, seconds: float, equilibration: float | None) -> Task:
        """Return the task of a pilot of some CPU seconds; the equilibration is given where it is known."""
        least, apart = equilibration, 0.0
        if least is None:
            least, apart = (OF_CRYSTAL, 0.0) if self.system.crystal else (FEWEST, APART)
        (task,) = self.tasks(n, 1, least, self.trial_length(n), seed)
        return {**task, "study": "pilot of a plan", "replica": REPLICA, "seconds": seconds, "apart": apart}


def carried_out(measure: Callable[..., Any], tasks: list[Task], unit: str, **given: Any) -> list[Record]:
    """Return the records of pilots or runs; what is ``given`` is for :meth:`carom.studies.study.Study.run`.

    Raises
    ------
    InputError
        If one failed.
    """
    done = _Study(_Tasks(tasks, measure, unit)).run(**given)
    if done.failures:
        reason = done.failures[0].reason
        several = f"{len(done.failures)} of {len(tasks)} {unit} failed: " if len(tasks) > 1 else ""
        raise InputError(f"{several}{reason}.")
    return sorted(done.records, key=lambda record: int(record["task"]["replica"]))


@dataclass(frozen=True)
class _Tasks(Spec):
    """Pilots or runs, and what measures them."""

    grid: ClassVar[tuple[str, ...]] = ("replicas",)

    made: list[Task]
    measure: Any
    unit: str

    def tasks(self) -> list[Task]:
        return self.made

    def words(self) -> dict[str, Any]:
        return {"replicas": len(self.made)}

    def settings(self) -> dict[str, Any]:
        # A pilot is followed by one of another size, in the same folder.
        shared = ("study", "version", "seed", *(["scene"] if self.unit == "runs" else []))
        return {name: self.made[0][name] for name in shared}


@dataclass(frozen=True, repr=False)
class _Study(GridStudy[Any]):
    """Pilots or runs as a study."""

    name: ClassVar[str] = "plan"

    @property
    def measure(self) -> Any:
        return self.spec.measure

    @property
    def unit(self) -> str:  # type: ignore[override]
        return str(self.spec.unit)
