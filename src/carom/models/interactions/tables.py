"""Interactions as tables of a file: what a scene file, a checkpoint and an event log hold of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.models.interactions import rule_files
from carom.models.interactions.bonds import Bonds
from carom.models.interactions.steps import Steps
from carom.models.interactions.wells import SquareWell, StepTable


def from_table(table: Any) -> Any:
    """Return the interaction that a table with a ``type`` describes; its ``to_table`` returns the table."""
    if not isinstance(table, Mapping):
        raise InputError(f"An interaction must be a table with a type, found {checks.describe(table)}.")
    kind = table.get("type")
    if not isinstance(kind, str) or kind not in TYPES:
        raise InputError(f"The type of an interaction must be one of {', '.join(TYPES)}; found {kind!r}.")
    keys, make = TYPES[kind]
    given = {name: value for name, value in table.items() if name != "type"}
    for name in given:
        if name not in keys:
            raise InputError(f"An interaction of type {kind} has no {name}; known are {', '.join(keys)}.")
    try:
        return make(**given)
    except TypeError as problem:
        raise InputError(f"An interaction of type {kind} cannot be made of this: {problem}.") from None


def _steps_of(table: Any) -> Steps:
    if not isinstance(table, Mapping):
        raise InputError(
            f"Steps must be a table with distances and energies, found {checks.describe(table)}."
        )
    for name in table:
        if name not in STEPS:
            raise InputError(f"Steps have no {name}; known are {', '.join(STEPS)}.")
    return Steps(**table)


def _table_of(table: Any = None, **steps: Any) -> StepTable:
    if table is None:
        return StepTable(_steps_of(steps))
    if steps:
        raise InputError(
            f"table and {', '.join(steps)} say the same thing in two ways: leave one of them out."
        )
    if not isinstance(table, list | tuple) or not all(isinstance(row, list | tuple) for row in table):
        raise InputError(f"table must be rows of tables, found {checks.describe(table)}.")
    return StepTable([[_steps_of(each) for each in row] for row in table])


def _bonds_of(pairs: Any = (), others: Any = None, bond: Any = None, **ends: Any) -> Bonds:
    return Bonds(
        pairs,
        others=None if others is None else from_table(others),
        bond=None if bond is None else _steps_of(bond),
        **ends,
    )


STEPS = ("distances", "energies", "outside", "leaving")
TYPES: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "square-well": (("range", "depth"), SquareWell),
    "steps": (("table", "distances", "energies", "leaving"), _table_of),
    "bonds": (("pairs", "inner", "outer", "bond", "others"), _bonds_of),
    "ranges": (("kinds", "file", "rule", "seed", "sha256"), rule_files.of_table),
}
"""What each type may hold, and what makes it."""
