"""Kernels of analysis, compiled by Numba, which is loaded only when one is needed."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from types import FunctionType
from typing import Any


def compiled(function: Callable[..., Any], signature: Any = None, **options: Any) -> Any:
    """Return a function, and those of this package that it calls, compiled by Numba's ``options``.

    It is kept on disk, and compiled for one signature or for whatever it is called with. As in NumPy, 1 / 0
    is infinite.
    """
    from numba import njit

    how = {"error_model": "numpy", "nogil": True, **options}
    return njit(signature, cache=True, **how)(_linked(function, lambda each: njit(**how)(each)))


def _linked(function: Any, compile_: Callable[[Any], Any]) -> Any:
    """Return a copy of a function that calls compiled functions.

    Numba's cache looks at the source of a function alone: the name of the copy says what it calls, too.
    """
    scope, said = dict(function.__globals__), hashlib.sha256()
    for name in function.__code__.co_names:
        called = scope.get(name)
        if isinstance(called, FunctionType) and called.__module__.partition(".")[0] == "carom":
            linked = _linked(called, compile_)
            said.update(
                repr((linked.__qualname__, called.__code__.co_code, called.__code__.co_consts)).encode()
            )
            scope[name] = compile_(linked)
        elif isinstance(called, int | float):
            said.update(repr((name, called)).encode())
    copy = FunctionType(
        function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__module__, copy.__qualname__ = (
        function.__module__,
        f"{function.__qualname__}_{said.hexdigest()[:16]}",
    )
    return copy
