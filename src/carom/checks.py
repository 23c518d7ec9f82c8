"""Checks of single values: every input passes them before anything is computed from it."""

from __future__ import annotations

import importlib
import math
import numbers
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.suggestions import suggestion

#: Lengths and masses beyond this, or (where zero has no meaning) below its inverse, are refused: products of
#: six edges and of energies would leave the range of doubles.
MAGNITUDE = 1e30

#: Distances of contact below this part of the largest one are refused. A pair is looked at from about two of
#: the largest away. The square of such a distance is rounded by a thousandth of the square of the smallest
#: one, and whether a pair meets at all could not be told if it were much more.
UNLIKE = 2.0**-20

#: Speeds beyond this are refused: the sums of their squares would leave the range of doubles.
FASTEST = 1e152

#: Temperatures beyond this are refused, for the same reason.
HOTTEST = 1e304

#: Collisions beyond this are never reached.
MOST_COLLISIONS = 2.0**62

#: Rounding error of the fraction of a species, at most: fractions have three digits or more.
ROUNDED = 5e-4

#: Relative errors below this are refused: they would take about 1e18 independent blocks.
FINEST_ERROR = 1e-9


PARTS = {
    "jump": "a, b, virial",
    "step_jump": "a, b, virial, step, kind",
    "exit_time": "the time, and 1 at the upper end or 0",
    "meeting_time": "the time, and whether it is clamped",
}
"""What is answered to questions that ask for several numbers, with a comma between two."""


def needed(module: str, what: str, install: str) -> Any:
    """Import a module that the plain install does not bring; InputError says how to install it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        raise InputError(
            f"{what} needs the package {package}, which is not installed: pip install {install}."
        ) from None


def keys(given: Iterable[str], what: str, known: Iterable[str], *, needed: Iterable[str] = ()) -> None:
    """Raise InputError if ``what`` has a key that is not known, or lacks one that it needs."""
    there, names = list(given), list(known)
    for name in there:
        if name not in names:
            raise InputError(f"{what} has no {str(name)[:40]!r}{suggestion(str(name), names)}.")
    for name in needed:
        if name not in there:
            raise InputError(f"{what} needs {name}, found none.")


def describe(value: Any) -> str:
    """Name a value and its type in a few words, for the end of an error message."""
    if isinstance(value, str):
        shown = value if len(value) <= 40 else value[:37] + "..."
        return f"the string {shown!r}"
    if isinstance(value, bool | np.bool_):
        return f"the boolean {str(bool(value)).lower()}"
    if value is None:
        return "nothing"
    if isinstance(value, int) and abs(value) >= 10**18:
        return "an integer of more than 18 digits"
    if isinstance(value, numbers.Real):
        return f"{value}"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return f"a {type(value).__name__}"


def number(
    value: Any, name: str, *, low: float = -math.inf, high: float = math.inf, open_low: bool = False
) -> float:
    """Return a finite real in bounds (``open_low``: not ``low`` itself) as a float, no boolean or string."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        hint = ""
        if isinstance(value, str):
            hint = " Carom works in reduced units, so write a plain number without quotes or a unit."
        raise InputError(f"{name} must be a number, found {describe(value)}.{hint}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise InputError(f"{name} must be finite, found {describe(value)}.")
    if result < low or result > high or (open_low and result == low):
        raise InputError(f"{name} must be {_range(low, high, open_low)}, found {describe(value)}.")
    return result


def integer(value: Any, name: str, *, low: int, high: int | None = None) -> int:
    """Return an integer of at least ``low`` and at most ``high``, or raise InputError (as :func:`number`)."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        hint = " Write it without quotes or a unit." if isinstance(value, str) else ""
        raise InputError(f"{name} must be an integer, found {describe(value)}.{hint}")
    result = int(value)
    if result < low or (high is not None and result > high):
        limits = f"at least {low}" if high is None else f"between {low} and {high}"
        raise InputError(f"{name} must be {limits}, found {describe(value)}.")
    return result


def axis(value: Any) -> int:
    """Return the number of an axis that is given as that or as x, y or z, or raise InputError."""
    if isinstance(value, str):
        if value not in ("x", "y", "z"):
            raise InputError(f"axis must be x, y, z or a number from 0, found {describe(value)}.")
        return "xyz".index(value)
    return integer(value, "axis", low=0)


def collisions_of(per_particle: float, n: int) -> int:
    """Return the pair collisions of n particles, at most the number that can be counted."""
    return round(min(0.5 * n * min(per_particle, MOST_COLLISIONS), MOST_COLLISIONS))


def answer(question: str | Callable[..., Any], model: Any, *arguments: Any) -> tuple[Any, ...]:
    """Return the numbers that a ``model`` answers, NaN where Python finds none: compiled code goes on.

    The question is the name of a method, or a function that is given the model.

    It raises InputError where they are not as many as are asked for with the ``arguments``.
    """
    name = question if isinstance(question, str) else question.__name__
    wanted = PARTS.get(name, "a number")
    count = wanted.count(",") + 1
    ask: Any = getattr(model, name) if isinstance(question, str) else partial(question, model)
    try:
        found = ask(*arguments)
    except (ArithmeticError, ValueError):
        return (math.nan,) * count
    each = found if count > 1 and isinstance(found, tuple) else (found,)
    if len(each) != count or any(np.ndim(x) or np.asarray(x).dtype.kind not in "biuf" for x in each):
        word = name.removesuffix("_of")  # as the user writes it
        raise InputError(f"{word} of {type(model).__name__} must return {wanted}, found {describe(found)}.")
    return each


def positive(value: Any, name: str) -> float:
    """Return a number between 1 / MAGNITUDE and MAGNITUDE: a length or a mass."""
    result = number(value, name)
    if result <= 0:
        raise InputError(f"{name} must be positive, found {result:g}.")
    return number(value, name, low=1 / MAGNITUDE, high=MAGNITUDE)


def several(value: Any) -> bool:
    """Tell whether a value is an array, perhaps with unequal rows, rather than a single number."""
    try:
        return np.ndim(value) > 0
    except ValueError:
        return True


def array(value: Any, name: str, shape: str, *, ndim: int) -> np.ndarray:
    """Return a copy of an array of finite numbers with ``ndim`` axes as float64, C-contiguous.

    ``name`` and ``shape``, e.g. "positions" and "(n, d)", are for the message.
    """
    try:
        given = np.asarray(value)
        if isinstance(value, Sequence) and any(
            isinstance(x, bool | np.bool_) for x in np.asarray(value, dtype=object).flat
        ):
            # A boolean among numbers becomes 1.0 silently.
            given = np.zeros(given.shape, dtype=bool)
    except (ValueError, TypeError, OverflowError) as problem:
        raise InputError(
            f"{name} must be an array {shape} of numbers, found rows of unequal length."
        ) from problem
    if given.dtype.kind not in "iuf":
        kinds = {
            "b": "booleans",
            "U": "strings",
            "S": "strings",
            "c": "complex numbers",
            "O": "objects that are no numbers",
        }
        found = kinds.get(given.dtype.kind, f"values of type {given.dtype}")
        raise InputError(f"{name} must be an array {shape} of numbers, found {found}.")
    if given.ndim != ndim:
        raise InputError(f"{name} must be an array of shape {shape}, found shape {given.shape}.")
    with np.errstate(over="ignore"):
        result = np.array(given, dtype=np.float64, order="C", copy=True)
    finite = np.isfinite(result)
    if not finite.all():
        where = tuple(int(k) for k in np.argwhere(~finite)[0])
        index = ", ".join(map(str, where))
        raise InputError(f"{name} must be finite, found {result[where]} at [{index}].")
    return result


def shares(fractions: Any, instead: str = "change them, or give counts") -> np.ndarray:
    """Return the fractions of K species, which may be rounded, (K,) with the sum 1; ``instead`` is advice."""
    found = array(fractions, "fractions", "(K,)", ndim=1)
    if not found.size or found.min() < 0.0 or found.max() == 0.0:
        raise InputError("fractions must be numbers of at least zero, not all of them zero.")
    total = float(found.sum())
    if not abs(total - 1.0) <= ROUNDED * found.size:
        raise InputError(
            f"The fractions of the species add up to {total:.6g}, and all particles are 1: {instead}."
        )
    return found / total


def _range(low: float, high: float, open_low: bool) -> str:
    """Return the allowed range of a number in words."""
    least = f"greater than {low:g}" if open_low else f"at least {low:g}"
    if math.isinf(high):
        return least
    if math.isinf(low):
        return f"at most {high:g}"
    return f"{least} and at most {high:g}"
