"""The phase of a run, and the equations of state to compare it with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from carom import theory
from carom.errors import InputError
from carom.observables.drift import STUCK
from carom.theory import Equation

ENDS = {"Henderson": 0.6, "Padé of ten virials": 0.6, "Pieprzyk et al.": 0.55}
"""Packing fractions up to which results are compared with equations of state of the fluid. Those of disks are
1.5 % off at 0.67; Z of spheres by the series has a maximum at 0.57."""


class Phase(NamedTuple):
    """The phase of a run of equal elastic particles in a periodic box."""

    name: str  # "fluid", "solid" or "coexistence"
    equations: dict[str, Equation]  # equations of state to compare its Z with, the best one last
    note: str  # a caveat, in a sentence; or ""


class Filled(Protocol):
    """What the phase depends on: of a scene, or of the mean volume at constant pressure."""

    @property
    def dimension(self) -> int:
        """Number of dimensions."""

    @property
    def packing_fraction(self) -> float:
        """Packing fraction."""


def phase_of(scene: Filled, initial: str, distance: float) -> Phase:
    """Return the phase of a run of equal elastic particles in a periodic box, by its start and their motion.

    ``distance`` is the median of :func:`carom.observables.drift.moved`. Beyond freezing, particles that stay
    near their start are a solid; otherwise the phase is a metastable fluid. Disks between freezing and
    melting are two coexisting phases.
    """
    d, eta = scene.dimension, round(scene.packing_fraction, 9)
    freezing, melting = theory.FREEZING.get(d, 1.0), theory.MELTING.get(d, 1.0)
    stays = d > 1 and distance < STUCK
    if theory.is_stable_fluid(d, eta):
        note = ""
        if stays:
            note = (
                "The particles still are near where they began: it may be no fluid yet. Equilibrate longer."
            )
        shown, ends = _in_range(d, eta)
        return Phase("fluid", shown, note or ends)
    beyond = f"Packing fraction {eta:.4g} is beyond freezing ({freezing:g})"
    if d == 2 and eta < melting:
        return Phase(
            "coexistence",
            {},
            f"{beyond} and below melting ({melting:g}): fluid and solid are there side by side, and no "
            "equation of state holds.",
        )
    if not stays:
        shown, ends = _in_range(d, eta)
        note = f"{beyond}: a metastable fluid, if it did not freeze; the equations are those of the fluid."
        return Phase("fluid", shown, f"{note} {ends}".rstrip())
    if d == 3 and initial in ("fcc", "dn"):
        return Phase(
            "solid",
            {"Speedy (fcc)": theory.speedy, "Almarza (fcc)": theory.almarza},
            f"{beyond}, and the particles are where they began: it is compared with the fcc crystal.",
        )
    return Phase(
        "solid",
        {},
        f"{beyond}, and the particles are where they began: a crystal or a glass, of which no equation "
        "of state is known here.",
    )


def _in_range(dimension: int, eta: float) -> tuple[dict[str, Equation], str]:
    """Return the equations of state of the fluid that hold there, and which ones end before."""
    found = theory.equations(dimension)
    gone = [name for name in found if eta > ENDS.get(name, 1.0)]
    if not gone:
        return found, ""
    said = f"{' and '.join(gone)} end at packing fraction {ENDS[gone[0]]:g}, so the result stands without."
    return {name: equation for name, equation in found.items() if name not in gone}, said


def end(dimension: int) -> float:
    """Return the packing fraction up to which a fluid is compared with its best equation of state."""
    return ENDS.get(next(reversed(theory.equations(dimension)), ""), 1.0)


def expected(packing_fraction: float, dimension: int, initial: str, *, mixture: bool = False) -> str:
    """Return the phase that a run should be in, by its start: "random", or the name of a lattice.

    It is "fluid" below freezing; above freezing "fluid" for a random start, and "solid" for a crystal; in 2D
    "coexistence" between freezing and melting of equal disks.
    """
    if theory.is_stable_fluid(dimension, packing_fraction):
        return "fluid"
    if dimension == 2 and round(packing_fraction, 9) < theory.MELTING[2] and not mixture:
        return "coexistence"
    return "fluid" if initial == "random" else "solid"


def usual_equation(
    dimension: int, phase: str, species: Sequence[Sequence[float]] = ((1.0, 1),)
) -> Equation | None:
    """Return the best known equation of state of a phase, or None.

    Of a mixture, ``species`` are diameters, each with the number of particles or the fraction that has it.
    """
    if phase == "solid" and dimension == 3 and len(species) == 1:
        return theory.almarza
    if phase != "fluid" or dimension > 6:
        return None
    if len(species) == 1:
        return theory.best(dimension)
    diameters, total = [s for s, _ in species], math.fsum(c for _, c in species)
    fractions = [c / total for _, c in species]
    if dimension == 3:
        return lambda eta: theory.bmcsl(eta, fractions, diameters)
    return lambda eta: theory.santos_yuste_lopez_de_haro(eta, fractions, diameters, dimension)


def finite_size_shift(phase: str, packing_fraction: float, n: int, equation: Equation | None) -> float:
    """Return ``Z_N - Z`` of n particles in a phase by theory; nan where the equation of state has none."""
    if equation is None:
        return math.nan
    law = theory.crystal_finite_size_shift if phase == "solid" else theory.finite_size_shift
    try:
        return float(law(packing_fraction, n, equation))
    except InputError:
        return math.nan
