"""Shared by the equations of state: checked packing fractions, polynomials, Pade approximants."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from carom.checks import describe
from carom.errors import InputError

Equation = Callable[[Any], Any]


def of_numbers(function: Any) -> Any:
    """Return a function that refuses text in place of a number, or what is no function as it is."""
    if not inspect.isfunction(function):
        return function
    names = [*inspect.signature(function).parameters]

    @functools.wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        for name, value in {**dict(zip(names, args, strict=False)), **kwargs}.items():
            refuse_text(value, name)
        return function(*args, **kwargs)

    return checked


def refuse_text(value: Any, name: str) -> None:
    """Raise InputError for text, or a list or an array with text in it."""
    if isinstance(value, str | bytes):
        functions = ("equation", "fluid", "solid")
        expected = "an equation of state" if name in functions else "a number or an array of numbers"
        raise InputError(f"{name} must be {expected}, found {describe(value)}; leave out the quotes.")
    if isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.dtype.kind in "OSU"):
        for each in value.ravel() if isinstance(value, np.ndarray) else value:
            refuse_text(each, name)


def checked(packing_fraction: Any) -> Any:
    """Return a packing fraction as a float or an array; InputError unless it lies in [0, 1)."""
    refuse_text(packing_fraction, "packing_fraction")
    eta = np.asarray(packing_fraction, dtype=np.float64)
    if not ((eta >= 0.0) & (eta < 1.0)).all():
        raise InputError(f"packing_fraction is {packing_fraction!r}; it lies between 0 and 1.")
    return eta if eta.ndim else float(eta)


def horner(coefficients: Any, x: Any) -> Any:
    """Return the polynomial with these coefficients, the constant first."""
    total = 0.0 * x
    for c in reversed(coefficients):
        total = total * x + float(c)
    return total


def pade(series: np.ndarray, above: int, below: int) -> tuple[np.ndarray, np.ndarray]:
    """Return numerator and denominator (constant term 1) of the Pade approximant of `series`."""

    def term(k: int) -> float:
        return float(series[k]) if k >= 0 else 0.0

    denominator = np.ones(1)
    if below:
        matrix = np.array([[term(above + i - j) for j in range(1, below + 1)] for i in range(1, below + 1)])
        right = -np.array([term(above + i) for i in range(1, below + 1)])
        denominator = np.concatenate(([1.0], np.linalg.solve(matrix, right)))
    numerator = np.convolve(series[: above + 1], denominator)[: above + 1]
    return numerator, denominator
