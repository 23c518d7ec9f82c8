"""Fields of a model of one's own: what their annotations mean, and what the compiler gets of them."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import declared_values
from carom.models.own.arrays import kind_of
from carom.units import TimeUnit


@dataclass(frozen=True)
class Meaning:
    """What the annotation of a field says."""

    word: str  # what the field is
    power: int = 0  # its dimension is ``time**power``
    text: str = ""  # the same as a sentence


Array = Annotated[Any, Meaning("array", 0, "An array of numbers.")]
PerParticle = Annotated[Any, Meaning("per particle", 0, "An array of one value a particle, (n,).")]
Time = Annotated[Any, Meaning("quantity", 1, "A time, or several [time].")]
Rate = Annotated[Any, Meaning("quantity", -1, "A rate, or several [1 / time].")]
Speed = Annotated[Any, Meaning("quantity", -1, "A speed, or several [length / time].")]
Acceleration = Annotated[Any, Meaning("quantity", -2, "An acceleration, or one an axis [length / time^2].")]
Momentum = Annotated[Any, Meaning("quantity", -1, "A momentum, or several [mass length / time].")]
Energy = Annotated[Any, Meaning("quantity", -2, "An energy, or several [energy].")]

KNOWN = {float: "number", int: "integer", bool: "boolean", str: "text", tuple: "numbers", np.ndarray: "array"}
"""What types mean that are no annotation of ours."""


def meanings(cls: type, names: Mapping[str, Any]) -> dict[str, Meaning]:
    """Return what each annotated field of a class is; ``names`` are known besides its module's."""
    try:
        annotations = inspect.get_annotations(cls, eval_str=True, locals=dict(names))
    except Exception as error:
        raise InputError(f"An annotation of {cls.__name__} cannot be read: {error}.") from None
    for name in annotations:
        if name.startswith("_"):
            raise InputError(f"The field {name} of {cls.__name__} begins with an underscore: leave that out.")
    return {
        name: _meaning(cls, name, each)
        for name, each in annotations.items()
        if typing.get_origin(each) is not typing.ClassVar
    }


def returned(method: Any, names: Mapping[str, Any]) -> Meaning:
    """Return what a method says that it returns: an array, unless its annotation is one of ours."""
    said = types.SimpleNamespace(__annotations__={"return": method.__annotations__.get("return")})
    try:
        hint = typing.get_type_hints(said, method.__globals__, dict(names), include_extras=True)["return"]
    except NameError:  # only for type checkers
        hint = None
    found = getattr(hint, "__metadata__", ())
    return next((each for each in found if isinstance(each, Meaning)), Meaning("array"))


def _meaning(cls: type, name: str, annotation: Any) -> Meaning:
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):  # of None and another
        parts = [each for each in typing.get_args(annotation) if each is not type(None)]
        annotation = parts[0] if len(parts) == 1 else annotation
    for each in getattr(annotation, "__metadata__", ()):
        if isinstance(each, Meaning):
            return each
    plain = typing.get_origin(annotation) or annotation
    if plain not in KNOWN:
        shown = getattr(annotation, "__name__", str(annotation))
        raise InputError(
            f"The field {name} of {cls.__name__} is annotated with {shown}; expected float, int, bool, str, "
            "tuple, own.Array, own.PerParticle, or a quantity: own.Time, Rate, Speed, Acceleration, Energy, "
            "Momentum."
        )
    if plain is tuple and {*typing.get_args(annotation)} - {Ellipsis} == {int}:
        return Meaning("integers")
    return Meaning(KNOWN[plain])


def checked(value: Any, meaning: Meaning, name: str) -> Any:
    """Return the value of a field as its annotation wants it; ``name`` is for the message."""
    expected = meaning.word
    if value is None:  # only where the class has that default: None compiles to nothing
        return None
    if expected == "number":
        return checks.number(value, name)
    if expected == "integer":
        return checks.integer(value, name, low=-(2**63), high=2**63 - 1)
    if expected in ("numbers", "integers"):
        numbers = declared_values.vector(value, name)
        if expected == "numbers":
            return numbers
        return tuple(checks.integer(each, name, low=-(2**63), high=2**63 - 1) for each in value)
    if expected in ("boolean", "text"):
        kind = bool if expected == "boolean" else str
        if not isinstance(value, kind):
            raise InputError(f"{name} must be a {expected}, found {checks.describe(value)}.")
        return value
    if expected == "quantity" and not checks.several(value):
        return checks.number(value, name)
    found = _array(value, name)
    return tuple(found.tolist()) if expected == "quantity" and found.ndim == 1 else found


def _array(value: Any, name: str) -> np.ndarray:
    """Return a copy of an array that nobody changes, of float64, int64 or bool."""
    found = np.asarray(value)
    if found.ndim == 0 or found.dtype.kind not in "biuf":
        raise InputError(f"{name} must be an array of numbers, found {checks.describe(value)}.")
    copy: np.ndarray = np.array(found, dtype=kind_of(found), order="C")
    copy.flags.writeable = False
    return copy


def compiled(value: Any, meaning: Meaning, unit: TimeUnit | None) -> Any:
    """Return what the compiler gets of a field, checked: a quantity is converted to a ``unit`` of time."""
    return converted(value.copy() if isinstance(value, np.ndarray) else value, meaning.power, unit)


def converted(value: Any, power: int, unit: TimeUnit | None) -> Any:
    """Return numbers of the dimension ``time**power`` in a ``unit`` of time."""
    if value is None or power == 0 or unit is None:
        return value
    if isinstance(value, tuple):
        return tuple(float(unit.to_kernel(each, power)) for each in value)
    return unit.to_kernel(value, power)


def refuse_other_count(value: np.ndarray, n: int, name: str) -> None:
    """Raise InputError where a field has not one value for each of n particles."""
    if len(value) != n:
        raise InputError(f"{name} has {len(value)} values; expected {n}, one a particle.")
