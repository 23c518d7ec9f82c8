"""Functions that compiled code may call: noted where they are defined, compiled once the engine is there.

A basic function of the paper asks a small model (a ``NamedTuple``) a *question*. The compiler chooses the
answer registered for its type: what a scene does not have leaves no branch. From Python it is
:func:`functools.singledispatch`; ``carom.compiling.dispatch`` attaches the compiler, so models import no
Numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch, wraps
from inspect import CO_VARARGS
from types import FunctionType
from typing import Any

from carom.errors import InputError

Compile = Callable[[Any, str], None]

_noted: list[tuple[Any, str]] = []
_compilers: list[Compile] = []


def _note(function: Any, how: str) -> Any:
    _noted.append((function, how))
    for compile_ in _compilers:
        compile_(function, how)
    return function


def attach(compile_: Compile) -> None:
    """Hand every function noted so far, and every later one, to a compiler."""
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
    """Make a function, only a docstring, a question that all models of its kind must answer."""

    @wraps(function)
    def unanswered(model, *args):
        raise TypeError(f"{type(model).__name__} has no {function.__name__}: register one.")

    return _note(_strict(singledispatch(unanswered), function), "required")


def optional(function):
    """Make ``function(model, ...)`` a question; its body is the answer of models that register no other."""
    return _note(_strict(singledispatch(function), function), "optional")


def answering(*places):
    """Let the methods of a class of models answer the questions of their names: a class decorator."""
    asked = {
        name: each
        for place in places
        for name, each in ({place.__name__: place} if hasattr(place, "registry") else vars(place)).items()
        if hasattr(each, "registry")
    }

    def decorate(kind):
        for name, method in list(vars(kind).items()):
            if name in asked and isinstance(method, FunctionType):  # a field may have the name of a question
                asked[name].register(kind)(method)
        return kind

    return decorate


def _strict(generic, question):
    """Let ``generic.register`` refuse an answer that has not the parameters of the question."""
    register, wanted = generic.register, question.__code__

    def register_alike(*args):
        answer = args[-1]
        code = getattr(answer, "__code__", None)
        if isinstance(answer, type) and len(args) == 1:  # the answer comes next
            return lambda answer: register_alike(*args, answer)
        if code is None or code.co_flags & CO_VARARGS or answer is generic.registry[object]:
            return register(*args)
        if len(args) == 1 and not getattr(answer, "__annotations__", None):
            raise InputError(
                f"An answer to {question.__name__} must say which type of model it is for: annotate its "
                f"first parameter, def _({wanted.co_varnames[0]}: YourModel, ...)."
            )
        if code.co_argcount != wanted.co_argcount:
            names = wanted.co_varnames[: wanted.co_argcount]
            raise InputError(
                f"An answer to {question.__name__} takes {wanted.co_argcount} parameters "
                f"({', '.join(names)}), found {code.co_argcount} in {code.co_filename}, line "
                f"{code.co_firstlineno}."
            )
        return register(*args)

    generic.register = register_alike
    return generic


def room_for(x):
    """Return room on the caller's stack for a place like x, (d,) float64."""
    import numpy as np  # compiled code has instructions instead

    return np.zeros(len(x))


def is_noted(function: Any) -> bool:
    """Tell whether compiled code may call a function already."""
    return any(each is function for each, _ in _noted)


def answers(question, kind: type) -> bool:
    """Tell whether a type of model has an answer of its own to a question."""
    return kind in question.registry
