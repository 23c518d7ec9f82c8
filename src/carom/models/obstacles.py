"""The obstacles, by their names in files, and functions for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, asdict, fields
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import tables
from carom.models.arcs import Arc
from carom.models.balls import Ball
from carom.models.blocks import Box
from carom.models.containers import CylindricalContainer, SphericalContainer
from carom.models.interface import Obstacle, anchor, outward, repeated
from carom.models.planes import Plane, walls
from carom.models.segments import Segment, polygon
from carom.models.triangles import Triangle

__all__ = [
    "Arc",
    "Ball",
    "Box",
    "CylindricalContainer",
    "Obstacle",
    "Plane",
    "Segment",
    "SphericalContainer",
    "Triangle",
    "polygon",
    "walls",
]

#: The kinds by the names that scene files and checkpoints use.
KINDS: dict[str, type] = {
    "plane": Plane,
    "ball": Ball,
    "sphere": SphericalContainer,
    "cylinder": CylindricalContainer,
    "segment": Segment,
    "arc": Arc,
    "box": Box,
    "triangle": Triangle,
}


def checked(obstacles: Any, box: Sequence[float], periodic: Sequence[bool]) -> tuple[Obstacle, ...]:
    """Return obstacles as a tuple, each of which can stand in the box.

    Raises
    ------
    InputError
        If one is no obstacle, or does not fit the box.
    """
    if not isinstance(obstacles, Sequence) or isinstance(obstacles, str):
        raise InputError(f"obstacles must be a tuple of obstacles, found {checks.describe(obstacles)}.")
    for k, obstacle in enumerate(obstacles):
        if isinstance(obstacle, type) or not isinstance(obstacle, Obstacle):
            raise InputError(
                f"Obstacle {k} must be one of {', '.join(c.__name__ for c in KINDS.values())}, or have name, "
                f"gap, check and model as they do; found {checks.describe(obstacle)}."
            )
        obstacle.check(box, periodic)
    return tuple(obstacles)


def to_json(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as values that JSON and TOML hold; of a class of one's own only its name."""
    for kind, known in KINDS.items():
        if type(obstacle) is known:
            return {"kind": kind, **asdict(obstacle)}  # type: ignore[call-overload]
    if hasattr(obstacle, "to_table") and tables.holds(obstacle):
        return tables.to_table(obstacle, "obstacle")
    return {"kind": "own", "class": type(obstacle).__name__, "name": obstacle.name}


def from_json(values: Any) -> Obstacle:
    """Return the obstacle of :func:`to_json`.

    Raises
    ------
    InputError
        If it is of a class of one's own, of an unknown kind, or a value is missing, unknown or wrong.
    """
    if not isinstance(values, dict):
        raise InputError(f"An obstacle must be a table, found {checks.describe(values)}.")
    kind = values.get("kind")
    if kind == "own":
        raise InputError(
            f"The obstacle {values.get('name')} is of the class {values.get('class')}, which no file holds; "
            "give all obstacles, obstacles=[...], where the file is loaded."
        )
    if kind in tables.KINDS["obstacle"]:
        return tables.from_table(values, "obstacle", "kind")
    if kind not in KINDS:
        raise InputError(
            f"kind of an obstacle must be one of {', '.join((*KINDS, *tables.KINDS['obstacle']))}; found "
            f"{checks.describe(kind)}."
        )
    known = {f.name: f for f in fields(KINDS[kind])}
    given = {key: value for key, value in values.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"A {kind} has no {key[:40]!r}; known are {', '.join(known)}.")
    for key in known:
        if key not in given and known[key].default is MISSING:
            raise InputError(f"A {kind} needs {key}, found none.")
    return KINDS[kind](**given)


def outwards(
    obstacle: Obstacle, positions: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
) -> np.ndarray:
    """Return the unit vectors (n, d) along which an obstacle or its nearest image throws components back."""
    model, d = obstacle.model(), len(box)
    x = np.array(positions, dtype=np.float64).reshape(-1, d)
    for axis in range(d):
        if periodic[axis] and repeated(model):
            x[:, axis] -= box[axis] * np.rint((x[:, axis] - anchor(model, axis)) / box[axis])
    return np.array([[outward(model, tuple(each), axis) for axis in range(d)] for each in x]).reshape(-1, d)
