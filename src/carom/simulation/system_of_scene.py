"""From a scene to the facts that the engine needs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import model_checks
from carom.models.contacts.restitution import Restitution
from carom.models.contacts.rough import Rough
from carom.models.interactions.growing_cores import Growing
from carom.models.motions.shear import Shear
from carom.models.obstacles import faces
from carom.models.obstacles.with_properties import Dressed
from carom.scene.fields import is_equal, own_models, standing
from carom.scene.velocities import Thermal, thermal_of
from carom.simulation.refusals import refuse
from carom.simulation.tuning import DEFAULT, Tuning
from carom.units import TimeUnit

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

LEAST_ENERGY, MOST_ENERGY = 1e-304, 1e304
"""Temperatures must not be below the one, nor kinetic energies above the other: as doubles they have all
their digits, with some room for their products.
"""

SLOWEST_GROWTH = 2.0**-512
"""Growth of diameters over speeds, about, below which nothing grows by a digit, and quotients overflow."""


def driven_speed_of(scene: Scene) -> float:
    """Return a speed that motion, a drive, or what moves gives to components that rest [length / time]."""
    paces = [float(each.fastest) for each in standing(scene) if hasattr(each, "fastest")]
    if hasattr(scene.motion, "pace"):
        paces.append(float(scene.motion.pace(scene.diameter)))
    if scene.drive is not None and hasattr(scene.drive, "pace"):
        name = f"pace(scene) of {type(scene.drive).__name__}"
        paces.append(checks.number(scene.drive.pace(scene), name, low=0.0))
    return max(paces, default=0.0)


class Speeds(NamedTuple):
    """How fast components move, from which a run takes its unit of time."""

    scene: Scene
    unit: TimeUnit
    thermal: Thermal  # in ``unit``
    driven: float  # of components that rest, by :func:`driven_speed_of` [length / time]
    growth: float  # of the diameters, at most [length / time]

    @property
    def slow(self) -> float:
        """The speed of which contacts that lose energy take a part as their threshold [length / time].

        It is the thermal one, or where nothing moves yet that which motion, what moves, or growth gives to
        particles at rest.
        """
        speed = self.unit.to_scene(math.sqrt(self.thermal.kT / self.scene.mass), -1)
        if isinstance(self.scene.motion, Shear):  # a cold start is heated by the stream
            speed = max(speed, self.driven)
        return speed or max(self.driven, self.growth)


def speeds_of(
    scene: Scene, velocities: np.ndarray, rates: np.ndarray | None, unit: TimeUnit | None = None
) -> Speeds:
    """Return the speeds of velocities (n, d) and of radii (n,) that grow, for a run or its ``unit``."""
    driven, growth = driven_speed_of(scene), 0.0 if rates is None else 2.0 * float(rates.max())
    if unit is not None:
        return Speeds(scene, unit, thermal_of(scene, unit.to_kernel(velocities, -1)), driven, growth)
    fastest = float(np.abs(velocities).max())
    unit = TimeUnit.of(max(fastest, growth, driven), scene.diameter)
    v = unit.to_kernel(velocities, -1)
    twice = unit.to_scene(float(np.sum(scene.masses[:, None] * v * v)), -2)
    thermal = thermal_of(scene, v)
    if fastest > 0.0 and not (LEAST_ENERGY * thermal.degrees_of_freedom <= twice <= MOST_ENERGY):
        raise InputError(
            f"Velocities of up to {fastest:g} make a kinetic energy of {0.5 * twice:g}; expected between "
            f"{LEAST_ENERGY:g} a degree of freedom and {MOST_ENERGY:g} in all, or rest, to keep all "
            "digits: choose another unit of time or of mass."
        )
    if 0.0 < growth < unit.to_scene(SLOWEST_GROWTH, -1):
        raise InputError(
            f"Diameters that grow at {growth:g} do not grow beside speeds of {fastest:g} or more; "
            "leave out growth, or let them grow faster."
        )
    return Speeds(scene, unit, thermal, driven, growth)


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


def prepare(
    scene: Scene,
    velocities: np.ndarray,
    *,
    growth: Any = None,
    tuning: Tuning = DEFAULT,
    currents: bool = False,
) -> System:
    """Return what the engine has to know of a scene with velocities (n, d), whose own models are tried."""
    rates = growth_rates(growth, scene)
    chosen = {"images": tuning.images, "single": tuning.precision == "single", "currents": currents}
    system = system_of(speeds_of(scene, velocities, rates), rates, **chosen)
    if any(own := own_models(scene)):
        from carom.simulation.model_validation.own_models import try_own_models

        try_own_models(*own, scene, system)
    return system


def system_of(speeds: Speeds, rates: np.ndarray | None, *, stage: int = 0, **chosen: Any) -> System:
    """Return what the engine has to know of a scene whose radii grow at ``rates`` [length / time].

    ``stage`` is that of a shear that oscillates; ``chosen`` are fields of the system.
    """
    from carom.engine.system import System

    scene, unit = speeds.scene, speeds.unit
    interaction = scene.interaction if rates is None else Growing()
    by_radii = getattr(interaction, "by_radii", False)
    system = System(
        scene=scene,
        unit=unit,
        interaction=interaction,
        motion=scene.motion.in_stage(stage) if isinstance(scene.motion, Shear) else scene.motion,
        diameter=model_checks.contact_range_of(interaction, scene),
        walls=faces.hard_walls(standing(scene), scene.box, scene.periodic),
        radii=None if is_equal(scene) and rates is None and by_radii else 0.5 * scene.diameters,
        rates=None if rates is None else unit.to_kernel(rates, -1),
        still=speeds.thermal.conserved,
        driven_speed=unit.to_kernel(speeds.driven, -1),
        **losses_at(scene, speeds.slow),
        **chosen,
    )
    refuse(system, speeds.thermal)
    return system
