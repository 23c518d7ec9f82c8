"""Theory beside a run: Z by the equations of state of its phase, and Z of infinite size."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from carom import theory
from carom.errors import CaromError, CaromWarning, InputError
from carom.models import model_checks
from carom.observables import Estimate, PressureResult
from carom.observables.pressure import finite_size_doubt
from carom.observables.volume import VolumeResult
from carom.scene.fields import is_elastic, is_usual
from carom.scene.scene import Scene
from carom.studies.phase import Phase, finite_size_shift
from carom.studies.runs import constant_pressure
from carom.studies.runs.constant_pressure import MeanBox


def compared(scene: Scene, phase: Phase | None, volume: VolumeResult | None = None) -> list[dict[str, Any]]:
    """Return Z by every theory that holds for the scene in this phase."""
    if volume is not None:
        return [] if phase is None else _theory(MeanBox.of(volume), phase)
    return _mixture_theory(scene) if phase is None else _theory(scene, phase)


def lines(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return Z by the theory that the table of the run shows, by name; nothing where none holds."""
    values = {row["name"]: row["Z"] for row in rows}
    return {name: value for name, value in values.items() if value is not None}


def note(phase: Phase, scene: Scene) -> str | None:
    """Return the caveats on the phase and on the size of the box."""
    small = ""
    if phase.name == "fluid":
        small = finite_size_doubt(scene.packing_fraction, scene.n, scene.dimension)
    return " ".join(filter(None, (phase.note, small))) or None


def of_infinite_size(
    pressure: PressureResult | None,
    phase: Phase | None,
    volume: VolumeResult | None = None,
    given: Mapping[str, Estimate] = MappingProxyType({}),
) -> Estimate | None:
    """Return Z of infinitely many particles, or None where no theory gives the correction."""
    if volume is not None:
        return constant_pressure.infinite(given["Z"], MeanBox.of(volume), phase)
    if pressure is None or pressure.n == 1 or phase is None or phase.name == "coexistence":
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # the note on the phase has the same text
            return pressure.infinite_size()
    except InputError:
        return None


def _theory(scene: Scene | MeanBox, phase: Phase) -> list[dict[str, Any]]:
    """Return Z by the equations of state of the phase, for infinitely many particles and for n."""
    n, dimension, eta = scene.n, scene.dimension, scene.packing_fraction
    rows: list[dict[str, Any]] = []
    for name, equation in phase.equations.items():
        try:
            large = float(equation(eta))
            if isinstance(scene, MeanBox):
                value, contact = large + constant_pressure.shift(scene, phase, equation), math.nan
            else:
                value = large + finite_size_shift(phase.name, eta, n, equation)
                contact = float(theory.contact_value(value, eta, dimension, n)) if n > 1 else math.nan
        except CaromError:
            continue
        if math.isnan(value):
            continue
        rows.append(
            {
                "name": name,
                "Z": finite(value),
                "Z_infinite": finite(large),
                "contact_value": finite(contact),
            }
        )
    return rows


def _mixture_theory(scene: Scene) -> list[dict[str, Any]]:
    """Return Z of an additive mixture of infinite size by theory; nothing for other scenes."""
    usual = all(is_usual(scene, kind) for kind in model_checks.USUAL) and scene.pinned is None
    if scene.walls or scene.obstacles or scene.contact is not None or not is_elastic(scene) or not usual:
        return []
    d, eta = scene.dimension, scene.packing_fraction
    diameters, counts = np.unique(scene.diameters, return_counts=True)
    fractions = counts / scene.n
    equations: dict[str, Callable[[], Any]] = {}
    if d == 3:
        equations["BMCSL"] = lambda: theory.bmcsl(eta, fractions, diameters)
    # It rests on an equation of equal particles, which holds up to their freezing only.
    if eta < theory.FREEZING.get(d, 1.0):
        equations["Santos-Yuste-Lopez de Haro"] = lambda: theory.santos_yuste_lopez_de_haro(
            eta, fractions, diameters, d
        )
    rows: list[dict[str, Any]] = []
    for name, equation in equations.items():
        try:
            value = float(equation())
        except CaromError:
            continue
        # The effect of N on Z of a mixture is left out; it is small where N is large.
        rows.append(
            {
                "name": f"{name}, infinite N",
                "Z": finite(value),
                "Z_infinite": finite(value),
                "contact_value": None,
            }
        )
    return rows


def finite(value: float) -> float | None:
    """Return a value as JSON has it: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None
