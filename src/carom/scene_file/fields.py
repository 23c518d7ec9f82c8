"""Checks of the fields of a section, with messages that name the section and the key."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.models.files import tables
from carom.models.obstacles import Wall
from carom.scene import lattices
from carom.scene.box import LONGEST_EDGE


class Fields:
    """The fields of a section: each is checked, and replaced by its value in the right type."""

    def __init__(self, section: str, spec: Any) -> None:
        self.section = section
        self.spec = spec

    def _replace(self, name: str, check: Callable[[Any, str], Any]) -> None:
        """Replace a field by its checked value, unless it is left out."""
        value = getattr(self.spec, name)
        optional = type(self.spec).__dataclass_fields__[name].default is None
        if value is not None or not optional:
            object.__setattr__(self.spec, name, check(value, f"[{self.section}] {name}"))

    def number(
        self, name: str, low: float = -math.inf, high: float = math.inf, open_low: bool = False
    ) -> None:
        """Check a number."""
        self._replace(name, lambda v, k: checks.number(v, k, low=low, high=high, open_low=open_low))

    def integer(self, name: str, low: int, high: int) -> None:
        """Check a whole number."""
        self._replace(name, lambda v, k: checks.integer(v, k, low=low, high=high))

    def integers(self, name: str, low: int, high: int) -> None:
        """Check a whole number, or one for each axis."""

        def check(value: Any, key: str) -> int | tuple[int, ...]:
            if not isinstance(value, tuple):
                return checks.integer(value, key, low=low, high=high)
            return tuple(checks.integer(v, key, low=low, high=high) for v in _some(value, key))

        self._replace(name, check)

    def indices(self, name: str, high: int) -> None:
        """Check a whole number, or a list of any length; an empty one is left out."""

        def check(value: Any, key: str) -> int | tuple[int, ...] | None:
            if not isinstance(value, tuple):
                return checks.integer(value, key, low=0, high=high)
            return tuple(checks.integer(v, key, low=0, high=high) for v in value) or None

        self._replace(name, check)

    def edges(self, name: str) -> None:
        """Check lengths, one for each axis."""

        def check(value: Any, key: str) -> tuple[float, ...]:
            if not isinstance(value, tuple):
                raise InputError(f"{key} must be a list of edges, found {checks.describe(value)}.")
            return tuple(
                checks.number(v, key, low=1 / checks.MAGNITUDE, high=LONGEST_EDGE * checks.MAGNITUDE)
                for v in _some(value, key)
            )

        self._replace(name, check)

    def text(self, name: str) -> None:
        """Check a name."""

        def check(value: Any, key: str) -> str:
            if not isinstance(value, str):
                raise InputError(f"{key} must be a string, found {checks.describe(value)}.")
            try:
                value.encode("utf-8")
            except UnicodeEncodeError:
                value = ""
            if not value or "\0" in value:
                raise InputError(f"{key} must be the name of a file, found something else.")
            return value

        self._replace(name, check)

    def choice(self, name: str, known: tuple[str, ...]) -> None:
        """Check that a word is one of those known."""
        self._replace(name, lambda v, k: _choice(v, k, known))

    def choices(self, name: str, known: tuple[str, ...]) -> None:
        """Check that words are among those known, each once."""

        def check(value: Any, key: str) -> tuple[str, ...]:
            if not isinstance(value, tuple):
                raise InputError(f"{key} must be a list of formats, found {checks.describe(value)}.")
            result = tuple(_choice(v, key, known) for v in value)
            if len(set(result)) < len(result):
                raise InputError(f"{key} names a format twice: {', '.join(result)}.")
            return result

        self._replace(name, check)

    def walls(self, name: str) -> None:
        """Check names of axes, or walls by name as values or as tables."""

        def check(value: Any, key: str) -> Any:
            if isinstance(value, Mapping):
                given = {wall: each for wall, each in value.items() if isinstance(each, Wall)}
                read = {wall: each for wall, each in value.items() if wall not in given}
                try:
                    made = given | tables.walls_from_table(read)
                except InputError as problem:
                    raise InputError(f"{key}: {problem}") from problem
                return {wall: made[wall] for wall in value}
            axes = value if isinstance(value, tuple) else (value,)
            if not isinstance(value, bool) and not all(isinstance(axis, str) for axis in axes):
                raise InputError(
                    f"{key} must name axes, such as 'xy', or be true, or hold walls by name; found "
                    f"{checks.describe(value)}."
                )
            return value

        self._replace(name, check)

    def table(self, name: str) -> None:
        """Check a table of positive numbers."""

        def check(value: Any, key: str) -> tuple[tuple[float, ...], ...]:
            if not isinstance(value, tuple) or not all(isinstance(row, tuple) for row in value):
                raise InputError(f"{key} must be a list of lists of numbers, found {checks.describe(value)}.")
            return tuple(tuple(checks.positive(x, key) for x in row) for row in value)

        self._replace(name, check)

    def each(self, name: str, make: Callable[[Any, str], Any]) -> None:
        """Make a value of each table in a list."""

        def check(value: Any, key: str) -> tuple[Any, ...]:
            if not isinstance(value, tuple):
                raise InputError(f"{key} must be a list of tables, found {checks.describe(value)}.")
            return tuple(make(each, f"{key} {k}") for k, each in enumerate(value))

        self._replace(name, check)

    def value(self, name: str) -> None:
        """Check an interaction, a motion, an impact or a drive: a value, or its table."""

        def check(value: Any, key: str) -> Any:
            table = isinstance(value, Mapping) or (name == "impact" and isinstance(value, int | float))
            if type(value).__module__ in ("builtins", "datetime") and not table:
                # What a file holds instead of a table: no model is of such a type.
                raise InputError(f"{key} must be a table, found {checks.describe(value)}.")
            try:
                return tables.from_table(value, name) if table else value
            except InputError as problem:
                raise InputError(f"{key}: {problem}") from problem

        self._replace(name, check)

    def switch(self, name: str) -> None:
        """Check a bool."""

        def check(value: Any, key: str) -> bool:
            if not isinstance(value, bool):
                raise InputError(f"{key} must be true or false, found {checks.describe(value)}.")
            return value

        self._replace(name, check)


def _some(values: tuple[Any, ...], key: str) -> tuple[Any, ...]:
    """Return values, one for each axis, after a check of their number."""
    if not 1 <= len(values) <= lattices.MOST_DIMENSIONS:
        raise InputError(f"{key} must have one value an axis, found {len(values)}.")
    return values


def _choice(value: Any, key: str, known: tuple[str, ...]) -> str:
    """Return a word if it is one of those known."""
    if isinstance(value, str) and value in known:
        return value
    hint = checks.suggestion(value, known, listed=True) if isinstance(value, str) else ""
    raise InputError(f"{key} must be one of {', '.join(known)}; found {checks.describe(value)}{hint}.")
