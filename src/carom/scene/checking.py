"""What a scene refuses: overlaps, and values that cannot be simulated."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError, OverlapError
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry
from carom.models.contacts.rough import Rough, spin_axes
from carom.texts import axis_name


def refuse_both(kind: str, value: Any, keyword: str, given: bool) -> None:
    """Raise InputError if a value of one's own is given together with the keyword that it replaces."""
    if value is not None and given:
        raise InputError(f"{kind} and {keyword} say the same thing in two ways: leave one of them out.")


def refuse_pinned(pinned: np.ndarray | None, interaction: Any, motion: Any, contact: Any) -> None:
    """Raise InputError if components are pinned in a scene that is not of additive cores in free flight."""
    if pinned is None:
        return
    given = {
        "interaction": interaction is not None,
        "motion": motion is not None,
        "contact": contact is not None,
    }
    for name in (name for name, is_given in given.items() if is_given):
        raise InputError(f"pinned is for hard cores in free flight, and {name} is given: leave one out.")


def checked_velocities(
    velocities: Any, shape: tuple[int, ...], pinned: np.ndarray | None = None
) -> np.ndarray:
    """Return velocities of the shape of positions, checked, read-only."""
    result = checks.array(velocities, "velocities", "(n, d)", ndim=2)
    if result.shape != shape:
        raise InputError(f"velocities must have the shape of positions, {shape}, found {result.shape}.")
    fastest = float(np.abs(result).max())
    if fastest > checks.FASTEST:
        raise InputError(f"velocities must be at most {checks.FASTEST:g}, found {fastest:g}.")
    if pinned is not None and result[pinned].any():
        i = int(np.flatnonzero(pinned & result.any(axis=1))[0])
        raise InputError(f"Component {i} is pinned, and has a velocity: give it zero.")
    result.setflags(write=False)
    return result


def refuse_tight(room: Geometry, diameters: np.ndarray) -> None:
    """Raise InputError if the room that an obstacle leaves the largest component is too small.

    In a container it must be above rounding. A component touches the nearest image of an obstacle: not so
    where it may touch a slanting one from farther than half an edge.
    """
    largest = float(diameters.max())
    for container in room.obstacles:
        spread = _asked(container, "spread")
        widths = None if spread is None else spread()
        if widths is not None and container.model().is_periodic():
            for axis in np.flatnonzero(room.periodic):
                wide, edge = float(widths[axis]), float(room.box[axis])
                if wide + largest > edge:
                    raise InputError(
                        f"{container.name} is {wide:.6g} wide along {axis_name(int(axis))}, which is "
                        f"periodic with {edge:.6g}; expected room for the largest diameter ({largest:.6g}) "
                        "between it and its image. Give that axis walls, or enlarge the box."
                    )
        inside = _asked(container, "inside")
        if inside is None:
            continue
        width = inside(tuple(room.box))
        if width - largest <= overlaps.tolerance(room.box, largest):
            raise InputError(
                f"The inside of {container.name} must be wider than the largest diameter ({largest:.6g}), by "
                f"more than rounding: found a radius of {0.5 * width:.6g}. Enlarge it."
            )


def _asked(obstacle: Any, name: str) -> Any:
    """Return a method of an obstacle, or of the one that it covers or moves; None if there is none."""
    while obstacle is not None and not hasattr(obstacle, name):
        obstacle = getattr(obstacle, "obstacle", None)
    return getattr(obstacle, name, None)


def checked_spins(
    spins: Any, n: int, dimension: int, impact: Any, pinned: np.ndarray | None
) -> np.ndarray | None:
    """Return the spins of n particles, (n, 1) in the plane and (n, 3) in space, read-only; or None."""
    if spins is None:
        return None
    if not isinstance(impact, Rough):
        raise InputError(
            "spins are of rough particles: give impact=carom.models.Rough(...), or leave out spins."
        )
    shape = (n, spin_axes(dimension))
    found = np.array(spins, dtype=np.float64)
    if found.shape == (n,) and dimension == 2:
        found = found[:, None]
    if found.shape != shape or not (np.abs(found) <= checks.FASTEST).all():
        raise InputError(f"spins must be {shape} finite numbers, found {checks.describe(spins)}.")
    if pinned is not None and found[pinned].any():
        raise InputError("Pinned particles do not spin: set their spins to 0.")
    found.setflags(write=False)
    return found


def refuse_unlike(contacts: Contacts) -> None:
    """Raise InputError if some components touch so much nearer than others that digits are lost."""
    smallest, largest = contacts.extremes
    if smallest < checks.UNLIKE * largest:
        raise InputError(
            f"Some components touch at {smallest:.6g}, and others at {largest:.6g}; expected at least "
            f"{checks.UNLIKE:.2g} of the largest distance, because doubles cannot tell whether nearer ones "
            "meet. Make the diameters, or the contact distances, more alike."
        )


def refuse_overlap(
    places: np.ndarray, room: Geometry, contacts: Contacts, interaction: Any, pinned: np.ndarray | None = None
) -> None:
    """Raise OverlapError if a sphere overlaps a wall, an obstacle, or a sphere that it must not overlap."""
    radii = 0.5 * contacts.diameters
    inside = overlaps.intruder(places, room, radii if pinned is None else np.where(pinned, 0.0, radii))
    if inside is not None:
        center = ", ".join(f"{x:.6g}" for x in places[inside.i])
        raise OverlapError(f"{inside}, with its center at {center}. Move it out.")
    if getattr(interaction, "penetrable", False):
        return
    overlap = overlaps.deepest(places, room, contacts, pinned)
    if overlap is None:
        return
    largest = float(contacts.diameters.max())
    # Rounded to six digits, and not up: this diameter is to be typed.
    touching = largest * overlap.distance / overlap.contact * (1.0 - 5e-6)
    smaller = f"smaller diameters (these two touch if the largest is {touching:.6g}, now {largest:.6g}), "
    raise OverlapError(
        f"{overlap}. Take {smaller if touching else ''}other positions, or a start from Scene.random(...) or "
        "a lattice."
    )
