"""Interactions, motions, impacts, drives, paths and surfaces as tables for files: ``type`` says what each is.

A value that a file can hold has ``to_table()`` (``files.to_tables``). What stands here makes it again.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.models import obstacles
from carom.models.questions.obstacle import Obstacle

KINDS: dict[str, dict[str, tuple[str, str]]] = {
    "motion": {
        "gravity": ("carom.models.motions.gravity", "Gravity"),
        "shear": ("carom.models.motions.shear", "Shear"),
        "great-circles": ("carom.models.motions.great_circles", "GreatCircles"),
    },
    "impact": {
        "loss": ("carom.models.contacts.losses", "Loss"),
        "rough": ("carom.models.contacts.rough", "Rough"),
    },
    "drive": {
        "andersen": ("carom.models.drives", "Andersen"),
        "langevin": ("carom.models.drives", "Langevin"),
        "brownian": ("carom.models.drives", "Brownian"),
        "white-noise": ("carom.models.drives", "WhiteNoise"),
    },
    "path": {
        "sine": ("carom.models.obstacles.paths", "Sine"),
        "parabolas": ("carom.models.obstacles.paths", "Parabolas"),
    },
    "obstacle": {
        "shaken": ("carom.models.obstacles.shaken", "Shaken"),
        "surface": ("carom.models.obstacles.surfaces", "Surface"),
        "thermal": ("carom.models.obstacles.surfaces", "Thermal"),
    },
}
"""Module and class of what a file may name, by what it is for. Imported when a file does."""

PARTS = {"loss": "impact", "path": "path"}
"""Fields that are tables themselves, and what these are for."""


def from_table(values: Any, what: str, key: str = "type") -> Any:
    """Return the value of ``carom.models.files.to_tables.to_table``.

    Parameters
    ----------
    values : mapping
        The table.
    what : {"interaction", "motion", "impact", "drive", "path", "obstacle"}
        What it is for.
    key : str
        Which item says what it is.

    Raises
    ------
    InputError
        If it is unknown, or an item is missing, unknown or wrong.
    """
    if not isinstance(values, dict):
        raise InputError(f"A {what} must be a table with {key}, found {checks.describe(values)}.")
    if what == "interaction":
        from carom.models.interactions import tables as interactions

        return interactions.from_table(values)
    kind = values.get(key)
    cls = _class(kind, what, key)
    given = {name: value for name, value in values.items() if name != key}
    expected = {field.name: field for field in fields(cls)}
    needed = [name for name, field in expected.items() if field.default is MISSING]
    checks.keys(given, f"A {kind}", expected, needed=needed)
    for name in expected:
        if name in given and name in PARTS:
            given[name] = from_table(_typed(given[name], name), PARTS[name])
        elif name in given and name == "obstacle":
            given[name] = obstacle_from_table(given[name])
    return cls(**given)


def _typed(table: Any, name: str) -> Any:
    """Return a table with its type, which that of a loss need not say."""
    if name == "loss" and isinstance(table, dict):
        return {"type": "loss", **table}
    return table


def _class(kind: Any, what: str, key: str) -> Any:
    """Return the class of a kind."""
    plain = obstacles.KINDS if what == "obstacle" else {}
    known = isinstance(kind, str)
    if known and kind in plain:
        return plain[kind]
    if not (known and kind in KINDS[what]):
        one = "an" if what == "obstacle" else "a"
        raise InputError(
            f"{key} of {one} {what} must be one of {', '.join((*plain, *KINDS[what]))}; found "
            f"{checks.describe(kind)}."
        )
    module, name = KINDS[what][kind]
    return getattr(importlib.import_module(module), name)


def refuse_one_seed(kept: Sequence[dict[str, Any]]) -> None:
    """Raise InputError where two thermal surfaces of a run have one seed: no scene has had them since."""
    seeds = [each["seed"] for each in kept if each["kind"] == "thermal"]
    if len(set(seeds)) < len(seeds):
        raise InputError(
            "Two thermal surfaces have one seed in this file, and this Carom lets them draw different random "
            "numbers: the run would go on with other bits. Go on with the Carom that wrote it, or start from "
            "a frame."
        )


def obstacle_from_table(values: Any) -> Obstacle:
    """Return the obstacle of ``carom.models.files.to_tables.obstacle_to_table``.

    Raises
    ------
    InputError
        If it is of a class of one's own, of an unknown kind, or a value is missing, unknown or wrong.
    """
    if not isinstance(values, dict):
        raise InputError(f"An obstacle must be a table, found {checks.describe(values)}.")
    if values.get("kind") == "own":
        raise InputError(
            f"The obstacle {values.get('name')} is of the class {values.get('class')}, which no file holds; "
            "give all obstacles, obstacles=[...], where the file is loaded."
        )
    return from_table(values, "obstacle", "kind")
