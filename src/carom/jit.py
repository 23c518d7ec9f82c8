"""Compiling a function of one signature by Numba, which is loaded only when something is compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def compiled(function: Callable[..., Any], signature: Any) -> Any:
    """Return a function compiled for one signature, kept on disk; 1 / 0 is infinity, as in NumPy."""
    from carom.compiling.compile_listeners import compiling
    from carom.compiling.dispatch import STRICT  # and with it all that may be inlined

    with compiling():
        made = compiled_on_call(function, **STRICT)
        if hasattr(made, "compile"):  # not without a compiler
            made.compile(signature)
            made.disable_compile()
    return made


def compiled_on_call(function: Callable[..., Any], **options: Any) -> Any:
    """Return a function compiled for whatever it is called with, by Numba's ``options``; stored as well."""
    from carom.compiling.cache import cached

    return cached(function, options)
