"""Interactions, motions, impacts, paths and surfaces as tables for files: ``type`` says what each is.

A value that a file can hold has ``to_table()``. What stands here makes it again.
"""

from __future__ import annotations

import importlib
from dataclasses import MISSING, fields
from typing import Any

from carom import checks
from carom.errors import InputError

KINDS: dict[str, dict[str, tuple[str, str]]] = {
    "motion": {
        "gravity": ("carom.models.gravity", "Gravity"),
        "great-circles": ("carom.models.great_circles", "GreatCircles"),
    },
    "impact": {"loss": ("carom.models.losses", "Loss")},
    "path": {
        "sine": ("carom.models.paths", "Sine"),
        "parabolas": ("carom.models.paths", "Parabolas"),
    },
    "obstacle": {
        "shaken": ("carom.models.shaken", "Shaken"),
        "surface": ("carom.models.surfaces", "Surface"),
        "thermal": ("carom.models.surfaces", "Thermal"),
    },
}
"""Module and class of what a file may name, by what it is for. Imported when a file does."""

PARTS = {"loss": "impact", "path": "path"}
"""Fields that are tables themselves, and what these are for."""


def holds(value: Any) -> bool:
    """Tell whether a file can hold a value, and all that it is made of."""
    if not hasattr(value, "to_table"):
        return False
    body = getattr(value, "obstacle", None)
    if body is not None:
        from carom.models.obstacles import to_json

        if to_json(body)["kind"] == "own":
            return False
    return not hasattr(value, "path") or hasattr(value.path, "to_table")


def to_table(value: Any, what: str) -> dict[str, Any]:
    """Return what a file holds of a value.

    Raises
    ------
    InputError
        If it is of a class of one's own.
    """
    if not hasattr(value, "to_table"):
        raise InputError(
            f"The {what} {type(value).__name__} is of a class of one's own, which no file can hold."
        )
    return dict(value.to_table())


def from_table(values: Any, what: str, key: str = "type") -> Any:
    """Return the value of :func:`to_table`.

    Parameters
    ----------
    values : mapping
        The table.
    what : {"interaction", "motion", "impact", "path", "obstacle"}
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
        from carom.models import interactions

        return interactions.from_table(values)
    kind, known = values.get(key), KINDS[what]
    if kind not in known:
        raise InputError(
            f"{key} of a {what} must be one of {', '.join(known)}; found {checks.describe(kind)}."
        )
    module, name = known[kind]
    cls = getattr(importlib.import_module(module), name)
    given = {name: value for name, value in values.items() if name != key}
    expected = {field.name: field for field in fields(cls)}
    for name in given:
        if name not in expected:
            raise InputError(f"A {kind} has no {str(name)[:40]!r}; known are {', '.join(expected)}.")
    for name, field in expected.items():
        if name not in given and field.default is MISSING:
            raise InputError(f"A {kind} needs {name}, found none.")
        if name in given and name in PARTS:
            given[name] = from_table(_typed(given[name], name), PARTS[name])
        elif name in given and name == "obstacle":
            from carom.models.obstacles import from_json

            given[name] = from_json(given[name])
    return cls(**given)


def _typed(table: Any, name: str) -> Any:
    """Return a table with its type, which that of a loss need not say."""
    if name == "loss" and isinstance(table, dict):
        return {"type": "loss", **table}
    return table
