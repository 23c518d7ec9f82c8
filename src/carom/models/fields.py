"""Values of models: their fields, checked, and the tables that files hold of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from carom import checks
from carom.declared import Declared, number, said
from carom.errors import InputError

FIELD = number(low=-checks.MAGNITUDE, high=checks.MAGNITUDE)  # any number that leaves room for products
PART = number(low=0.0, high=1.0, open_low=True)
ABOVE = number(low=0.0, open_low=True)
SPEED = number(low=0.0, high=checks.FASTEST, open_low=True)


class Value(Declared):
    """A value of a model, whose fields are checked; a file holds them in a table of its ``type``."""

    type: ClassVar[str]

    def to_table(self) -> dict[str, Any]:
        """Return the arguments that are given, for a file."""
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        given = {name: value for name, value in values.items() if value is not None}
        return {"type": self.type, **{name: plain(value) for name, value in given.items()}}


def plain(value: Any) -> Any:
    """Return a value as a file holds it: lists for tuples."""
    return [plain(each) for each in value] if isinstance(value, tuple) else value


def vector(values: Any, name: str) -> tuple[float, ...]:
    """Return a list of finite numbers, one an axis, as a tuple."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        raise InputError(f"{name} must be a list of numbers, one an axis, found {checks.describe(values)}.")
    if not len(values):
        raise InputError(f"{name} must have one number an axis, found none.")
    return tuple(checks.number(x, name, low=-checks.MAGNITUDE, high=checks.MAGNITUDE) for x in values)


said(vector, type="array", items={"type": "number"}, minItems=1)


def check_name(obstacle: Any) -> None:
    """Raise InputError where the name of an obstacle is none."""
    name = obstacle.name
    if not isinstance(name, str) or not name or not name.isprintable() or len(name) > 80:
        raise InputError(
            f"An obstacle's name must be a string of 1 to 80 printable characters, found "
            f"{checks.describe(name)}."
        )


def check_center_and_radius(obstacle: Any) -> None:
    """Check name, center and radius of an obstacle, and keep them as numbers."""
    kind = type(obstacle).name  # the default name is the kind
    object.__setattr__(obstacle, "center", vector(obstacle.center, f"center of a {kind}"))
    object.__setattr__(obstacle, "radius", checks.positive(obstacle.radius, f"radius of a {kind}"))
    check_name(obstacle)


def check_dimensions(vector: tuple[float, ...], box: Sequence[float], what: str) -> None:
    """Raise InputError where a vector of an obstacle has another dimension than the box."""
    if len(vector) != len(box):
        raise InputError(f"The {what} must have {len(box)} coordinates, found {len(vector)}.")
