"""The obstacles, a file each; here their names in files, and functions for all of them.

No obstacle knows another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.interfaces.obstacle import Obstacle
from carom.models.obstacles.arcs import Arc
from carom.models.obstacles.balls import Ball
from carom.models.obstacles.blocks import Cuboid
from carom.models.obstacles.containers import CylindricalContainer, SphericalContainer
from carom.models.obstacles.named_walls import Wall
from carom.models.obstacles.planes import Plane, walls
from carom.models.obstacles.properties import Properties
from carom.models.obstacles.segments import Segment, polygon
from carom.models.obstacles.triangles import Triangle

__all__ = [
    "Arc",
    "Ball",
    "Cuboid",
    "CylindricalContainer",
    "Obstacle",
    "Plane",
    "Segment",
    "SphericalContainer",
    "Triangle",
    "Wall",
    "polygon",
    "walls",
]

#: The kinds by the names that scene files and checkpoints use.
KINDS: dict[str, type[Properties]] = {
    kind.type: kind
    for kind in (Plane, Ball, SphericalContainer, CylindricalContainer, Segment, Arc, Cuboid, Triangle)
}


def checked(
    obstacles: Any, box: Sequence[float], periodic: Sequence[bool], walls: Sequence[Plane] = ()
) -> tuple[Obstacle, ...]:
    """Return obstacles as the engine knows them: each can stand in the box, and draws its own random numbers.

    Before them are the planes that stand for ``walls`` with properties.
    """
    # Obstacles that move are met on parabolas, and these know the obstacles that rest.
    from carom.models.obstacles.with_properties import dressed

    if not isinstance(obstacles, Sequence) or isinstance(obstacles, str):
        raise InputError(f"obstacles must be a tuple of obstacles, found {checks.describe(obstacles)}.")
    standing: list[Obstacle] = []
    given = [*walls, *obstacles]
    known: set[type] = set()  # asking for a protocol takes longer than all else
    worn = [*map(dressed, given)]
    for k, (obstacle, value) in enumerate(zip(given, worn, strict=True), -len(walls)):
        if type(obstacle) not in known and (isinstance(obstacle, type) or not isinstance(obstacle, Obstacle)):
            raise InputError(
                f"Obstacle {k} must be one of {', '.join(c.__name__ for c in KINDS.values())}, or have name, "
                f"gap, check and model as they do; found {checks.describe(obstacle)}."
            )
        known.add(type(obstacle))
        value.check(box, periodic)
        drawing = getattr(value, "drawing_apart", None)
        standing.append(value if drawing is None else drawing(standing, worn))
    return tuple(standing)


def outwards(
    obstacle: Obstacle, positions: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
) -> np.ndarray:
    """Return the unit vectors (n, d) along which an obstacle or its nearest image throws components back."""
    model, d = obstacle.model(), len(box)
    x = np.array(positions, dtype=np.float64).reshape(-1, d)
    for axis in range(d):
        if periodic[axis] and model.is_periodic():
            x[:, axis] -= box[axis] * np.rint((x[:, axis] - model.anchor(axis)) / box[axis])
    return np.array([[model.outward(tuple(each), axis) for axis in range(d)] for each in x]).reshape(-1, d)
