"""From a scene to the facts that the engine needs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.densities import CLOSEST_PACKING
from carom.errors import InputError
from carom.models import model_checks
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.interactions.growing_cores import Growing
from carom.models.mathematics.parabolas import time_to_moving
from carom.models.motions.shear import Shear
from carom.models.obstacles import faces
from carom.models.obstacles.box_walls import cushions
from carom.models.obstacles.dressing import Dressed
from carom.models.obstacles.wall_names import wall_name
from carom.models.questions.obstacle import fall, meeting
from carom.models.questions.walls import wall_meeting
from carom.scene.fields import is_elastic, is_equal, is_simple, standing
from carom.scene.velocities import Thermal, thermal_of
from carom.simulation.tuning import DEFAULT, Tuning
from carom.units import TimeUnit

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

LEAST_ENERGY, MOST_ENERGY = 1e-304, 1e304
"""Temperatures must not be below the one, nor kinetic energies above the other: as doubles they have all
their digits, with some room for their products.
"""

STEEPEST = 2.0**43
"""Height of steps over kT, at most: a sum of both is then rounded by a thousandth of kT."""

SINGLE = 2.0**-23  # spacing of single precision at 1

COARSEST = 2.0**-6  # part of a diameter, or of the speeds, that single precision may round off

SLOWEST_GROWTH = 2.0**-512
"""Growth of diameters over speeds, about, below which nothing grows by a digit, and quotients overflow."""


def driven_speed_of(scene: Scene) -> float:
    """Return a speed that motion, a drive, or what moves gives to components that rest [length / time]."""
    paces = [float(each.fastest) for each in standing(scene) if hasattr(each, "fastest")]
    if hasattr(scene.motion, "pace"):
        paces.append(float(scene.motion.pace(scene.diameter)))
    if scene.drive is not None and hasattr(scene.drive, "pace"):
        paces.append(float(scene.drive.pace(scene)))
    return max(paces, default=0.0)


def unit_of(scene: Scene, velocities: np.ndarray, rates: np.ndarray | None) -> tuple[TimeUnit, Thermal]:
    """Return the engine's unit of time, and what is thermal of velocities (n, d) in that unit."""
    fastest = float(np.abs(velocities).max())
    others = 0.0 if rates is None else 2.0 * float(rates.max())
    unit = TimeUnit.of(max(fastest, others, driven_speed_of(scene)), scene.diameter)
    v = unit.to_kernel(velocities, -1)
    twice = unit.to_scene(float(np.sum(scene.masses[:, None] * v * v)), -2)
    slowest = unit.to_scene(SLOWEST_GROWTH, -1)
    thermal = thermal_of(scene, v)
    if fastest > 0.0 and not (LEAST_ENERGY * thermal.degrees_of_freedom <= twice <= MOST_ENERGY):
        raise InputError(
            f"Velocities of up to {fastest:g} make a kinetic energy of {0.5 * twice:g}; expected between "
            f"{LEAST_ENERGY:g} a degree of freedom and {MOST_ENERGY:g} in all, or rest, to keep all "
            "digits: choose another unit of time or of mass."
        )
    if others > 0.0 and not others >= slowest:
        raise InputError(
            f"Diameters that grow at {others:g} do not grow beside speeds of {fastest:g} or more; "
            "leave out growth, or let them grow faster."
        )
    return unit, thermal


def slow_speed_of(scene: Scene, thermal: Thermal, rates: np.ndarray | None, unit: TimeUnit) -> float:
    """Return the speed of which contacts that lose energy take a part as their threshold [length / time].

    It is the thermal one, or where nothing moves yet that which motion, what moves, or growth gives to
    particles at rest. ``thermal`` is in the engine's unit of time.
    """
    speed = unit.to_scene(math.sqrt(thermal.kT / scene.mass), -1)
    if isinstance(scene.motion, Shear):  # a cold start is heated by the stream
        speed = max(speed, driven_speed_of(scene))
    if speed == 0.0:
        speed = max(driven_speed_of(scene), 0.0 if rates is None else 2.0 * float(rates.max()))
    return speed


def losses_at(scene: Scene, speed: float) -> dict[str, Any]:
    """Return impact and obstacles with the thresholds of a thermal ``speed``; those that have one keep it."""
    impact = scene.impact
    return {
        "impact": impact.at(speed) if isinstance(impact, Restitution) else impact,
        "obstacles": tuple(
            each.at(speed) if isinstance(each, Dressed) else each if hasattr(each, "live") else each.model()
            for each in standing(scene)
        ),
    }


def thresholds_of(system: System) -> list[float]:
    """Return the threshold of each restitution, of pairs, then obstacles [length / time]; 0 without one."""
    laws = (system.impact, *(getattr(each, "loss", None) for each in system.obstacles))
    return [float(getattr(law, "elastic_below", None) or 0.0) for law in laws]


def with_thresholds(system: System, thresholds: Sequence[float]) -> System:
    """Return the system of a scene with the thresholds of an earlier one: of a file."""
    if len(thresholds) != 1 + len(system.obstacles):
        raise ValueError(f"it has {len(thresholds)} thresholds for {len(system.obstacles)} obstacles")
    impact, obstacles = system.impact, list(system.obstacles)
    if isinstance(impact, Restitution):
        impact = impact.below(thresholds[0])
    for k, each in enumerate(obstacles):
        if isinstance(each, Dressed) and isinstance(each.loss, Restitution):
            obstacles[k] = dataclasses.replace(each, loss=each.loss.below(thresholds[1 + k]))
    return dataclasses.replace(system, impact=impact, obstacles=tuple(obstacles))


def growth_rates(growth: Any, scene: Scene) -> np.ndarray | None:
    """Return each radius's rate, (n,), from those of diameters [length / time]; None without growth."""
    if growth is None:
        return None
    rates = checks.array(growth, "growth", "(n,)", ndim=1) if checks.several(growth) else None
    if rates is None:
        rates = np.full(scene.n, checks.number(growth, "growth", low=0.0, high=checks.FASTEST))
    if rates.shape != (scene.n,) or not ((rates >= 0.0) & (rates <= checks.FASTEST)).all():
        raise InputError(
            f"growth must be one rate, at least zero and at most {checks.FASTEST:g}, or {scene.n} of them."
        )
    if scene.pinned is not None:
        raise InputError("growth is not defined for a scene with pinned components; leave one of them out.")
    if scene.contact is not None:
        raise InputError("growth is not defined for a scene with a contact matrix; leave one of them out.")
    if isinstance(scene.impact, Rough):
        raise InputError("growth is not defined for rough particles, which spin; leave one of them out.")
    if model_checks.is_own(scene.interaction) and rates.any():
        raise InputError(
            f"growth is of Carom's hard cores, and the interaction is a {type(scene.interaction).__name__}, "
            "which would be replaced by them; leave one of them out."
        )
    rates = 0.5 * rates
    return rates if rates.any() else None


def refuse_steep(system: System, thermal: Thermal) -> None:
    """Raise InputError if steps are so high that a crossing leaves no digit of a thermal energy."""
    if not system.stepped:
        return
    energies = np.asarray(getattr(system.interaction.model(system.particles), "energy", 0.0))
    finite = energies[np.isfinite(energies)]
    height, energy = float(np.ptp(finite)), thermal.kT + system.mass * thermal.drift**2
    if 0.0 < STEEPEST * energy < height:
        height, energy = (system.unit.to_scene(each, -2) for each in (height, energy))
        raise InputError(
            f"Steps of pairs are {height:.3g} high, where kT is {energy:.3g}; expected at most "
            f"{STEEPEST:.2g} kT, because a double cannot hold both energies. Use math.inf for a hard core or "
            "a bond, lower the steps, or let the components move faster."
        )


def single_allowed(precision: str, scene: Scene, thermal: Thermal, unit: TimeUnit) -> bool:
    """Tell whether a scene is kept in single precision, as asked; ``thermal`` is in ``unit``."""
    if precision == "double":
        return False
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
    return True


def refuse_with_steps(scene: Scene, rates: np.ndarray | None, single: bool) -> None:
    """Raise InputError where something is asked for that is not defined for pairs on steps."""
    for name, given, instead in (
        ("growth", rates is not None, "leave it out"),
        ("precision='single'", single, "leave it out"),
        ("impact", not is_elastic(scene), "give hysteretic steps"),
    ):
        if given:
            raise InputError(f"{name} is not for pairs on steps (SquareWell, ...): {instead}.")


def refuse_drive(system: System, scene: Scene) -> None:
    """Raise InputError where a drive cannot kick the components of a scene."""
    name = type(scene.drive).__name__
    if getattr(scene.interaction, "decides", False):
        raise InputError(f"{name} kicks units whose velocities their rules decide; leave out one of them.")
    if system.curved:
        raise InputError(
            f"{name} kicks along every axis, and {type(scene.motion).__name__} keeps components on a surface "
            "that they would leave; leave out one of them."
        )


def check_meetings(system: System, scene: Scene) -> None:
    """Raise InputError where components cannot meet walls or obstacles in their motion.

    Where obstacles move, components may neither grow nor be in single precision.
    """
    model = system.motion.model(system.particles)
    bends = not system.straight
    fixed = system.walls is not None or system.obstacles
    meets = model_checks.answers(meeting, model)
    meets &= system.walls is None or model_checks.answers(wall_meeting, model)
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


def walls_of(scene: Scene) -> Any:
    """Return what the engine compiles for the walls of the box, or None where there are none."""
    fixed = standing(scene), scene.box, scene.periodic
    replaced = faces.stand_ins(*fixed)
    return cushions(scene.box, scene.periodic, replaced, faces.yielding(*fixed) - {*replaced})


def refuse_own_walls(system: System, scene: Scene) -> None:
    """Raise InputError if an own motion meets all walls, and an obstacle stands for one or lies in it."""
    if not model_checks.is_own(scene.motion):
        return
    model = system.motion.model(system.particles)
    fixed = standing(scene), scene.box, scene.periodic
    found = [*faces.stand_ins(*fixed), *faces.yielding(*fixed)]
    if found and model_checks.answers(wall_meeting, model):
        raise InputError(
            f"An obstacle is at the wall {wall_name(*found[0])}, and {type(scene.motion).__name__} answers "
            "wall_meeting for all walls of the box: move the obstacle away from the wall."
        )


def _falls(model: Any) -> bool:
    """Tell whether an obstacle is met on parabolas, whatever its surface and however it moves."""
    while hasattr(model, "body"):
        model = model.body
    return model_checks.answers(fall, model) or model_checks.answers(time_to_moving, model)


def prepare(
    scene: Scene,
    velocities: np.ndarray,
    *,
    growth: Any = None,
    tuning: Tuning = DEFAULT,
) -> System:
    """Return what the engine has to know of a scene with velocities (n, d) [length / time]."""
    rates = growth_rates(growth, scene)
    unit, thermal = unit_of(scene, velocities, rates)
    single = single_allowed(tuning.precision, scene, thermal, unit)
    return system_of(scene, thermal, rates, tuning.images, single, unit)


def system_of(
    scene: Scene, thermal: Thermal, rates: np.ndarray | None, images: bool, single: bool, unit: TimeUnit
) -> System:
    """Return what the engine has to know of a scene; ``thermal`` is in ``unit``, ``rates`` are of radii."""
    from carom.engine.system import System

    interaction = scene.interaction if rates is None else Growing()
    if hasattr(scene.interaction, "steps"):
        refuse_with_steps(scene, rates, single)
    by_radii = getattr(interaction, "by_radii", False)
    equal = is_equal(scene) and rates is None and by_radii
    system = System(
        n=scene.n,
        box=scene.box,
        periodic=scene.periodic,
        diameter=model_checks.contact_range_of(interaction, scene),
        mass=scene.mass,
        interaction=interaction,
        motion=scene.motion,
        **losses_at(scene, slow_speed_of(scene, thermal, rates, unit)),
        walls=walls_of(scene),
        unit=unit,
        radii=None if equal else 0.5 * scene.diameters,
        masses=None if equal else scene.masses,
        kinds=scene.species,
        contact=scene.contact,
        by_radii=by_radii,
        rates=None if rates is None else unit.to_kernel(rates, -1),
        still=thermal.conserved,
        driven_speed=unit.to_kernel(driven_speed_of(scene), -1),
        images=images,
        single=single,
        drive=scene.drive,
        pinned=scene.pinned,
        spins=None if scene.spins is None else unit.to_kernel(scene.spins, -1),
    )
    rough = next((each for each in standing(scene) if isinstance(getattr(each, "loss", None), Rough)), None)
    if rough is not None and not isinstance(scene.impact, Rough):
        raise InputError(
            f"The surface of {rough.name} is rough, and the particles do not spin: give the scene "
            "impact=Rough(...); with tangential=-1 their own contacts are smooth."
        )
    if system.drive is not None:
        refuse_drive(system, scene)
    if system.curved and single:
        raise InputError(
            f"precision='single' is for straight flight, and {type(scene.motion).__name__} bends: "
            "leave it out."
        )
    if not system.straight or any(hasattr(each, "live") for each in standing(scene)):
        check_meetings(system, scene)
    refuse_own_walls(system, scene)
    refuse_steep(system, thermal)
    return system
