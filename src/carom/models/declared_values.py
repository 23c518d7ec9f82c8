"""Values of models: their fields, checked, and the tables that files hold of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

import numpy as np

from carom import checks
from carom.declared import Declared, Opt, fields_of, number, said
from carom.errors import InputError

FIELD = number(low=-checks.MAGNITUDE, high=checks.MAGNITUDE)  # any number that leaves room for products
PART = number(low=0.0, high=1.0, open_low=True)
ABOVE = number(low=0.0, open_low=True)
SPEED = number(low=0.0, high=checks.FASTEST, open_low=True)


class Value(Declared):
    """A value of a model, whose fields are checked; a file holds them in a table, of its ``type`` if any."""

    type: ClassVar[str]

    def given(self) -> dict[str, Any]:
        """Return the arguments that are given, by name."""
        fields = fields_of(type(self))
        return {
            name: value
            for name, field in fields.items()
            if field.check is not None and (value := getattr(self, name)) is not None
        }

    def to_table(self) -> dict[str, Any]:
        """Return the arguments that are given, for a file."""
        table = plain(self.given())
        return {"type": self.type, **table} if hasattr(self, "type") else table

    def unusual(self) -> dict[str, Any]:
        """Return the arguments that are not those by default, by name."""
        fields = fields_of(type(self))
        return {name: x for name, field in fields.items() if (x := getattr(self, name)) != field.default}


def plain(value: Any) -> Any:
    """Return a value as a file holds it: lists for tuples, a number for a restitution alone."""
    if isinstance(value, Value):
        table = value.to_table()
        return table["restitution"] if set(table) == {"type", "restitution"} else table
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    return [*map(plain, value)] if isinstance(value, tuple) else value


def vector(values: Any, name: str) -> tuple[float, ...]:
    """Return a list of finite numbers, one an axis, as a tuple."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        raise InputError(f"{name} must be a list of numbers, one an axis, found {checks.describe(values)}.")
    if not len(values):
        raise InputError(f"{name} must have one number an axis, found none.")
    return tuple(checks.number(x, name, low=-checks.MAGNITUDE, high=checks.MAGNITUDE) for x in values)


said(vector, type="array", items={"type": "number"}, minItems=1)


def _name(value: Any, name: str) -> str:
    """Check the name of an obstacle."""
    if not isinstance(value, str) or not value or not value.isprintable() or len(value) > 80:
        raise InputError(
            f"An obstacle's name must be a string of 1 to 80 printable characters, found "
            f"{checks.describe(value)}."
        )
    return value


said(_name, type="string", minLength=1, maxLength=80)

Name = Annotated[str, _name, Opt("Name, for messages and results.")]
Vector = Annotated[tuple[float, ...], vector]
Center = Annotated[Vector, Opt("Center [length].")]
Rounding = Annotated[float, number(low=0.0), Opt("Thickness added on all sides [length].")]


def check_dimensions(vector: tuple[float, ...], box: Sequence[float], what: str) -> None:
    """Raise InputError where a vector of an obstacle has another dimension than the box."""
    if len(vector) != len(box):
        raise InputError(f"The {what} must have {len(box)} coordinates, found {len(vector)}.")
