"""What is outside of the language, in one sentence: where it stands, what it is, what to write instead."""

from __future__ import annotations

import linecache
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import CaromError


class Untranslatable(CaromError):
    """A function cannot be compiled; ``function`` is the Python function in which that is, if it is known."""

    def __init__(self, words: str, function: Any = None, place: str = ""):
        super().__init__(f"{place}: {words}" if place else words)
        self.words, self.function, self.place = words, function, place

    def at(self, function: Any, path: str, line: int) -> Untranslatable:
        """Return the same with the place of the innermost line, which is told first."""
        if self.place:
            return self
        code = linecache.getline(path, line).strip()[:60]
        place = f"line {line} of {Path(path).name}" + (f", `{code}`" if code else "")
        return Untranslatable(self.words, function, place)


def of_models(error: Untranslatable, methods: Sequence[tuple[type, Any]]) -> str:
    """Return a sentence about one of the user's models, from classes and their methods."""
    for model, method in methods:
        if method is error.function:
            return f"{method.__name__} of {model.__name__} cannot be compiled: {error}."
    return f"{error.function.__qualname__} cannot be compiled: {error}."


def unknown_part(value: Any, name: str) -> tuple[str, Any] | None:
    """Return what in the field of a model no type of the language stands for: where it is, and what it is."""
    if value is None or isinstance(value, str | bool | int | float | np.bool_ | np.integer | np.floating):
        return (name, value) if isinstance(value, int) and not -(2**63) <= value < 2**63 else None
    if (
        isinstance(value, np.ndarray)
        and value.dtype.isnative
        and (value.dtype.char in "?bBhHiIlLqQfd" or value.dtype.names)
    ):
        return None
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", None)
        places = [f"[{k}]" for k in range(len(value))] if fields is None else [f".{each}" for each in fields]
        parts = (unknown_part(each, name + address) for each, address in zip(value, places, strict=True))
        return next((part for part in parts if part is not None), None)
    return name, value
