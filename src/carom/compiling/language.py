"""What a name can stand for while a function is translated: the types and values of the language.

docs/decisions/18-front-end.md has the language on a page. Tuples, models and functions exist while compiling
only; at run time there are numbers, pointers and the words of the context (``carom.compiling.context``).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np


@dataclass(frozen=True, eq=False, slots=True)
class Type:
    """A type of numbers, or of pointers."""

    name: str
    llvm: str
    bits: int
    signed: bool = True
    is_float: bool = False

    def __repr__(self) -> str:
        return self.name


FLOAT64, FLOAT32 = Type("float64", "double", 64, True, True), Type("float32", "float", 32, True, True)
INT64, UINT64 = Type("int64", "i64", 64), Type("uint64", "i64", 64, False)
INT32, UINT32 = Type("int32", "i32", 32), Type("uint32", "i32", 32, False)
INT16, UINT16 = Type("int16", "i16", 16), Type("uint16", "i16", 16, False)
INT8, UINT8 = Type("int8", "i8", 8), Type("uint8", "i8", 8, False)
BOOL = Type("bool", "i1", 1, False)
POINTER = Type("pointer", "ptr", 64, False)

LINE = 64  # bytes of a cache line

NUMBERS = (FLOAT64, FLOAT32, INT64, UINT64, INT32, UINT32, INT16, UINT16, INT8, UINT8, BOOL)

OF_DTYPE: dict[Any, Type] = {np.dtype(each.name): each for each in NUMBERS}

OF_CLASS: dict[Any, Type] = {
    **{np.dtype(each.name).type: each for each in NUMBERS},
    int: INT64,
    float: FLOAT64,
    bool: BOOL,
}
"""What a number becomes that is given to one of these classes."""


class Known:
    """What is known while compiling: a number, or anything else (then without a type)."""

    __slots__ = ("type", "value")

    def __init__(self, value: Any, type: Type | None = None):
        if isinstance(value, enum.Enum) and isinstance(value, int):
            value = value.value
        if type is None and isinstance(value, (np.generic, bool, int, float)):
            if isinstance(value, np.generic):
                type, value = OF_DTYPE.get(value.dtype), value.item()
            else:
                type = BOOL if isinstance(value, bool) else INT64 if isinstance(value, int) else FLOAT64
        self.value = value
        self.type: Any = type

    def same(self, other: Any) -> bool:
        """Tell whether another value is this one, to the sign of a zero."""
        if not isinstance(other, Known) or self.type is not other.type:
            return False
        return self.value is other.value or (
            self.type is not None and self.value == other.value and repr(self.value) == repr(other.value)
        )


NONE = Known(None)


class Number:
    """A number at run time: its type, and the text that names it."""

    __slots__ = ("natural", "text", "type")

    def __init__(self, type: Type, text: str, natural: bool = False):
        self.type, self.text = type, text
        self.natural = natural  # whether it is known not to be negative


class Candidate(Number):
    """The int64 index of the component that a search looks at."""

    __slots__ = ()


class Leaf(NamedTuple):
    """A word of the context; a pointer if its type says so."""

    place: int
    type: Type


class Slot(NamedTuple):
    """The place of a variable: a type, and the text of its address."""

    type: Type
    address: str


class Several(NamedTuple):
    """A tuple, or a model, of values."""

    cls: type
    items: list


class Array(NamedTuple):
    """An array, contiguous or of one element a line: its first is at ``data``, a Leaf, a Slot or a text."""

    dtype: np.dtype
    data: Any
    lengths: list  # numbers, one a dimension
    local: bool = False  # whether it lies on the stack of the function
    constant: bool = False  # whether it is known while compiling, and not to be written
    spaced: bool = False  # whether each element is on a cache line of its own


class Record(NamedTuple):
    """An element of an array of records; ``address`` is a Slot or a text."""

    dtype: np.dtype
    address: Any


class Lined(NamedTuple):
    """An array of one value a component, and those of the candidates side by side, from an index on."""

    array: Array
    lane: Array
    address: Number


class Bound(NamedTuple):
    """A function, and the value whose attribute it is."""

    function: Any
    owner: Any


def described(value: Any) -> str:
    """Return what a value is, for a sentence."""
    if isinstance(value, Several):
        return "a tuple" if value.cls is tuple else f"a {value.cls.__name__}"
    if isinstance(value, Array | Lined):
        return "an array"
    if isinstance(value, Record):
        return "a record"
    if isinstance(value, Known) and value.type is None:
        given = value.value
        return getattr(given, "__name__", None) or repr(given)[:40]
    return f"a number of type {value.type}" if hasattr(value, "type") else "a method"


def wrapped(value: int, kind: Type, signed: bool | None = None) -> int:
    """Return an integer as one of a type; ``signed`` for how it is written."""
    value &= (1 << kind.bits) - 1
    if (kind.signed if signed is None else signed) and value >> (kind.bits - 1):
        value -= 1 << kind.bits
    return value
