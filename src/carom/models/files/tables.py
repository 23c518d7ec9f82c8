"""Interactions, motions, impacts, drives, paths, obstacles and walls as tables of files, and back.

``type`` says what each is. A value that a file can hold has ``to_table()``.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from carom import checks
from carom.declared import fields_of, schema_of_table
from carom.errors import InputError
from carom.models import obstacles
from carom.models.contacts.restitution import as_impact
from carom.models.declared_values import plain
from carom.models.interfaces.obstacle import Obstacle
from carom.models.obstacles.named_walls import Wall
from carom.suggestions import nearest
from carom.texts import with_article

KINDS: dict[str, dict[str, Any]] = {
    "interaction": {
        "square-well": "interactions.wells:SquareWell",
        "steps": "interactions.wells:StepTable",
        "bonds": "interactions.bonds:Bonds",
        "ranges": "interactions.rule_files:RuleFile",
    },
    "motion": {
        "gravity": "motions.gravity:Gravity",
        "shear": "motions.shear:Shear",
        "great-circles": "motions.great_circles:GreatCircles",
    },
    "impact": {
        "restitution": "contacts.restitution:Restitution",
        "loss": "contacts.losses:Loss",
        "rough": "contacts.rough:Rough",
    },
    "drive": {
        "andersen": "drives:Andersen",
        "langevin": "drives:Langevin",
        "brownian": "drives:Brownian",
        "white-noise": "white_noise:WhiteNoise",
        "active": "active:Active",
    },
    "path": {"sine": "obstacles.paths:Sine", "parabolas": "obstacles.paths:Parabolas"},
    "obstacle": obstacles.KINDS,
}
"""What a file may name, by what it is for: a class, or its module, imported when a file does."""

STEPS = "interactions.steps:Steps"  # what a table of the type "steps" may hold instead of a matrix

PARTS = {"shake": "path", "impact": "impact", "others": "interaction"}
"""Fields that are tables themselves, and what these are for."""

SAID = {
    "path": {"pieces": "parabolas"},
    "impact": dict.fromkeys(("contact_time", "at_speed", "power"), "loss"),
}
"""Items that say the type of a table without one."""

UNSAID = {"path": "sine", "impact": "restitution"}  # the type of a table without such an item


def holds(value: Any) -> bool:
    """Tell whether a file can hold a value."""
    return hasattr(value, "to_table")


def from_table(values: Any, what: str) -> Any:
    """Return the value of a table, ``what`` being one of ``KINDS``; an impact may be a restitution alone."""
    if what == "impact" and isinstance(values, int | float):
        return as_impact(values)
    one = with_article(what)
    if not isinstance(values, Mapping):
        needs = "must be a table" + ("" if what in UNSAID else " with type")
        raise InputError(f"{one.capitalize()} {needs}, found {checks.describe(values)}.")
    if what in UNSAID and "type" not in values:
        implied = (kind for item, kind in SAID[what].items() if item in values)
        values = {"type": next(implied, UNSAID[what]), **values}
    kind, known = values.get("type"), KINDS[what]
    if what == "obstacle" and kind == "own":
        raise InputError(
            f"The obstacle {values.get('name')} is of the class {values.get('class')}, which no file holds; "
            "give all obstacles, obstacles=[...], where the file is loaded."
        )
    if not (isinstance(kind, str) and kind in known):
        hint = checks.suggestion(kind, known, listed=True) if isinstance(kind, str) else ""
        raise InputError(
            f"type of {one} must be one of {', '.join(known)}; found {checks.describe(kind)}{hint}."
        )
    given = {name: value for name, value in values.items() if name != "type"}
    this = f"{one.capitalize()} of type {kind}"
    if kind == "steps" and "table" not in given:  # one potential for all pairs
        given = {"table": _made(_class(STEPS), this, given)}
    elif kind == "steps" and "distances" in given:
        raise InputError("table and distances say the same thing in two ways: leave one of them out.")
    return _made(_class(known[kind]), this, given)


def call_of(what: str, name: str) -> str:
    """Return the call that makes a value of a type of tables, or of one spelt alike; "" if there is none."""
    if (kind := nearest(name, known := KINDS[what])) is None:
        return ""
    cls = _class(known[kind])
    needed = (f"{each}=..." for each, field in fields_of(cls).items() if field.needed)
    return f"models.{cls.__name__}({', '.join(needed)})"


def definitions() -> dict[str, Any]:
    """Return the JSON schemas of tables, by what they are for."""
    found: dict[str, Any] = {"wall": schema_of_table(Wall)}
    for what, known in KINDS.items():
        tables = [schema_of_table(_class(each), kind) for kind, each in known.items()]
        if what in UNSAID:
            for table in tables:
                table["required"].remove("type")
        found[what] = {"anyOf": tables}
    steps = schema_of_table(_class(STEPS), "steps")
    found["interaction"]["anyOf"].append(steps)
    found["impact"]["anyOf"].append({"type": "number", "exclusiveMinimum": 0, "maximum": 1})
    return found


def _made(cls: Any, what: str, given: Mapping[str, Any]) -> Any:
    """Return a value of a class from its arguments."""
    known = {name: field for name, field in fields_of(cls).items() if field.check is not None}
    checks.keys(given, what, known, needed=[name for name, field in known.items() if field.needed])
    parts = {name: from_table(given[name], PARTS[name]) for name in PARTS if name in given}
    return cls(**{**given, **parts})


def _class(known: Any) -> Any:
    """Return a class of ``KINDS``."""
    if isinstance(known, type):
        return known
    module, _, name = known.partition(":")
    return getattr(importlib.import_module(f"carom.models.{module}"), name)


def walls_from_table(values: Any) -> dict[str, Wall]:
    """Return the walls of :func:`walls_to_table`."""
    if not isinstance(values, dict):
        raise InputError(f"walls must be a table of tables, found {checks.describe(values)}.")
    walls = {}
    for name, table in values.items():
        if not isinstance(table, dict):
            raise InputError(f"The wall {name} must be a table, found {checks.describe(table)}.")
        walls[name] = _made(Wall, f"The wall {name}", table)
    return walls


def obstacle_to_table(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as values that JSON and TOML hold; of a class of one's own only its name."""
    if type(obstacle) in obstacles.KINDS.values() and _kept(obstacle):
        return obstacle.to_table()  # type: ignore[attr-defined]
    return {"type": "own", "class": type(obstacle).__name__, "name": obstacle.name}


def walls_to_table(walls: Mapping[str, Wall]) -> dict[str, Any]:
    """Return walls by name as values that JSON and TOML hold."""
    for name, wall in walls.items():
        if not _kept(wall):
            raise InputError(f"shake of {name} is of a class of one's own, which no file can hold.")
    return plain({**walls})


def _kept(value: Any) -> bool:
    """Tell whether a file can hold the path of a value."""
    return value.shake is None or holds(value.shake)
