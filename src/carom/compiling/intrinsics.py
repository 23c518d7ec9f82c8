"""Functions in plain Python for which compiled code takes instructions of its own."""

from __future__ import annotations

import inspect

from numba.extending import intrinsic, overload

from carom.compiling.dispatch import INLINE


def compiled_as(function):
    """Let compiled code take an intrinsic, which is decorated, for a ``function`` of the same parameters."""

    def decorate(answer):
        scope = {"__name__": __name__, "made": intrinsic(answer)}
        names = ", ".join(inspect.signature(function).parameters)
        exec(f"def body({names}):\n    return made({names})", scope)
        overload(function, strict=False, jit_options=INLINE)(lambda *args: scope["body"])
        return scope["made"]

    return decorate
