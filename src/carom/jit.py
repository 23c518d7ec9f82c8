"""Compiling a function of one signature by Numba, which is loaded only when something is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def compiled(function: Callable[..., Any], signature: Any) -> Any:
    """Return a function compiled for one signature, or loaded from Numba's cache of an earlier process.

    With one signature, processes that write to the cache at the same time write the same content. If no
    folder for the cache can be written, nothing is stored. Division by zero gives infinity, as in NumPy.
    Other threads can run meanwhile.
    """
    from numba import njit

    options: dict[str, Any] = {"error_model": "numpy", "nogil": True}
    try:
        return njit(signature, cache=True, **options)(function)
    except (RuntimeError, OSError):
        return njit(signature, **options)(function)
