"""Planning for the self-diffusion of infinitely many spheres, or of one species of a mixture."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from carom import theory
from carom.errors import InputError
from carom.observables.statistics import Estimate, unwarned
from carom.studies.coefficients import windows
from carom.studies.coefficients.analysis import Point
from carom.studies.coefficients.measure import Currents
from carom.studies.coefficients.points import infinite_diffusion
from carom.studies.coefficients.spec import TransportSpec
from carom.studies.folder import Record, Task
from carom.studies.job import Look
from carom.studies.planner import pilot as trial
from carom.studies.planner.choice import Costs, slowed
from carom.studies.planner.measures import REPLICA, Timed, once
from carom.studies.planner.system import System
from carom.studies.study import perform

SIZE = 64
"""Spheres of the first pilot."""

OF_PILOT = 64
"""Blocks of the pilot: its error bar is known to 9 %."""

BLOCKS = 128
"""Blocks of all replicas together: their error bar is known to 6 %."""

FEWEST, SHORT = 16, 16.0
"""Least number of blocks of a run, and collisions per particle of a run that only compiles or loads code."""

OF_SHIFT, SMALL = 0.03, 5.0
"""Fraction of the shift with N that mode coupling may miss. The first number: 500 to 4000 spheres agree to it
at eta = 0.26. The second, divided by N, is for few spheres, whose box is hardly longer than a free path: for
64 spheres, D is too small by 0.10(5) of the shift at eta = 0.1, and by 0.01(3) at 0.2.
"""

ESTIMATORS = {
    "displacement": "the slope of the mean square displacement",
    "velocity": "the integral of the velocity autocorrelation",
}


def load(task: Task) -> None:
    """Compile or load the code of a task, once in a process, before any time is measured."""
    brief = {
        **task, "equilibration": 1.0, "collisions_per_particle": SHORT, "blocks": FEWEST, "replica": REPLICA,
    }  # fmt: skip
    once("D " + json.dumps(task["scene"], sort_keys=True), lambda: Currents.measure(brief, Look()))


@dataclass
class Planned(Timed, Currents):
    """A run of a transport study, and its CPU time."""

    warm_up = staticmethod(load)


measure = Planned.measure


def missed(n: int) -> float:
    """Return the fraction of the shift of n spheres that mode coupling may miss."""
    return OF_SHIFT + SMALL / n


@dataclass(frozen=True)
class DiffusionPilot(trial.Found):
    """Results of a pilot for D."""

    value: float  # D of infinitely many spheres [length^2 / time]
    viscosity: float  # shear viscosity [mass / (length time)]
    of_viscosity: float  # squared relative error of the viscosity times pair collisions


class DiffusionMethod:
    """How D is measured: Einstein's relation between collisions, corrected for the box by mode coupling."""

    measure = staticmethod(measure)
    first_size = SIZE
    estimators = tuple(ESTIMATORS)
    sampling = f"moments every {1 / windows.PER_FREE_TIME:g}, frames every " + (
        f"{windows.FRAME / windows.PER_FREE_TIME:g} mean free times: closer ones show the same displacements"
    )

    def __init__(self, system: System, species: str | None = None):
        self.system, self.species = system, system.species(species)
        if system.dimension == 2:
            raise InputError(
                "In two dimensions D grows with the logarithm of the size: there is none to plan for."
            )
        if system.dimension != 3 or system.crystal or system.wells:
            raise InputError(
                "D is planned for fluids of hard spheres in three dimensions, where its shift with N is "
                "known; use carom transport for others."
            )

    def pilot(
        self,
        n: int,
        *,
        seed: int,
        seconds: float,
        equilibration: float | None,
        look: Callable[[float], object],
    ) -> DiffusionPilot:
        """Run n particles for some seconds."""
        with unwarned():
            if equilibration is None:
                sim = trial.begin(self.system, n, seed)
                sim.run(collisions=trial.COLLISIONS)
                equilibration = trial.equilibrate(sim, self.system, trial.Watch(seconds, look))
            length = self.block(n) * OF_PILOT
            (task,) = self.tasks(n, 1, equilibration, length, seed)
            watch = trial.Watch(seconds, look)

            def stop() -> bool:
                watch.look()
                return False

            record = perform(measure, {**task, "replica": REPLICA}, stop)
        point = Point([record])
        collisions = sum(block["collisions"] for block in record["result"]["blocks"])
        seconds = sum(record["provenance"]["cpu_seconds"].values())
        viscosity = point.shear_viscosity()
        found = dict(zip(ESTIMATORS, point.self_diffusion(self.species), strict=True))
        best = min(found.values(), key=lambda e: e.error)
        return DiffusionPilot(
            n=n,
            value=infinite_diffusion(best, viscosity, point, self.species).mean,
            variances={name: e.error**2 * collisions for name, e in found.items()},
            viscosity=viscosity.mean,
            of_viscosity=viscosity.relative_error**2 * collisions,
            collisions_per_second=(collisions + 0.5 * n * equilibration) / seconds,
            setup_seconds=0.0,
            equilibration=equilibration,
            sure=True,
            seconds=seconds,
        )

    def value(self, found: DiffusionPilot) -> float:
        """Return D of infinitely many spheres, to the accuracy of a pilot."""
        return found.value

    def costs(self, found: DiffusionPilot, n: int) -> Costs:
        """Return the costs of n spheres, from a pilot of any size.

        The variance of D goes as the time t_1 of the rule; the error of the viscosity adds to that of the
        shift.
        """
        shift = self.shift(n, found.viscosity, found.value)
        variance = found.variances[found.estimator] * self._window(n) / self._window(found.n)
        variance += shift**2 * found.of_viscosity * n / found.n
        return Costs(
            n=n,
            variance=variance,
            bias=missed(n) * shift,
            collisions_per_second=slowed(found.collisions_per_second, found.n, n),
            setup_seconds=found.setup_seconds,
            overhead_seconds=0.0,
            equilibration=found.equilibration,
            shortest=BLOCKS * self.block(n),
        )

    def shift(self, n: int, viscosity: float, value: float) -> float:
        """Return by how much D of n spheres is too small [length^2 / time]."""
        one = self.system
        return theory.diffusion_shift(
            n, one.density, viscosity, self_diffusion=value, mass=one.mean_mass, kT=one.kT
        )

    def block(self, n: int) -> float:
        """Return the collisions per particle of a block that is long enough for the rule of the slope."""
        return windows.SHORTEST * max(2.0 * self._window(n), windows.LAGS[-1] / windows.PER_FREE_TIME)

    def _window(self, n: int) -> float:
        """Return t_1 of the rule for n spheres [mean free times]."""
        one = self.system
        free = windows.free_time(one.packing_fraction, one.diameters, one.masses, one.fractions, 3, one.kT)
        edge = (n / one.density) ** (1.0 / 3.0)
        wave = windows.longest_wave(edge, one.packing_fraction, one.density, one.mean_mass, 3, one.kT)
        return max(windows.WAVES * wave / free, windows.STARTS[0] / windows.PER_FREE_TIME)

    def tasks(self, n: int, replicas: int, equilibration: float, length: float, seed: int) -> list[Task]:
        """Return the runs of a plan."""
        blocks = max(FEWEST, min(-(-BLOCKS // replicas), int(length / self.block(n))))
        spec = TransportSpec(
            (self.system.packing_fraction,), n=(n,), replicas=replicas, equilibration=equilibration,
            collisions_per_particle=length, seed=seed, blocks=blocks, kT=self.system.kT,
            scene={name: value for name, value in self.system.scene.items() if name != "kT"},
        )  # fmt: skip
        return spec.tasks()

    def reached(self, records: Sequence[Record], estimator: str) -> tuple[Estimate, float, list[str]]:
        """Return D of infinitely many spheres, its possible bias, and doubts about it."""
        point = Point(list(records))
        viscosity = point.shear_viscosity()
        found = dict(zip(ESTIMATORS, point.self_diffusion(self.species), strict=True))[estimator]
        value = infinite_diffusion(found, viscosity, point, self.species)
        said = [] if found.settled else ["The slope had not settled: the fluid is slow."]
        shift = value.mean - point.at_rest(self.species) * found.mean
        return value, missed(point.n) * abs(shift), said

    def route(self, estimator: str) -> str:
        """Return how the quantity is measured, in words."""
        return ESTIMATORS[estimator]
