"""An old or wrong keyword of a simulation is answered with the right one."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from carom import checks

P = ParamSpec("P")
T = TypeVar("T")

MEANT = {
    "workers": "cores",
    "max_walltime": "walltime",
    **{name: f"tuning=carom.Tuning({name}=...)" for name in ("neighbors", "shell", "images", "precision")},
}
"""Other words, and what they are called."""


def corrected(function: Callable[P, T]) -> Callable[P, T]:
    """Let a function with keywords refuse one that it does not have by an InputError with the one meant."""
    parameters = inspect.signature(function).parameters
    known = [name for name, each in parameters.items() if each.kind is each.KEYWORD_ONLY]
    named = "Simulation" if function.__name__ == "__init__" else f"{function.__name__}()"

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> T:
        checks.refuse_unknown(named, [name for name in kwargs if name not in parameters], MEANT, known)
        return function(*args, **kwargs)

    return checked
