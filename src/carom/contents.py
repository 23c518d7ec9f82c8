"""From a scene to what the kernel has to know of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.obstacles import CylindricalContainer, Plane

if TYPE_CHECKING:
    from carom.kernel.scheme import Contents
    from carom.scene import Scene

CAUTIOUS = 1e-3
"""Normal speed, in thermal speeds, below which contacts are elastic in a scene with restitution below one."""


def conserved(scene: Scene) -> tuple[bool, ...]:
    """Tell for every axis whether the total momentum along it is conserved.

    Walls and obstacles take it up, but planes only along their normals and cylinders only across their axis;
    of an obstacle of one's own nothing is known. One component alone needs no exception: nothing is conserved
    that it does not have itself, and all its velocities are free.
    """
    if scene.n == 1:
        return (False,) * scene.dimension

    def glides(obstacle: Any, axis: int) -> bool:
        if isinstance(obstacle, Plane):
            return obstacle.normal[axis] == 0.0
        return isinstance(obstacle, CylindricalContainer) and obstacle.axis == axis

    return tuple(
        wraps and all(glides(obstacle, axis) for obstacle in scene.obstacles)
        for axis, wraps in enumerate(scene.periodic)
    )


def growth_rates(growth: Any, scene: Scene) -> np.ndarray | None:
    """Return the rate at which each radius grows, (n,), or None where nothing grows.

    Parameters
    ----------
    growth : None, float or (n,) array_like
        Rate at which diameters grow [length / time], not negative.
    scene : Scene
        What grows.

    Raises
    ------
    InputError
        If a rate is negative or not a number, or they are not one a component, or the scene has a contact
        matrix.
    """
    if growth is None:
        return None
    rates = np.asarray(growth, dtype=float) if np.ndim(growth) else None
    if rates is None:
        rates = np.full(scene.n, checks.number(growth, "growth", low=0.0))
    if rates.shape != (scene.n,) or not np.isfinite(rates).all() or (rates < 0.0).any():
        raise InputError(f"growth must be one rate, at least zero, or {scene.n} of them.")
    if scene.contact is not None:
        raise InputError("growth is not defined for a scene with a contact matrix; leave one of them out.")
    return 0.5 * rates if rates.any() else None


def contents_of(
    scene: Scene, rates: np.ndarray | None, thermal_speed: float, images: bool, single: bool
) -> Contents:
    """Return what the kernel has to know of a scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    rates : (n,) array or None
        Radius that each component gains a time.
    thermal_speed : float
        sqrt(kT / m) [length / time].
    images : bool
        Whether to count crossings of the box.
    single : bool
        Whether to keep the state in single precision.
    """
    from carom.kernel.scheme import Contents

    equal = scene.equal and rates is None
    threshold = scene.elastic_below
    if threshold is None:
        threshold = CAUTIOUS * thermal_speed
    largest = scene.diameter if scene.contact is None else float(scene.contact.max())
    return Contents(
        n=scene.n,
        box=scene.box,
        periodic=scene.periodic,
        diameter=largest,
        mass=scene.mass,
        radii=None if equal else 0.5 * scene.diameters,
        masses=None if equal else scene.masses,
        kinds=scene.species,
        contact=scene.contact,
        rates=rates,
        obstacles=tuple(obstacle.model() for obstacle in scene.obstacles),
        restitution=scene.restitution,
        threshold=threshold,
        images=images,
        single=single,
    )
