"""A section ``[scene]`` as plain values, and as lines of TOML in which parts have names."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from carom import checks
from carom.declared import fields_of
from carom.errors import InputError
from carom.io.records import toml_key, toml_lines, toml_value
from carom.models import declared_values
from carom.models.files import tables
from carom.models.obstacles import Obstacle, Wall
from carom.scene.species import Species
from carom.spec import Spec


def plain(value: Any, name: str = "interaction") -> Any:
    """Return a value of ``[scene]`` as numbers, strings, lists and tables."""
    if isinstance(value, Mapping):
        if any(isinstance(each, Wall) for each in value.values()):
            value = tables.walls_to_table(value)
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each, name) for each in value]
    if isinstance(value, Species):
        return {key: each for key, each in dataclasses.asdict(value).items() if each is not None}
    if value is None or isinstance(value, str | int | float):
        return value
    if name == "obstacles" and isinstance(value, Obstacle):
        table = tables.obstacle_to_table(value)
        if table["type"] == "own":
            raise InputError(
                f"The obstacle {value.name} is of a class of one's own, which a scene file cannot hold."
            )
        return table
    if tables.holds(value):
        return declared_values.plain(value)
    raise InputError(
        f"[scene] {name} is {checks.describe(value)}, of a class of one's own, which a scene file cannot "
        "hold: run it with carom.Simulation."
    )


def words_of(scene: Spec) -> dict[str, Any]:
    """Return the keys of ``[scene]`` that are given, as plain values."""
    values = {name: getattr(scene, name) for name in fields_of(type(scene))}
    return {name: plain(value, name) for name, value in values.items() if value is not None and value != ()}


def scene_lines(words: Mapping[str, Any]) -> list[str]:
    """Return the lines of ``[scene]``: species, walls and obstacles by name, tables after single values."""
    lines, below = ["[scene]"], list[str]()
    for name, value in words.items():
        if name == "species" and isinstance(value, list):
            for key, each in _by_name(value).items():
                lines.append(f"species.{toml_key(key)} = {toml_value(each)}")
        elif name == "obstacles" and isinstance(value, list):
            for key, each in _by_name(value).items():
                below += ["", f"[scene.obstacles.{toml_key(key)}]", *toml_lines(each)]
        elif name in ("walls", "obstacles") and isinstance(value, Mapping):
            for key, each in value.items():
                below += ["", f"[scene.{name}.{toml_key(key)}]", *toml_lines(each)]
        elif name == "interaction":
            below += ["", "[scene.interaction]", *toml_lines(value)]
        else:
            lines.append(f"{name} = {toml_value(value)}")
    return lines + below


def _by_name(tables: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return tables by their names; one keeps its name where another before it has the same."""
    found: dict[str, dict[str, Any]] = {}
    for k, table in enumerate(tables):
        name = key = table.get("name", str(k))
        while key in found:
            key += f"-{k}"
        rest = {word: value for word, value in table.items() if word != "name"}
        found[key] = rest if key == name else {**rest, "name": name}
    return found
