"""What a scene cannot have together, or not in the precision that is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from carom.densities import CLOSEST_PACKING
from carom.errors import InputError
from carom.models import model_checks
from carom.models.contacts.rough import Rough
from carom.scene.fields import is_elastic, is_simple, standing
from carom.scene.velocities import Thermal
from carom.units import TimeUnit

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

STEEPEST = 2.0**43
"""Height of steps over kT, at most: a sum of both is then rounded by a thousandth of kT."""

SINGLE = 2.0**-23  # spacing of single precision at 1

COARSEST = 2.0**-6  # part of a diameter, or of the speeds, that single precision may round off


def refuse(system: System, thermal: Thermal) -> None:
    """Raise InputError where parts of a scene do not go together; ``thermal`` is in the engine's unit."""
    scene: Any = system.scene
    if system.single:
        refuse_single(scene, thermal, system.unit)
    if hasattr(scene.interaction, "steps"):  # growth would replace it
        refuse_with_steps(scene, system.rates, system.single)
        refuse_steep(system, thermal)
    if system.rates is not None:
        model_checks.check_copy_state(system)
    refuse_rough(scene)
    if system.scene.drive is not None:
        refuse_drive(system, scene)
    if system.curved and system.single:
        raise InputError(
            f"precision='single' is for straight flight, and {type(scene.motion).__name__} bends: "
            "leave it out."
        )
    if not system.straight or any(hasattr(each, "live") for each in standing(scene)):
        check_meetings(system, scene)


def refuse_single(scene: Scene, thermal: Thermal, unit: TimeUnit) -> None:
    """Raise InputError if single precision loses a scene's digits; ``thermal`` is in ``unit``."""
    otherwise = "leave out precision='single'."
    rounding = 16.0 * SINGLE * max(scene.box)  # what flights through the box leave, as measured
    smallest = float(scene.diameters.min())
    if rounding > COARSEST * smallest:
        raise InputError(
            f"Single precision leaves overlaps of {rounding / smallest:.2g} diameters in a box of "
            f"{max(scene.box) / smallest:.6g}; expected an edge of at most {COARSEST / (16.0 * SINGLE):.6g} "
            f"diameters, or {otherwise}"
        )
    d = scene.dimension
    if is_simple(scene) and d in CLOSEST_PACKING:
        gap = 1.0 - min(scene.packing_fraction / CLOSEST_PACKING[d], 1.0) ** (1.0 / d)
        if gap * scene.diameter < rounding:
            raise InputError(
                f"This near to close packing gaps are {gap:.2g} diameters wide, and single precision rounds "
                f"positions by {rounding / scene.diameter:.2g}; lower packing_fraction (now "
                f"{scene.packing_fraction:.9g}), or {otherwise}"
            )
    drift, fastest = thermal.drift, float(np.abs(thermal.peculiar).max())
    if scene.n > 1 and SINGLE * drift > COARSEST * fastest:
        drift, fastest = unit.to_scene(drift, -1), unit.to_scene(fastest, -1)
        raise InputError(
            f"All components drift at {drift:.3g}, and at most at {fastest:.3g} relative to that, which "
            f"single precision loses: take the drift out of the velocities, or {otherwise}"
        )


def refuse_with_steps(scene: Scene, rates: np.ndarray | None, single: bool) -> None:
    """Raise InputError where something is asked for that is not defined for pairs on steps."""
    for name, given, instead in (
        ("growth", rates is not None, "leave it out"),
        ("precision='single'", single, "leave it out"),
        ("impact", not is_elastic(scene), "give hysteretic steps"),
    ):
        if given:
            raise InputError(f"{name} is not for pairs on steps (SquareWell, ...): {instead}.")


def refuse_steep(system: System, thermal: Thermal) -> None:
    """Raise InputError if steps are so high that a crossing leaves no digit of a thermal energy."""
    energies = np.asarray(getattr(system.pair, "energy", 0.0))
    finite = energies[np.isfinite(energies)]
    height, energy = float(np.ptp(finite)), thermal.kT + system.scene.mass * thermal.drift**2
    if 0.0 < STEEPEST * energy < height:
        height, energy = (system.unit.to_scene(each, -2) for each in (height, energy))
        raise InputError(
            f"Steps of pairs are {height:.3g} high, where kT is {energy:.3g}; expected at most "
            f"{STEEPEST:.2g} kT, because a double cannot hold both energies. Use math.inf for a hard core or "
            "a bond, lower the steps, or let the components move faster."
        )


def refuse_rough(scene: Scene) -> None:
    """Raise InputError if a surface is rough and the particles do not spin."""
    rough = next((each for each in standing(scene) if isinstance(getattr(each, "loss", None), Rough)), None)
    if rough is not None and not isinstance(scene.impact, Rough):
        raise InputError(
            f"The surface of {rough.name} is rough, and the particles do not spin: give the scene "
            "impact=Rough(...); with tangential=-1 their own contacts are smooth."
        )


def refuse_drive(system: System, scene: Scene) -> None:
    """Raise InputError where a drive cannot kick the components of a scene."""
    name = type(scene.drive).__name__
    if getattr(scene.interaction, "decides", False):
        raise InputError(f"{name} kicks units whose velocities their rules decide; leave out one of them.")
    if system.curved:
        raise InputError(
            f"{name} kicks along every axis, and {type(scene.motion).__name__} is curved: a kick could "
            "lead off the paths that it knows; leave out one of them."
        )


def check_meetings(system: System, scene: Scene) -> None:
    """Raise InputError where components cannot meet walls or obstacles in their motion.

    Where obstacles move, components may neither grow nor be in single precision.
    """
    model = system.motion.model(system.particles)
    bends = not system.straight
    fixed = system.walls is not None or system.obstacles
    meets = model_checks.answers("meeting", model)
    meets &= system.walls is None or model_checks.answers("wall_meeting", model)
    if bends and fixed and not meets:
        raise InputError(
            f"Walls and obstacles are met in straight flight only, and {type(scene.motion).__name__} bends: "
            "make all axes periodic and leave out obstacles, or answer meeting and wall_meeting."
        )
    if system.single:
        raise InputError(
            "Single precision is for straight flight between obstacles that rest; leave out "
            "precision='single'."
        )
    for value, each in zip(standing(scene), system.obstacle_models, strict=True):
        if system.rates is not None and hasattr(value, "live"):
            raise InputError(f"growth is not defined where {value.name} moves or loses energy; leave it out.")
        if bends and not _falls(each):
            raise InputError(
                f"{value.name} is met in straight flight only: give {type(each).__name__} a method "
                "closest, or fall (docs/models.md)."
            )


def _falls(model: Any) -> bool:
    """Tell whether an obstacle is met on parabolas, whatever its surface and however it moves."""
    while hasattr(model, "body"):
        model = model.body
    return model_checks.answers("fall", model) or model_checks.answers("time_to_moving", model)
