"""Planning for the self-diffusion of infinitely many spheres, or of one species of a mixture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from carom import theory
from carom.errors import InputError
from carom.observables.statistics import Estimate
from carom.studies.folder import Record, Task
from carom.studies.planner.choice import Costs
from carom.studies.planner.measures import Timed, Trial
from carom.studies.planner.pilot import Method, Pilot
from carom.studies.planner.system import System
from carom.studies.transport import windows
from carom.studies.transport.analysis import Point
from carom.studies.transport.measure import Currents
from carom.studies.transport.points import infinite_diffusion
from carom.studies.transport.spec import TransportSpec

OF_PILOT = 64
"""Blocks of the pilot: its error bar is known to 9 %."""

BLOCKS = 128
"""Blocks of all replicas together: their error bar is known to 6 %."""

FEWEST = 16
"""Least number of blocks of a run."""

OF_SHIFT, SMALL = 0.03, 5.0
"""Fraction of the shift with N that mode coupling may miss. The first number: 500 to 4000 spheres agree to it
at eta = 0.26. The second, divided by N, is for few spheres, whose box is hardly longer than a free path: for
64 spheres, D is too small by 0.10(5) of the shift at eta = 0.1, and by 0.01(3) at 0.2.
"""


@dataclass
class DiffusionRun(Timed, Currents):
    """One run of a plan for D."""


@dataclass
class DiffusionTrial(Trial, Currents):
    """A pilot for D."""


def missed(n: int) -> float:
    """Return the fraction of the shift of n spheres that mode coupling may miss."""
    return OF_SHIFT + SMALL / n


@dataclass(frozen=True)
class DiffusionPilot(Pilot):
    """Results of a pilot for D."""

    viscosity: float  # shear viscosity [mass / (length time)]
    of_viscosity: float  # squared relative error of the viscosity times pair collisions


class DiffusionMethod(Method):
    """How D is measured: Einstein's relation between collisions, corrected for the box by mode coupling."""

    first_size = 64
    estimators: ClassVar = {
        "displacement": "the slope of the mean square displacement",
        "velocity": "the integral of the velocity autocorrelation",
    }
    sampling = f"moments every {1 / windows.PER_FREE_TIME:g}, frames every " + (
        f"{windows.FRAME / windows.PER_FREE_TIME:g} mean free times: closer ones show the same displacements"
    )
    run, trial = DiffusionRun, DiffusionTrial

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

    def trial_length(self, n: int) -> float:
        """Return the collisions per particle of a pilot."""
        return self.block(n) * OF_PILOT

    def found(self, record: Record) -> DiffusionPilot:
        """Return the results of a pilot."""
        point = Point([record])
        collisions = sum(block["collisions"] for block in record["result"]["blocks"])
        viscosity, found = point.shear_viscosity(), self._estimates(point)
        best = min(found.values(), key=lambda e: e.error)
        return DiffusionPilot.of(
            record,
            found,
            collisions,
            value=infinite_diffusion(best, viscosity, point, self.species).mean,
            sure=True,
            call_seconds=0.0,
            viscosity=viscosity.mean,
            of_viscosity=viscosity.relative_error**2 * collisions,
        )

    def _estimates(self, point: Point) -> dict[str, Any]:
        """Return D of the size that was run, by each estimator."""
        return dict(zip(self.estimators, point.self_diffusion(self.species), strict=True))

    def costs(self, found: DiffusionPilot, n: int) -> Costs:
        """Return the costs of n spheres, from a pilot of any size.

        The variance of D goes as the time t_1 of the rule; the error of the viscosity adds to that of the
        shift.
        """
        shift = self.shift(n, found.viscosity, found.value)
        variance = found.variances[found.estimator] * self._window(n) / self._window(found.n)
        variance += shift**2 * found.of_viscosity * n / found.n
        return found.costs(n, variance=variance, bias=missed(n) * shift, shortest=BLOCKS * self.block(n))

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
        found = self._estimates(point)[estimator]
        value = infinite_diffusion(found, viscosity, point, self.species)
        said = [] if found.settled else ["The slope had not settled: the fluid is slow."]
        shift = value.mean - point.at_rest(self.species) * found.mean
        return value, missed(point.n) * abs(shift), said
