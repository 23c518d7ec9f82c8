"""The system of a plan: a bulk phase of hard spheres with a free number of particles."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from carom import checks, densities, theory
from carom.errors import InputError
from carom.scene_file.scene_file import SceneFile
from carom.spec import file_of
from carom.studies.eos.spec import StudySpec
from carom.studies.planner.target import Scale
from carom.studies.scenes import nearest_filling, plain, with_fractions
from carom.theory.mixture_size import mixture_finite_size_shift

KEPT = ("diameter", "mass")
"""Keys of a scene that a plan takes over, besides species; and kT of [run]."""

REFUSED = (
    "walls",
    "obstacles",
    "contact",
    "interaction",
    "motion",
    "impact",
    "pinned",
)
"""Keys of a scene for which no correction to infinite size is known."""

LARGEST_DIMENSION = 6
"""Largest dimension with an equation of state, which the correction to infinite size needs."""


@dataclass(frozen=True)
class System:
    """Hard spheres in a periodic box, at a packing fraction.

    Parameters
    ----------
    packing_fraction : float
    dimension : int
        2 to 6.
    scene : mapping
        Keys of ``[scene]``: diameter, mass, kT, or kT and species with fractions.

    Raises
    ------
    InputError
        If no infinite system of this kind is known, or the density is that of two phases.
    """

    packing_fraction: float
    dimension: int = 3
    scene: Mapping[str, Any] = field(default_factory=dict)

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
        if not self.mixture and not theory.is_stable_fluid(d, eta) and eta < melting:
            raise InputError(
                f"At packing fraction {eta:g} a fluid and a crystal coexist ({freezing:g} to {melting:g} in "
                f"{d} dimensions): neither comes to equilibrium in a time that can be planned. "
                "Ask below or above."
            )
        self.spec(64)  # checks the other keys of the scene

    @property
    def mixture(self) -> bool:
        """Whether there is more than one species."""
        return len(self.scene.get("species", ())) > 1

    @property
    def crystal(self) -> bool:
        """Whether the stable phase is known to be a crystal."""
        return not self.mixture and not theory.is_stable_fluid(self.dimension, self.packing_fraction)

    @property
    def kT(self) -> float:
        """Temperature [energy]."""
        return float(self.scene.get("kT") or 1.0)

    @property
    def diameters(self) -> list[float]:
        """Diameter of each species [length]."""
        if "species" in self.scene:
            return [float(each.get("diameter", 1.0)) for each in self.scene["species"]]
        return [float(self.scene.get("diameter", 1.0))]

    @property
    def masses(self) -> list[float]:
        """Mass of each species."""
        if "species" in self.scene:
            return [float(each.get("mass", 1.0)) for each in self.scene["species"]]
        return [float(self.scene.get("mass", 1.0))]

    @property
    def fractions(self) -> list[float]:
        """Fraction of each species."""
        parts = [float(each.get("fraction", 1.0)) for each in self.scene.get("species", ())] or [1.0]
        return [part / math.fsum(parts) for part in parts]

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
        return StudySpec((self.packing_fraction,), n=(n,), dimension=self.dimension, scene=scene, **settings)

    def filling(self, n: int) -> int:
        """Return the possible number of particles nearest to n: a crystal fills its lattice."""
        start = {2: "triangular", 3: "fcc"}.get(self.dimension, "dn" if self.dimension > 3 else "cubic")
        return nearest_filling(start, self.dimension, n) if self.crystal else n

    def counts(self, n: int) -> list[int]:
        """Return the numbers of particles of each species among n, rounded as a scene rounds them."""
        ends = [round(n * part) for part in _running(self.fractions)]
        return [b - a for a, b in zip([0, *ends], ends, strict=False)]

    def z(self, fractions: Sequence[float] | None = None) -> float:
        """Return Z of the infinite system by theory."""
        if self.crystal:
            return float(theory.solid(self.dimension)(self.packing_fraction))
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
            return float(theory.finite_size_shift(eta, 1, theory.best(d)))
        present = [(x, s) for x, s in zip(self.fractions, self.diameters, strict=True) if x > 0.0]
        x, sigma = zip(*present, strict=True)
        return mixture_finite_size_shift(
            eta, x, sigma, d, 1, lambda e, parts, s: _mixed(e, [*parts], [*s], d)
        )

    def scale(self, quantity: str) -> Scale:
        """Return how a quantity follows from Z.

        Raises
        ------
        InputError
            For the contact value of a mixture, which has one for every pair of species.
        """
        if quantity == "P":
            return Scale(0.0, self.density * self.kT)
        if quantity == "g(contact)":
            if self.mixture:
                raise InputError(
                    "A mixture has a contact value for every pair of species; plan for Z or P instead."
                )
            return Scale(1.0, 1.0 / (2.0 ** (self.dimension - 1) * self.packing_fraction))
        return Scale()

    def words(self) -> dict[str, Any]:
        """Return the system as JSON values."""
        spec = self.spec(64)
        return {
            "packing_fraction": self.packing_fraction,
            "dimension": self.dimension,
            "scene": {**spec.scene, **({"kT": spec.kT} if "kT" in self.scene else {})},
        }

    def __str__(self) -> str:
        name = {1: "rods", 2: "disks", 3: "spheres"}.get(self.dimension, f"spheres in d = {self.dimension}")
        kind = f"mixture of hard {name}" if self.mixture else f"hard {name}"
        return f"{kind} at packing fraction {self.packing_fraction:g}{', crystal' if self.crystal else ''}"


def of_scene(path: str | Path) -> tuple[System, int]:
    """Return the system of a scene file, and its number of particles.

    Raises
    ------
    FileError, InputError
        If the file cannot be read, or is not a bulk phase in a periodic box.
    """
    return of_plan(SceneFile.load(file_of(Path(path))))


def of_plan(plan: SceneFile) -> tuple[System, int]:
    """Return the system of a plan that describes one scene, and its number of particles."""
    asked = plan.scene
    if asked.file is not None:
        raise InputError("A plan needs [scene] that says what there is, instead of a file to start from.")
    made = plan.build_scene()
    words: dict[str, Any] = {
        name: value for name in (*KEPT, *REFUSED) if (value := getattr(asked, name)) not in (None, ())
    }
    if plan.run.kT is not None:
        words["kT"] = plan.run.kT
    if asked.species:
        words["species"] = plain(with_fractions(asked))
    return System(made.packing_fraction, made.dimension, words), made.n


def _mixed(eta: float, fractions: Sequence[float], diameters: Sequence[float], d: int) -> float:
    """Return Z of a fluid by the best theory for its dimension."""
    if len(diameters) == 1:
        return float(theory.best(d)(eta))
    equation = functools.partial(theory.santos_yuste_lopez_de_haro, dimension=d)
    return float(theory.bmcsl(eta, fractions, diameters) if d == 3 else equation(eta, fractions, diameters))


def _running(parts: Sequence[float]) -> list[float]:
    """Return the cumulative sums."""
    return [math.fsum(parts[: k + 1]) for k in range(len(parts))]
