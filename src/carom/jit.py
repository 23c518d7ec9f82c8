"""Compiling a function of one signature by Numba, which is loaded only when something is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def compiled(function: Callable[..., Any], signature: Any) -> Any:
    """Return a function compiled for one signature, from the cache of an earlier process where there is one.

    With one signature, all processes that write to the cache at one time write the same. Where no folder for
    the cache can be written, nothing is kept. Divisions by zero give infinity, as in NumPy, and other threads
    run meanwhile.
    """
    from numba import njit

    options: dict[str, Any] = {"error_model": "numpy", "nogil": True}
    try:
        return njit(signature, cache=True, **options)(function)
    except (RuntimeError, OSError):
        return njit(signature, **options)(function)
