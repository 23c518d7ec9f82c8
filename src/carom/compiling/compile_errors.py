"""Why Numba cannot compile what is the user's: one sentence instead of a page."""

from __future__ import annotations

import itertools
import linecache
import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

NAMED = re.compile(r"Function\(<(?:built-in )?(?:function|intrinsic) ([\w.]+)[^>]*>\)")
"""How Numba names a function that it has no implementation of."""

STEP = "Failed in nopython mode pipeline"
"""The line before each reason, from the outermost function to the innermost."""

PLACE = re.compile(r'File "([^"\n]*)", line (\d+)')
"""How Numba names a line, from that of the innermost function to the outermost."""


def comes_from_numba(error: BaseException) -> bool:
    """Tell whether an error, or its cause, is the compiler's, and not that of what has been compiled."""
    raised = (error, error.__cause__)
    return any(type(each).__module__.partition(".")[0] == "numba" for each in raised)


def reason(function: Any, *arguments: Any) -> str | None:
    """Return why a function of the user's cannot be compiled, or None where it can."""
    from numba import njit, typeof

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            njit(function).compile(tuple(typeof(argument) for argument in arguments))
    except Exception as error:  # Numba has classes of errors without a common one
        page, name = str(error), Path(function.__code__.co_filename).name
        places = PLACE.finditer(page)
        return _shortened(page, next((address for address in places if Path(address[1]).name == name), None))
    return None


def unknown_part(value: Any, name: str) -> tuple[str, Any] | None:
    """Return what in the field of a model no type of the compiler stands for: where it is, and what it is."""
    if isinstance(value, np.ndarray) and value.dtype.char in "?bBhHiIlLqQfdFD" and value.dtype.isnative:
        return None
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", None)
        places = [f"[{k}]" for k in range(len(value))] if fields is None else [f".{each}" for each in fields]
        parts = (unknown_part(each, name + address) for each, address in zip(value, places, strict=True))
        return next((part for part in parts if part is not None), None)
    if value is None or isinstance(value, bool | float | complex):
        return None
    # Numba takes lists apart for each call, and not within a tuple; of objects it knows that they are some.
    if isinstance(value, list | dict | set) or (isinstance(value, np.ndarray) and value.dtype.hasobject):
        return name, value
    from numba import typeof

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return None if typeof(value) is not None else (name, value)
    except Exception:  # Numba has classes of errors without a common one
        return name, value


def of_models(error: Exception, answers: Sequence[tuple[str, type, Callable[..., Any]]]) -> str:
    """Return a sentence that says why models cannot be compiled."""
    page = str(error) or type(error).__name__
    for address in PLACE.finditer(page):
        for question, model, function in answers:
            code = function.__code__
            last = max(line for *_, line in code.co_lines() if line is not None)
            ours = Path(address[1]).name == Path(code.co_filename).name
            if ours and code.co_firstlineno <= int(address[2]) <= last:
                return f"{question} of {model.__name__} cannot be compiled: {_shortened(page, address)}."
    names = " or ".join(dict.fromkeys(model.__name__ for _, model, _ in answers))
    return f"{names} cannot be compiled: {_shortened(page, None)}."


def _shortened(page: str, found: re.Match[str] | None) -> str:
    """Return what Numba's page says, of the line of the user's that was found there."""
    lines = (page if found is None else page[: found.start()]).strip().splitlines()
    messages = [after.strip() for before, after in itertools.pairwise(lines) if STEP in before]
    # What Numba makes of its own functions says nothing to who did not write them.
    messages = [line for line in messages if "<intrinsic " not in line] or lines[:1]
    words = NAMED.sub(r"\1", messages[-1]).partition(" found for signature")[0].partition(". Raised from")[0]
    words = words[:120].rstrip(".")
    if found is None:
        return words
    number = int(found[2])
    code = linecache.getline(found[1], number).strip()[:60]
    return f"line {number} of {Path(found[1]).name}" + (f", `{code}`" if code else "") + f": {words}"
