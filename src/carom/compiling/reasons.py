"""Why Numba cannot compile a function of the user's: one sentence instead of a page."""

from __future__ import annotations

import itertools
import linecache
import re
import warnings
from pathlib import Path
from typing import Any

NAMED = re.compile(r"Function\(<(?:built-in )?(?:function|intrinsic) ([\w.]+)[^>]*>\)")
"""How Numba names a function that it has no implementation of."""

STEP = "Failed in nopython mode pipeline"
"""The line before each reason, from the outermost function to the innermost."""


def comes_from_numba(error: BaseException) -> bool:
    """Tell whether an error is the compiler's, and not that of what has been compiled."""
    return type(error).__module__.partition(".")[0] == "numba"


def reason(function: Any, *arguments: Any) -> str | None:
    """Return why a function of the user's cannot be compiled, or None where it can.

    Parameters
    ----------
    function : callable
        In plain Python.
    *arguments
        Values of the types that it is called with.
    """
    from numba import njit, typeof

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            njit(function).compile(tuple(typeof(argument) for argument in arguments))
    except Exception as error:  # Numba has classes of errors without a common one
        return _shortened(str(error), function.__code__.co_filename)
    return None


def _shortened(page: str, path: str) -> str:
    """Return the innermost line of the user's file that Numba's page names, and what it says of it."""
    places = re.finditer(r'File "([^"\n]*)", line (\d+)', page)
    found = next((place for place in places if Path(place[1]).name == Path(path).name), None)
    lines = (page if found is None else page[: found.start()]).strip().splitlines()
    said = [after.strip() for before, after in itertools.pairwise(lines) if STEP in before]
    # What Numba makes of its own functions says nothing to who did not write them.
    said = [line for line in said if "<intrinsic " not in line] or lines[:1]
    words = NAMED.sub(r"\1", said[-1]).partition(" found for signature")[0].partition(". Raised from")[0]
    words = words[:120].rstrip(".")
    if found is None:
        return words
    number = int(found[2])
    code = linecache.getline(path, number).strip()[:60]
    return f"line {number} of {Path(path).name}" + (f", `{code}`" if code else "") + f": {words}"
