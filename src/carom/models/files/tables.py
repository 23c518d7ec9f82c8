"""Interactions, motions, impacts, drives, paths, obstacles and walls from the tables of files.

``type`` says what each is. A value that a file can hold has ``to_table()`` (``files.to_tables``).
"""

from __future__ import annotations

import importlib
from dataclasses import MISSING, fields
from typing import Any

from carom import checks
from carom.declared import schema_of_table
from carom.errors import InputError
from carom.models import obstacles
from carom.models.contacts.restitution import as_impact
from carom.models.obstacles.named_walls import Wall
from carom.models.questions.obstacle import Obstacle

KINDS: dict[str, dict[str, tuple[str, str]]] = {
    "motion": {
        "gravity": ("carom.models.motions.gravity", "Gravity"),
        "shear": ("carom.models.motions.shear", "Shear"),
        "great-circles": ("carom.models.motions.great_circles", "GreatCircles"),
    },
    "impact": {
        "restitution": ("carom.models.contacts.restitution", "Restitution"),
        "loss": ("carom.models.contacts.losses", "Loss"),
        "rough": ("carom.models.contacts.rough", "Rough"),
    },
    "drive": {
        "andersen": ("carom.models.drives", "Andersen"),
        "langevin": ("carom.models.drives", "Langevin"),
        "brownian": ("carom.models.drives", "Brownian"),
        "white-noise": ("carom.models.white_noise", "WhiteNoise"),
        "active": ("carom.models.active", "Active"),
    },
    "path": {
        "sine": ("carom.models.obstacles.paths", "Sine"),
        "parabolas": ("carom.models.obstacles.paths", "Parabolas"),
    },
}
"""Module and class of what a file may name, by what it is for. Imported when a file does."""

PARTS = {"shake": "path", "impact": "impact"}  # fields that are tables themselves, and what these are for

SAID = {
    "path": {"pieces": "parabolas"},
    "impact": dict.fromkeys(("contact_time", "at_speed", "power"), "loss"),
}
"""Items that say the type of a table without one."""

UNSAID = {"path": "sine", "impact": "restitution"}  # the type of a table without such an item


def from_table(values: Any, what: str) -> Any:
    """Return the value of a table that ``files.to_tables`` made; an impact may be a restitution alone.

    ``what`` is "interaction", "motion", "impact", "drive", "path" or "obstacle".
    """
    if what == "impact" and isinstance(values, int | float):
        return as_impact(values)
    if not isinstance(values, dict):
        needs = f"{what} must be a table" + ("" if what in UNSAID else " with type")
        raise InputError(f"{'An' if what[0] in 'aeiou' else 'A'} {needs}, found {checks.describe(values)}.")
    if what == "interaction":
        from carom.models.interactions import tables as interactions

        return interactions.from_table(values)
    if what in UNSAID and "type" not in values:
        implied = (kind for item, kind in SAID[what].items() if item in values)
        values = {"type": next(implied, UNSAID[what]), **values}
    cls = _class(values.get("type"), what)
    given = {name: value for name, value in values.items() if name != "type"}
    return _made(cls, f"A {values['type']}", given)


def schemas(what: str) -> list[dict[str, Any]]:
    """Return the JSON schemas of tables of a motion, an impact or a drive; of others, that of any table."""
    found = []
    for kind in KINDS.get(what, ()):
        schema = schema_of_table(_class(kind, what))
        schema["properties"] = {"type": {"const": kind}, **schema["properties"]}
        if what not in UNSAID:
            schema["required"] = ["type", *schema["required"]]
        found.append(schema)
    return found or [{"type": "object"}]


def _made(cls: Any, what: str, given: dict[str, Any]) -> Any:
    """Return a value of a class from its arguments."""
    expected = {field.name: field for field in fields(cls)}
    needed = [name for name, field in expected.items() if field.default is MISSING]
    checks.keys(given, what, expected, needed=needed)
    parts = {name: from_table(given[name], PARTS[name]) for name in PARTS if name in given}
    return cls(**{**given, **parts})


def _class(kind: Any, what: str) -> Any:
    """Return the class of a type."""
    if what == "obstacle":
        known: dict[str, Any] = obstacles.KINDS
    else:
        known = KINDS[what]
    if not (isinstance(kind, str) and kind in known):
        one = "an" if what[0] in "aeiou" else "a"
        hint = checks.suggestion(kind, known, listed=True) if isinstance(kind, str) else ""
        raise InputError(
            f"type of {one} {what} must be one of {', '.join(known)}; found {checks.describe(kind)}{hint}."
        )
    if what == "obstacle":
        return known[kind]
    module, name = known[kind]
    return getattr(importlib.import_module(module), name)


def obstacle_from_table(values: Any) -> Obstacle:
    """Return the obstacle of ``carom.models.files.to_tables.obstacle_to_table``."""
    if not isinstance(values, dict):
        raise InputError(f"An obstacle must be a table, found {checks.describe(values)}.")
    if values.get("type") == "own":
        raise InputError(
            f"The obstacle {values.get('name')} is of the class {values.get('class')}, which no file holds; "
            "give all obstacles, obstacles=[...], where the file is loaded."
        )
    made: Obstacle = from_table(values, "obstacle")
    return made


def walls_from_table(values: Any) -> dict[str, Wall]:
    """Return the walls of ``carom.models.files.to_tables.walls_to_table``."""
    if not isinstance(values, dict):
        raise InputError(f"walls must be a table of tables, found {checks.describe(values)}.")
    walls = {}
    for name, table in values.items():
        if not isinstance(table, dict):
            raise InputError(f"The wall {name} must be a table, found {checks.describe(table)}.")
        walls[name] = _made(Wall, f"The wall {name}", table)
    return walls
