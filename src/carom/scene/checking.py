"""What a scene refuses: overlaps, and values that cannot be simulated."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError, OverlapError
from carom.models.obstacles import CylindricalContainer, SphericalContainer
from carom.scene import box, overlaps
from carom.scene.overlaps import Room
from carom.scene.species import Contacts


def elasticity(restitution: Any, elastic_below: Any) -> tuple[float, float | None]:
    """Return both, checked: a threshold of zero where collisions are elastic anyway, None for the default."""
    part = checks.number(restitution, "restitution", low=0, high=1, open_low=True)
    if elastic_below is None:
        return part, 0.0 if part == 1 else None
    speed = checks.number(elastic_below, "elastic_below", low=0, high=checks.FASTEST)
    if part == 1 and speed > 0:
        raise InputError("elastic_below has no meaning where restitution is 1; remove it.")
    if part < 1 and speed == 0:
        raise InputError(
            "elastic_below must be positive where restitution is below 1: else spheres collide infinitely "
            "often in a finite time. Leave it out for 1e-3 of the thermal speed."
        )
    return part, speed


def speeds(velocities: Any, shape: tuple[int, ...]) -> np.ndarray:
    """Return velocities of the shape of positions, checked, read-only."""
    result = checks.array(velocities, "velocities", "(n, d)", ndim=2)
    if result.shape != shape:
        raise InputError(f"velocities must have the shape of positions, {shape}, found {result.shape}.")
    fastest = float(np.abs(result).max())
    if fastest > checks.FASTEST:
        raise InputError(f"velocities must be at most {checks.FASTEST:g}, found {fastest:g}.")
    result.setflags(write=False)
    return result


def refuse_tight(room: Room, diameters: np.ndarray) -> None:
    """Raise InputError where a container leaves its largest component no room that coordinates can tell."""
    largest = float(diameters.max())
    for container in room.obstacles:
        if not isinstance(container, SphericalContainer | CylindricalContainer):
            continue
        if 2.0 * container.radius - largest <= overlaps.tolerance(room.box, largest):
            raise InputError(
                f"The inside of {container.name} must be wider than the largest diameter ({largest:.6g}), by "
                f"more than rounding: found a radius of {container.radius:.6g}. Enlarge it."
            )


def refuse_overlap(places: np.ndarray, room: Room, contacts: Contacts) -> None:
    """Raise OverlapError where two spheres overlap, or one an obstacle or a wall."""
    inside = overlaps.intruder(places, room, 0.5 * contacts.diameters)
    if inside is not None:
        i, obstacle, depth = inside
        raise OverlapError(
            f"sphere {i} is inside an obstacle, {obstacle.name}, by {depth:.3g} (diameter "
            f"{contacts.diameters[i]:.6g}, center {', '.join(f'{x:.6g}' for x in places[i])}). Move it out."
        )
    overlap = overlaps.deepest(places, room, contacts)
    if overlap is None:
        return
    # As many decimals as show the depth with three digits.
    digits = min(17, max(4, 3 - math.floor(math.log10(overlap.depth / overlap.contact))))
    start = "Scene.random(...)" if len(contacts.classes) == 1 else "Scene.mixture(...)"
    raise OverlapError(
        f"spheres {overlap.i} and {overlap.j} overlap by {overlap.depth:.3g} "
        f"(distance {overlap.distance:#.{digits}g}, contact {overlap.contact:#.{digits}g}). "
        f"Start from {start} or a lattice, or lower packing_fraction "
        f"(now {box.packing_fraction(contacts.diameters, tuple(room.box)):.3f})."
    )
