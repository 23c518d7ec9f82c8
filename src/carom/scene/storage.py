"""A scene as arrays and as values that JSON holds, for checkpoints and event logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.models import model_checks
from carom.models.drives import Drive
from carom.models.files import parameters, tables
from carom.models.interfaces.contact import Impact
from carom.models.interfaces.interaction import Interaction
from carom.models.interfaces.motion import Motion
from carom.models.obstacles import Obstacle
from carom.scene.fields import is_elastic, is_usual
from carom.scene.scene import Scene

ARRAYS = ("positions", "velocities", "spins", "species", "contact")
"""Fields that are arrays, where they are given."""

MODELS = (*model_checks.USUAL, "drive")  # fields that are models


def to_arrays(scene: Scene) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return a scene as arrays and as values that JSON holds, by name, for :func:`from_arrays`."""
    arrays = {name: value for name in ARRAYS if (value := getattr(scene, name)) is not None}
    attributes: dict[str, Any] = {
        "box": list(scene.box),
        "walls": tables.walls_to_table(scene.walls),
        "obstacles": [tables.obstacle_to_table(o) for o in scene.obstacles],
        "species_names": list(scene.species_names),
    }
    usual = {"interaction": is_usual(scene, "interaction"), "motion": is_usual(scene, "motion"),
             "impact": is_elastic(scene), "drive": scene.drive is None}  # fmt: skip
    for kind in MODELS:
        value = getattr(scene, kind)
        if not usual[kind]:  # files hold no code
            holds = tables.holds(value)
            attributes[kind] = dict(value.to_table()) if holds else parameters.class_and_parameters(value)
    for name, values in (("diameter", scene.diameters), ("mass", scene.masses)):
        if np.ptp(values) == 0:
            attributes[name] = float(values[0])
        else:
            arrays[name] = values
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
    """Return the scene that :func:`to_arrays` took apart, bit for bit; other arrays are ignored.

    Values of one's own classes must be given (of obstacles all, in order): a file holds no code.
    """
    try:
        kept = attributes["obstacles"]
        if obstacles is None:
            obstacles = tuple(tables.from_table(each, "obstacle") for each in kept)
        elif len(obstacles) != len(kept):
            raise InputError(f"The scene has {len(kept)} obstacles, found {len(obstacles)}.")
        models = {"interaction": interaction, "motion": motion, "impact": impact, "drive": drive}
        both, given = {**attributes, **arrays}, dict[str, Any](positions=arrays["positions"])
        given |= {name: arrays[name] for name in ARRAYS if name in arrays}
        return Scene(
            box=tuple(both["box"]),
            diameter=both["diameter"],
            mass=both["mass"],
            walls=tables.walls_from_table(both["walls"]),
            obstacles=obstacles,
            species_names=tuple(both["species_names"]),
            pinned=arrays.get("pinned"),
            **given,
            **{kind: model_checks.recalled(kind, attributes.get(kind), models[kind]) for kind in MODELS},
        )
    except (KeyError, TypeError) as problem:
        raise InputError(f"These arrays and attributes are no scene: {problem}.") from None
