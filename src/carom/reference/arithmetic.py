"""Numbers of the reference algorithms: floats, mpmath at any precision, or exact fractions."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Literal, NamedTuple

import numpy as np

from carom.errors import InputError

ArithmeticName = Literal["float", "mpmath", "fraction"]

NEVER = math.inf
"""The time of an event that never occurs; it compares with every kind of number used here."""


class Arithmetic(NamedTuple):
    """How to make a number and how to take a root."""

    name: str  # "float", "mpmath" or "fraction"
    number: Callable[[Any], Any]
    """Converts an int, str, Fraction, or float, taken as the exact binary number that it is."""
    sqrt: Callable[[Any], Any]  # root of a non-negative number

    def array(self, values: Any, what: str) -> np.ndarray:
        """Return `values` as an array of numbers (float64 or object), all finite."""
        raw = np.array(values, dtype=object)
        dtype = float if self.name == "float" else object
        out = np.empty(raw.shape, dtype=dtype)
        for index, value in np.ndenumerate(raw):
            try:
                finite = math.isfinite(float(value) if not isinstance(value, str) else float(Fraction(value)))
                if finite:
                    out[index] = self.number(_plain(value))
            except (TypeError, ValueError, OverflowError) as error:
                raise InputError(f"{what} has {value!r} where a number is expected.") from error
            if not finite:
                raise InputError(f"{what} has {value!r}; every value must be finite.")
        return out


def _plain(value: Any) -> Any:
    """Return a scalar of NumPy as a Python number: mpmath and Fraction do not know all of its types."""
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, np.floating):
        return float(value)
    return value


def _fraction_sqrt(value: Fraction) -> Fraction:
    """Return the square root of a fraction; raise InputError if it is irrational."""
    top, bottom = math.isqrt(value.numerator), math.isqrt(value.denominator)
    if top * top != value.numerator or bottom * bottom != value.denominator:
        raise InputError(
            "A collision time has an irrational square root, which a Fraction cannot hold: in fraction "
            'arithmetic only d = 1 and head-on meetings are exact; use arithmetic="mpmath".'
        )
    return Fraction(top, bottom)


def make_arithmetic(name: str, digits: int = 50) -> Arithmetic:
    """Return the arithmetic ``name``: float (doubles), mpmath with so many digits, or exact fractions.

    mpmath has a context of its own: the global ``mpmath.mp`` is neither read nor changed.
    """
    if name == "float":
        return Arithmetic(
            name, lambda value: float(Fraction(value)) if isinstance(value, str) else float(value), math.sqrt
        )
    if name == "fraction":
        return Arithmetic(name, Fraction, _fraction_sqrt)
    if name != "mpmath":
        raise InputError(f'arithmetic is {name!r}; expected "float", "mpmath" or "fraction".')
    if digits < 15:
        raise InputError(f"digits is {digits}; mpmath needs at least 15, or it is worse than a float.")
    try:
        import mpmath
    except ImportError as error:
        raise InputError('mpmath is not installed: install it, or use arithmetic="float".') from error
    context = mpmath.mp.clone()
    context.dps = digits

    def number(value: Any) -> Any:
        if isinstance(value, Fraction):
            return context.mpf(value.numerator) / value.denominator
        return context.mpf(value)

    return Arithmetic(name, number, context.sqrt)
