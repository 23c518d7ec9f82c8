"""Arguments as compiled code takes them: one block of 8-byte words; the first names room for answers.

Models, tuples, text and None are no words: code is compiled for their types. An array is the address of its
first element and its lengths. Whoever calls holds the arrays for as long.
"""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    FLOAT64,
    INT64,
    LINE,
    NONE,
    OF_DTYPE,
    POINTER,
    UINT64,
    Array,
    Known,
    Leaf,
    Several,
    Type,
)

FAULT_WORDS = 3  # before the answers: what failed, and two numbers that are told with it


class Flat:
    """Arguments taken apart: the words, how they are written, and all that code depends on."""

    __slots__ = ("form", "kind", "words")

    def __init__(self, arguments: tuple[Any, ...]):
        self.words: list[Any] = []
        self.form: list[str] = []
        self.kind: list[Any] = []
        for each in arguments:
            self._add(each)

    def _add(self, value: Any) -> None:
        kind = type(value)
        if value is None:
            self.kind.append(None)
        elif isinstance(value, tuple):
            self.kind += (kind, len(value))
            for each in value:
                self._add(each)
        elif isinstance(value, str):
            self.kind.append(("text", value))
        elif isinstance(value, np.ndarray):
            known = _arrays.get(id(value))
            _, kinds, words, form = known if known and known[0]() is value else _noted(value)
            self.kind += kinds
            self.words += words
            self.form.append(form)
        else:
            number = _type_of(value)
            self.kind.append(number)
            self.words.append(bool(value) if number is BOOL else value)
            self.form.append("d" if number.is_float else "q" if number.signed or number is BOOL else "Q")


_arrays: dict[int, tuple[Any, tuple[Any, ...], tuple[int, ...], str]] = {}
"""What arrays are as arguments, by ``id``: NumPy needs microseconds to say where one lies."""


def _noted(value: np.ndarray) -> tuple[Any, tuple[Any, ...], tuple[int, ...], str]:
    """Note for as long as an array lives what it is among the arguments, and return it."""
    spaced = is_spaced(value)
    if not (spaced or value.flags.c_contiguous):
        raise ValueError(f"An array of shape {value.shape} must be contiguous.")
    key, shape = id(value), value.shape
    reference = weakref.ref(value, lambda gone: _forget(key, gone))
    words = value.ctypes.data, *shape
    kinds = (value.dtype, (len(shape), "spaced") if spaced else len(shape))
    _arrays[key] = found = reference, kinds, words, "Q" + "q" * len(shape)
    return found


def is_spaced(value: np.ndarray) -> bool:
    """Tell whether each element of an array is on a cache line of its own."""
    return value.strides == (LINE,) and not value.flags.c_contiguous


def _forget(key: int, gone: Any) -> None:
    if key in _arrays and _arrays[key][0] is gone:  # another may be there by now
        del _arrays[key]


def _type_of(value: Any) -> Type:
    """Return the type of a number among the arguments."""
    if isinstance(value, np.generic):
        found = OF_DTYPE.get(value.dtype)
        if found is not None:
            return found if found.is_float or found is BOOL or found is UINT64 else INT64
    elif isinstance(value, bool):
        return BOOL
    elif isinstance(value, int):
        return INT64
    elif isinstance(value, float):
        return FLOAT64
    raise Untranslatable(f"{value!r} is no number, array, tuple or None")


def symbols(arguments: tuple[Any, ...]) -> tuple[list[Any], int]:
    """Return what arguments are while code is compiled for them, and the number of all words."""
    place = 1

    def symbol(value: Any) -> Any:
        nonlocal place
        if value is None:
            return NONE
        if isinstance(value, str):
            return Known(value)
        if isinstance(value, tuple):
            return Several(type(value), [symbol(each) for each in value])
        if isinstance(value, np.ndarray):
            data, place = Leaf(place, POINTER), place + 1 + value.ndim
            lengths = [Leaf(place - value.ndim + k, INT64) for k in range(value.ndim)]
            return Array(value.dtype, data, lengths, spaced=is_spaced(value))
        place += 1
        return Leaf(place - 1, _type_of(value))

    return [symbol(each) for each in arguments], place
