"""The system of a plan: a bulk phase of hard spheres, or of wells, with a free number of particles."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from carom import checks, densities, theory
from carom.errors import InputError
from carom.scene.species import counts_of
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.studies.eos.spec import StudySpec
from carom.studies.phase import usual_equation
from carom.studies.planner.target import Scale
from carom.studies.scenes import (
    nearest_filling,
    plain,
    refuse_long_boxes,
    refuse_other_interactions,
    with_fractions,
)
from carom.studies.transport import windows
from carom.theory.mixture_size import mixture_finite_size_shift

DEEPEST = 600.0
"""Depth of a well [kT] from which on its Boltzmann factor is taken as that: it is far from being a fluid."""

KEPT = ("diameter", "mass", "interaction")
"""Keys of a scene that a plan takes over, besides species; and kT of [run]."""

REFUSED = ("walls", "obstacles", "contact", "motion", "impact", "drive", "pinned")
"""Keys of a scene for which no correction to infinite size is known."""

KICKS = 0.3
"""Rate of the thermostat of wells, in kicks per mean free time. Averages are exact at any rate; at this one
the energy is soon forgotten, and diffusion is hardly slowed down."""

LARGEST_DIMENSION = 6
"""Largest dimension with an equation of state, which the correction to infinite size needs."""


@dataclass(frozen=True)
class System:
    """Hard spheres in a periodic box at a packing fraction, or spheres with wells at a temperature, too."""

    packing_fraction: float
    dimension: int = 3  # 2 to 6
    scene: Mapping[str, Any] = field(default_factory=dict)
    """Keys of ``[scene]``: diameter, mass, kT and interaction, or kT and species with fractions."""

    def __post_init__(self) -> None:
        d = checks.integer(self.dimension, "dimension", low=1, high=LARGEST_DIMENSION)
        species = self.scene.get("species", ())
        if not isinstance(species, list | tuple) or not all(isinstance(each, Mapping) for each in species):
            raise InputError(f"species must be a list of tables, found {checks.describe(species)}.")
        if d == 1:
            raise InputError(
                "On a line nothing has to be planned: carom.theory.tonks is exact, and the error of a run, "
                "whose motion is periodic, does not fall as the square root of its length."
            )
        for name in REFUSED:
            if name in self.scene:
                raise InputError(
                    f"[scene] {name} leaves no infinite system to plan for; remove it, or use carom run "
                    "--relative-error."
                )
        high = densities.CLOSEST_PACKING.get(d, 1.0)
        eta = checks.number(self.packing_fraction, "packing_fraction", low=0.0, high=high, open_low=True)
        freezing, melting = theory.FREEZING.get(d, math.inf), theory.MELTING.get(d, math.inf)
        if self.wells:
            self._check_wells(eta)
        elif not self.mixture and not theory.is_stable_fluid(d, eta) and eta < melting:
            raise InputError(
                f"At packing fraction {eta:g} a fluid and a crystal coexist ({freezing:g} to {melting:g} in "
                f"{d} dimensions): neither comes to equilibrium in a time that can be planned. "
                "Ask below or above."
            )
        self.spec(64)  # checks the other keys of the scene

    def _check_wells(self, eta: float) -> None:
        """Raise InputError unless equal spheres with wells are one fluid, as far as is known."""
        if self.mixture:
            raise InputError("Wells are planned for particles of one species; use carom run for others.")
        if "kT" not in self.scene:
            raise InputError("Wells have no packing fraction alone, they need a temperature: give kT.")
        if not theory.is_stable_fluid(self.dimension, eta):
            raise InputError(
                f"At packing fraction {eta:g} cores alone may freeze: wells are planned for fluids."
            )
        step = 1e-3 * eta
        if (eta + step) * self._isotherm(eta + step) <= (eta - step) * self._isotherm(eta - step):
            raise InputError(
                f"At packing fraction {eta:g} and kT = {self.kT:g} a gas and a liquid are near each other or "
                "coexist, judged by the second virial coefficient of the wells. Ask for a higher kT."
            )

    @property
    def wells(self) -> bool:
        """Whether pairs have a potential in steps."""
        return self.scene.get("interaction") is not None

    @functools.cached_property
    def _attraction(self) -> float:
        """Return what steps take from Z over the packing fraction, exact in the second virial coefficient."""
        words: dict[str, Any] = {
            "n": 64, "packing_fraction": self.packing_fraction, "dimension": self.dimension,
        }  # fmt: skip
        words |= {key: self.scene[key] for key in ("diameter", "mass") if key in self.scene}
        interaction = SceneSpec(**words, interaction=self.scene["interaction"]).interaction
        refuse_other_interactions(interaction, self.diameters[0])
        d, (sigma,) = self.dimension, self.diameters
        (steps,) = (one for row in interaction.steps_by_species(sigma) for one in row)
        inner = (0.0, *steps.distances)
        volumes = [b**d - a**d for a, b in itertools.pairwise(inner)]
        mayer = [math.exp(min(-energy / self.kT, DEEPEST)) - 1.0 for energy in steps.energies]
        cores = sigma**d  # whose repulsion the isotherm of hard spheres has
        return 2.0 ** (d - 1) * (math.fsum(f * v for f, v in zip(mayer, volumes, strict=True)) / cores + 1.0)

    def _isotherm(self, eta: Any) -> Any:
        """Return Z of wells: that of hard cores, with the second virial coefficient of the wells."""
        return theory.best(self.dimension)(eta) - self._attraction * eta

    @property
    def mixture(self) -> bool:
        """Whether there is more than one species."""
        return len(self.scene.get("species", ())) > 1

    @property
    def crystal(self) -> bool:
        """Whether the stable phase is known to be a crystal."""
        ordered = not theory.is_stable_fluid(self.dimension, self.packing_fraction)
        return ordered and not self.mixture and not self.wells

    @property
    def kT(self) -> float:
        """Temperature [energy]."""
        return float(self.scene.get("kT") or 1.0)

    @property
    def diameters(self) -> list[float]:
        """Diameter of each species [length]."""
        return self._of_species("diameter")

    @property
    def masses(self) -> list[float]:
        """Mass of each species."""
        return self._of_species("mass")

    @property
    def mean_mass(self) -> float:
        """Mean mass of a particle."""
        return math.fsum(x * m for x, m in zip(self.fractions, self.masses, strict=True))

    @property
    def fractions(self) -> list[float]:
        """Fraction of each species."""
        parts = self._of_species("fraction")
        return [part / math.fsum(parts) for part in parts]

    def _of_species(self, name: str) -> list[float]:
        """Return a number of each species; of one species it is a key of the scene, or 1."""
        return [float(each.get(name, 1.0)) for each in self.scene.get("species") or [self.scene]]

    @property
    def density(self) -> float:
        """Number density [1 / length^d]."""
        d = self.dimension
        volume = sum(
            x * theory.ball_volume(d, s) for x, s in zip(self.fractions, self.diameters, strict=True)
        )
        return self.packing_fraction / volume

    def spec(self, n: int, **settings: Any) -> StudySpec:
        """Return the study of this system with n particles."""
        settings = {"replicas": 1, "collisions_per_particle": 1.0, "frames": 0, "kT": self.kT, **settings}
        scene = {name: value for name, value in self.scene.items() if name != "kT"}
        if self.wells:
            scene["drive"] = {"type": "andersen", "kT": self.kT, "rate": self._rate}
        return StudySpec((self.packing_fraction,), n=(n,), dimension=self.dimension, scene=scene, **settings)

    @property
    def _rate(self) -> float:
        """Return the rate of the thermostat, to four digits."""
        time = windows.free_time(
            self.packing_fraction, self.diameters, self.masses, self.fractions, self.dimension, self.kT
        )
        return float(f"{KICKS / time:.4g}")

    def filling(self, n: int) -> int:
        """Return the possible number of particles nearest to n: a crystal fills its lattice."""
        start = {2: "triangular", 3: "fcc"}.get(self.dimension, "dn" if self.dimension > 3 else "cubic")
        return nearest_filling(start, self.dimension, n) if self.crystal else n

    def counts(self, n: int) -> tuple[int, ...]:
        """Return the numbers of particles of each species among n, rounded as a scene rounds them."""
        return counts_of(self.fractions, n)

    def z(self, fractions: Sequence[float] | None = None) -> float:
        """Return Z of the infinite system by theory."""
        if self.crystal:
            return float(theory.solid(self.dimension)(self.packing_fraction))
        if self.wells:
            return float(self._isotherm(self.packing_fraction))
        x = self.fractions if fractions is None else fractions
        return _mixed(self.packing_fraction, x, self.diameters, self.dimension)

    def shift(self, n: int, counts: Sequence[int] | None = None) -> float:
        """Return ``Z_N - Z`` by theory: for finite N, and for the rounding of the composition."""
        if self.crystal:
            equation = theory.solid(self.dimension)
            return float(theory.crystal_finite_size_shift(self.packing_fraction, n, equation))
        shift = self._per_particle / n
        if counts is not None and self.mixture:
            shift += self.z([c / math.fsum(counts) for c in counts]) - self.z()
        return shift

    @functools.cached_property
    def _per_particle(self) -> float:
        """Return N times the shift of the fluid."""
        eta, d = self.packing_fraction, self.dimension
        if not self.mixture:
            return float(theory.finite_size_shift(eta, 1, self._isotherm if self.wells else theory.best(d)))
        present = [(x, s) for x, s in zip(self.fractions, self.diameters, strict=True) if x > 0.0]
        x, sigma = zip(*present, strict=True)
        return mixture_finite_size_shift(
            eta, x, sigma, d, 1, lambda e, parts, s: _mixed(e, [*parts], [*s], d)
        )

    def species(self, name: str | None) -> int:
        """Return the number of the species that a target names, 0 where there is one and none is named."""
        names = [str(each.get("name") or k) for k, each in enumerate(self.scene.get("species", ()))] or ["0"]
        if name is None and len(names) > 1:
            raise InputError(
                f"Each species of a mixture has its own D: ask for D({names[0]}) to D({names[-1]})."
            )
        if name not in (None, *names, *map(str, range(len(names)))):
            raise InputError(f"There is no species {name}; expected one of {', '.join(names)}.")
        return 0 if name is None else names.index(name) if name in names else int(name)

    def scale(self, quantity: str) -> Scale:
        """Return how a quantity follows from Z."""
        if quantity == "P":
            return Scale(0.0, self.density * self.kT)
        if quantity == "g(contact)":
            if self.wells:
                raise InputError(
                    "The pressure of wells is not that of contacts alone; plan for Z or P instead."
                )
            if self.mixture:
                raise InputError(
                    "A mixture has a contact value for every pair of species; plan for Z or P instead."
                )
            return Scale(1.0, 1.0 / (2.0 ** (self.dimension - 1) * self.packing_fraction))
        return Scale()

    def words(self) -> dict[str, Any]:
        """Return the system as JSON values."""
        spec = self.spec(64)
        scene = {name: value for name, value in spec.scene.items() if name != "drive"}
        scene |= {"kT": spec.kT} if "kT" in self.scene else {}
        return {"packing_fraction": self.packing_fraction, "dimension": self.dimension, "scene": scene}

    def __str__(self) -> str:
        name = {1: "rods", 2: "disks", 3: "spheres"}.get(self.dimension, f"spheres in d = {self.dimension}")
        kind = f"mixture of hard {name}" if self.mixture else f"hard {name}"
        if self.wells:
            kind = f"{name} with wells at kT = {self.kT:g},"
        return f"{kind} at packing fraction {self.packing_fraction:g}{', crystal' if self.crystal else ''}"


def of_plan(plan: SceneFile) -> System:
    """Return the system of a plan that describes one scene."""
    asked = plan.scene
    if asked.file is not None:
        raise InputError("A plan needs [scene] that says what there is, instead of a file to start from.")
    if asked.sizes is not None:
        raise InputError(
            "[scene] sizes are none of a plan, which is of equal particles or of species; use carom run "
            "--relative-error."
        )
    refuse_long_boxes(asked)
    made = plan.build_scene()
    words: dict[str, Any] = {
        name: value for name in (*KEPT, *REFUSED) if (value := getattr(asked, name)) not in (None, ())
    }
    if plan.run.kT is not None:
        words["kT"] = plan.run.kT
    if asked.species:
        words["species"] = plain(with_fractions(asked))
    return System(made.packing_fraction, made.dimension, words)


def _mixed(eta: float, fractions: Sequence[float], diameters: Sequence[float], d: int) -> float:
    """Return Z of a fluid by the best theory for its dimension."""
    equation = usual_equation(d, "fluid", [*zip(diameters, fractions, strict=True)])
    assert equation is not None
    return float(equation(eta))
