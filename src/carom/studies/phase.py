"""The phase of a run, and theory beside its numbers: Z by equations of state, and Z of infinite size."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom import theory
from carom.errors import CaromError, InputError
from carom.models import model_checks
from carom.models.interactions.wells import SquareWell
from carom.observables import Estimate, PressureResult
from carom.observables.analysis.drift import STUCK
from carom.observables.pressure import finite_size_doubt
from carom.observables.statistics import unwarned
from carom.observables.volume import VolumeResult
from carom.scene.fields import is_elastic, is_usual
from carom.scene.scene import Scene
from carom.studies.runs.summary import Theory
from carom.theory import Equation
from carom.theory.coexistence import gas_and_liquid

ENDS = {"Henderson": 0.6, "Padé of ten virials": 0.6, "Pieprzyk et al.": 0.55, "BMCSL": 0.55}
"""Packing fractions up to which results are compared with equations of state of the fluid. Those of disks are
1.5 % off at 0.67; Z of spheres by the series has a maximum at 0.57."""

CRYSTAL = "It is compared with the fcc crystal."

NEAR = 1e-4  # relative difference of two packing fractions for the slope of an equation of state


class Phase(NamedTuple):
    """The phase of a run of equal elastic particles in a periodic box."""

    name: str  # "fluid", "solid" or "coexistence"
    equations: dict[str, Equation]  # equations of state to compare its Z with, the best one last
    doubt: str = ""  # what speaks against its equilibrium, in a sentence
    remark: str = ""  # what else is to be known of the comparison


def phase_of(scene: Scene | MeanBox, initial: str, distance: float) -> Phase:
    """Return the phase of a run of equal elastic particles in a periodic box, by its start and their motion.

    Beyond freezing, particles at a median ``distance`` near their start are a solid, others a metastable
    fluid; disks between freezing and melting are two phases.
    """
    d, eta = scene.dimension, round(scene.packing_fraction, 9)
    freezing, melting = theory.FREEZING.get(d, 1.0), theory.MELTING.get(d, 1.0)
    stays = d > 1 and distance < STUCK
    if theory.is_stable_fluid(d, eta):
        early = "The particles still are near where they began: it may be no fluid yet. Equilibrate longer."
        shown, ends = _in_range(d, eta)
        return Phase("fluid", shown, early if stays else "", ends)
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
        doubt = f"{beyond}: a metastable fluid, if it did not freeze; the equations are those of the fluid."
        return Phase("fluid", shown, doubt, ends)
    if d == 3 and initial in ("fcc", "dn"):
        said = f"{beyond}, and the particles are where they began. {CRYSTAL}"
        known: dict[str, Equation] = {"Speedy (fcc)": theory.speedy, "Almarza (fcc)": theory.almarza}
        if eta >= melting:
            return Phase("solid", known, remark=said)
        doubt = f"{beyond} and below melting ({melting:g}): fluid and crystal may part. {CRYSTAL}"
        return Phase("solid", known, doubt)
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
    said = _ended(" and ".join(gone) + " end", ENDS[gone[0]])
    return {name: equation for name, equation in found.items() if name not in gone}, said


def _ended(who: str, last: float) -> str:
    return f"{who} at packing fraction {last:g}, so the result stands without."


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


class MeanBox(NamedTuple):
    """The box of the mean volume."""

    n: int
    dimension: int
    packing_fraction: float

    @classmethod
    def of(cls, found: VolumeResult) -> MeanBox:
        """Return that of a measured volume."""
        return cls(found.n, found.dimension, found.packing_fraction.mean)


def shift(box: MeanBox, phase: Phase, equation: Equation) -> float:
    """Return Z of n particles at constant pressure less that of infinitely many, by theory."""
    eta, n = box.packing_fraction, box.n
    return finite_size_shift(phase.name, eta, n, equation) + float(
        theory.constant_pressure_shift(eta, n, equation)
    )


def compared(scene: Scene, phase: Phase | None, volume: VolumeResult | None = None) -> list[Theory]:
    """Return Z by every theory that holds for the scene in this phase."""
    if volume is not None:
        return [] if phase is None else _theory(MeanBox.of(volume), phase)
    return _mixture_theory(scene) if phase is None else _theory(scene, phase)


def lines(rows: list[Theory]) -> dict[str, float]:
    """Return Z by the theory that the table of the run shows, by name; nothing where none holds."""
    return {row.name: row.Z for row in rows if row.Z is not None}


def doubt(phase: Phase | None, scene: Scene, kT: float) -> str | None:
    """Return what the phase, the size of the box or wells say against equilibrium."""
    if phase is None:
        return _doubt_of_wells(scene, kT)
    small = ""
    if phase.name == "fluid":
        small = finite_size_doubt(scene.packing_fraction, scene.n, scene.dimension)
    return " ".join(filter(None, (phase.doubt, small))) or None


def remark(phase: Phase | None, scene: Scene) -> str:
    """Return which equations of state end before the scene, or which crystal it is compared with."""
    if phase is not None:
        return phase.remark
    known = _mixture_equations(scene)
    name = max(known, key=lambda name: known[name][0], default="")
    past = name and scene.packing_fraction > known[name][0]
    return _ended(f"{name} ends", known[name][0]) if past else ""


def _doubt_of_wells(scene: Scene, kT: float) -> str | None:
    """Return a sentence where gas and liquid of particles with wells are known to coexist."""
    wells = scene.interaction
    if scene.dimension != 3 or not isinstance(wells, SquareWell) or not wells.depth > 0.0:
        return None
    density = scene.n / scene.volume * scene.diameter**3
    found = gas_and_liquid(wells.range, kT / wells.depth)
    if found is None or not found[0] < density < found[1]:
        return None
    return (
        f"Gas and liquid of these wells coexist at kT = {kT:.3g}, at densities of about {found[0]:.1g} and "
        f"{found[1]:.2g}, and the density is {density:.3g}: they part, and no one state is measured."
    )


def of_infinite_size(
    pressure: PressureResult | None,
    phase: Phase | None,
    volume: VolumeResult | None = None,
    measured: Estimate | None = None,  # Z at constant pressure
) -> Estimate | None:
    """Return Z of infinitely many particles, or None where no theory gives the correction."""
    if phase is None:
        return None
    if volume is not None:
        best = usual_equation(volume.dimension, phase.name)
        if measured is None or best is None or (phase.name != "fluid" and not phase.equations):
            return None
        return measured.scaled(1.0, offset=-shift(MeanBox.of(volume), phase, best))
    if pressure is None or pressure.n == 1 or phase.name == "coexistence":
        return None
    try:
        with unwarned():  # the doubt about the phase has the same text
            return pressure.infinite_size()
    except InputError:
        return None


def _theory(scene: Scene | MeanBox, phase: Phase) -> list[Theory]:
    """Return Z by the equations of state of the phase, for infinitely many particles and for n."""
    n, dimension, eta = scene.n, scene.dimension, scene.packing_fraction
    rows: list[Theory] = []
    errors = None
    for name, equation in phase.equations.items():
        try:
            large = float(equation(eta))
            if isinstance(scene, MeanBox):
                value, contact = large + shift(scene, phase, equation), math.nan
                # Measured is Z ~ V, and theory falls with the same V: their errors add.
                errors = 1.0 + (float(equation(eta * (1.0 + NEAR))) / large - 1.0) / NEAR
            else:
                value = large + finite_size_shift(phase.name, eta, n, equation)
                contact = float(theory.contact_value(value, eta, dimension, n)) if n > 1 else math.nan
        except CaromError:
            continue
        if math.isnan(value):
            continue
        rows.append(Theory(name, finite(value), finite(large), finite(contact), errors))
    return rows


def _mixture_equations(scene: Scene) -> dict[str, tuple[float, Callable[..., Any]]]:
    """Return the equations of state of an additive mixture, each with the packing fraction where it ends;
    nothing for other scenes.
    """
    usual = all(is_usual(scene, kind) for kind in model_checks.USUAL) and scene.pinned is None
    if scene.walls or scene.obstacles or scene.contact is not None or not is_elastic(scene) or not usual:
        return {}
    # The second rests on an equation of equal particles, which holds up to their freezing only.
    d = scene.dimension
    general = functools.partial(theory.santos_yuste_lopez_de_haro, dimension=d)
    found: dict[str, tuple[float, Callable[..., Any]]] = {}
    if d == 3:
        found["BMCSL"] = ENDS["BMCSL"], theory.bmcsl
    return found | {"Santos-Yuste-Lopez de Haro": (min(end(d), theory.FREEZING.get(d, 1.0)), general)}


def _mixture_theory(scene: Scene) -> list[Theory]:
    """Return Z of an additive mixture of infinite size by theory; nothing for other scenes."""
    diameters, counts = np.unique(scene.diameters, return_counts=True)
    rows: list[Theory] = []
    for name, (last, equation) in _mixture_equations(scene).items():
        if scene.packing_fraction > last:
            continue
        try:
            value = float(equation(scene.packing_fraction, counts / scene.n, diameters))
        except CaromError:
            continue
        # The effect of N on Z of a mixture is left out; it is small where N is large.
        rows.append(Theory(f"{name}, infinite N", finite(value), finite(value), None))
    return rows


def finite(value: float) -> float | None:
    """Return a value as JSON has it: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None
