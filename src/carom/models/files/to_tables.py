"""What files hold of models: interactions, motions, impacts, paths and obstacles as plain values.

A value that a file can hold has ``to_table()``. ``carom.models.files.tables`` makes it again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from carom.errors import InputError
from carom.models import obstacles
from carom.models.obstacles.named_walls import Wall
from carom.models.obstacles.properties import Properties, properties_of
from carom.models.questions.obstacle import Obstacle

PROPERTIES = tuple(each.name for each in fields(Properties))  # names of the properties of obstacles and walls


def holds(value: Any) -> bool:
    """Tell whether a file can hold a value."""
    return hasattr(value, "to_table")


def to_table(value: Any, what: str) -> dict[str, Any]:
    """Return what a file holds of a value."""
    if not hasattr(value, "to_table"):
        raise InputError(
            f"The {what} {type(value).__name__} is of a class of one's own, which no file can hold."
        )
    return dict(value.to_table())


def obstacle_to_table(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as values that JSON and TOML hold; of a class of one's own only its name."""
    for kind, known in obstacles.KINDS.items():
        if type(obstacle) is known and isinstance(obstacle, Properties) and _kept(obstacle):
            shape = {each.name: getattr(obstacle, each.name) for each in fields(obstacle)}
            geometry = {name: value for name, value in shape.items() if name not in PROPERTIES}
            return {"type": kind, **geometry, **_properties(obstacle)}
    return {"type": "own", "class": type(obstacle).__name__, "name": obstacle.name}


def walls_to_table(walls: Mapping[str, Wall]) -> dict[str, Any]:
    """Return walls by name as values that JSON and TOML hold."""
    tables = {}
    for name, wall in walls.items():
        if not _kept(wall):
            raise InputError(f"shake of {name} is of a class of one's own, which no file can hold.")
        tables[name] = _properties(wall) | ({"offset": wall.offset} if wall.offset else {})
    return tables


def _kept(value: Properties) -> bool:
    """Tell whether a file can hold the path of a value."""
    return value.shake is None or holds(value.shake)


def _properties(value: Properties) -> dict[str, Any]:
    """Return the properties of an obstacle or a wall that are given."""
    given = properties_of(value)
    if value.shake is not None:
        given["shake"] = to_table(value.shake, "shake")
    if value.impact is not None:
        given["impact"] = impact_to_table(value.impact)
    return given


def impact_to_table(impact: Any) -> Any:
    """Return what a file holds of an impact: one number where it is a restitution alone."""
    table = to_table(impact, "impact")
    return table["restitution"] if set(table) == {"type", "restitution"} else table
