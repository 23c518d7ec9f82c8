"""Compiling a function of one signature by Numba, which is loaded only when something is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def compiled(function: Callable[..., Any], signature: Any) -> Any:
    """Return a function compiled for one signature, kept on disk; 1 / 0 is infinity, as in NumPy."""
    import numba

    return numba.njit(signature, error_model="numpy", nogil=True, cache=True)(function)


def compiled_on_call(function: Callable[..., Any], **options: Any) -> Any:
    """Return a function compiled for whatever it is called with, by Numba's ``options``; stored as well."""
    import numba

    return numba.njit(cache=True, **options)(function)
