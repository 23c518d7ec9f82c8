"""Functions that compiled code may call: noted where they are defined, compiled once the engine is there.

A scene is a handful of small models (``NamedTuple``s). A basic function of the paper asks a model a
*question*; its answer for a type of model is registered with ``@question.register``. The compiler chooses the
answer by the type, so what a scene does not have leaves no branch and no byte behind. Called from Python, a
question is :func:`functools.singledispatch`.

This module knows no compiler. ``carom.compiling.dispatch`` attaches one, so files of models import no Numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch, wraps
from typing import Any

Compile = Callable[[Any, str], None]

_noted: list[tuple[Any, str]] = []
_compilers: list[Compile] = []


def _note(function: Any, how: str) -> Any:
    _noted.append((function, how))
    for compile_ in _compilers:
        compile_(function, how)
    return function


def attach(compile_: Compile) -> None:
    """Hand every function noted so far, and every later one, to a compiler.

    Parameters
    ----------
    compile_ : callable
        Called with the function and how it is meant: the name of the decorator.
    """
    for function, how in _noted:
        compile_(function, how)
    _compilers.append(compile_)


def inner(function):
    """Let compiled code inline a function. Called from Python it is unchanged."""
    return _note(function, "inner")


def fast(function):
    """As :func:`inner`, with vectorised loops."""
    return _note(function, "fast")


def approximate(function):
    """As :func:`fast`, with contraction: to choose whom to look at, never for a time that is kept."""
    return _note(function, "approximate")


def required(function):
    """Make ``function(model, ...)`` a question that every model of its kind must answer.

    The function itself is only a docstring. Answers are registered with ``@function.register``, and have the
    same parameters.
    """

    @wraps(function)
    def unanswered(model, *args):
        raise TypeError(f"{type(model).__name__} has no {function.__name__}: register one.")

    return _note(singledispatch(unanswered), "required")


def optional(function):
    """Make ``function(model, ...)`` a question; its body is the answer of models that register no other."""
    return _note(singledispatch(function), "optional")


def answers(question, kind: type) -> bool:
    """Tell whether a type of model has an answer of its own to a question."""
    return kind in question.registry
