"""A scene as arrays and as values that JSON holds, for checkpoints and event logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.models import model_checks
from carom.models.drives import Drive
from carom.models.files import parameters, tables, to_tables
from carom.models.obstacles import Obstacle
from carom.models.questions.contact import Impact
from carom.models.questions.interaction import Interaction
from carom.models.questions.motion import Motion
from carom.scene.fields import is_elastic, is_usual
from carom.scene.scene import Scene


def to_arrays(scene: Scene) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return a scene as arrays and as values that JSON holds, by name, for :func:`from_arrays`."""
    arrays = {"positions": scene.positions}
    attributes: dict[str, Any] = {
        "box": list(scene.box),
        "walls": to_tables.walls_to_table(scene.walls),
        "obstacles": [to_tables.obstacle_to_table(o) for o in scene.obstacles],
        "species_names": list(scene.species_names),
    }
    for kind in model_checks.USUAL:
        if not (is_elastic(scene) if kind == "impact" else is_usual(scene, kind)):
            value = getattr(scene, kind)  # files hold no code
            attributes[kind] = (
                value.to_table() if to_tables.holds(value) else parameters.class_and_parameters(value)
            )
    if scene.drive is not None:
        holds = to_tables.holds(scene.drive)
        attributes["drive"] = (
            to_tables.to_table(scene.drive, "drive")
            if holds
            else parameters.class_and_parameters(scene.drive)
        )
    for name, values in (("diameter", scene.diameters), ("mass", scene.masses)):
        if np.ptp(values) == 0:
            attributes[name] = float(values[0])
        else:
            arrays[name] = values
    for name in ("velocities", "spins", "species", "contact"):
        if getattr(scene, name) is not None:
            arrays[name] = getattr(scene, name)
    if scene.pinned is not None:
        arrays["pinned"] = np.flatnonzero(scene.pinned)
    return arrays, attributes


def from_arrays(
    arrays: Mapping[str, np.ndarray],
    attributes: Mapping[str, Any],
    *,
    obstacles: Sequence[Obstacle] | None = None,
    interaction: Interaction | None = None,
    motion: Motion | None = None,
    impact: Impact | None = None,
    drive: Drive | None = None,
) -> Scene:
    """Return the scene that :func:`to_arrays` took apart, bit for bit.

    Parameters
    ----------
    arrays, attributes : mappings
        What :func:`to_arrays` returned; other arrays are ignored.
    obstacles : sequence of obstacles, optional
        All obstacles, in order; needed if one is of your own class, because a file holds no code.
    interaction, motion, impact, drive : values, optional
        Needed if one is of your own class.
    """
    try:
        kept = attributes["obstacles"]
        if obstacles is None:
            obstacles = tuple(tables.obstacle_from_table(each) for each in kept)
        elif len(obstacles) != len(kept):
            raise InputError(f"The scene has {len(kept)} obstacles, found {len(obstacles)}.")
        return Scene(
            arrays["positions"],
            tuple(attributes["box"]),
            diameter=arrays["diameter"] if "diameter" in arrays else attributes["diameter"],
            mass=arrays["mass"] if "mass" in arrays else attributes["mass"],
            velocities=arrays.get("velocities"),
            spins=arrays.get("spins"),
            species=arrays.get("species"),
            contact=arrays.get("contact"),
            walls=tables.walls_from_table(attributes["walls"]),
            obstacles=obstacles,
            species_names=tuple(attributes["species_names"]),
            pinned=arrays.get("pinned"),
            interaction=model_checks.recalled("interaction", attributes.get("interaction"), interaction),
            motion=model_checks.recalled("motion", attributes.get("motion"), motion),
            impact=model_checks.recalled("impact", attributes.get("impact"), impact),
            drive=model_checks.recalled("drive", attributes.get("drive"), drive),
        )
    except (KeyError, TypeError) as problem:
        raise InputError(f"These arrays and attributes are no scene: {problem}.") from None
