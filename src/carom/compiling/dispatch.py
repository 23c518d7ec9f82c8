"""The compiler of what the registry notes: Numba chooses an answer by a model's type while it infers types.

The same source runs as plain Python under ``NUMBA_DISABLE_JIT=1``.
"""

from __future__ import annotations

import gc
from contextlib import suppress
from functools import partial, wraps
from typing import Any

from numba import config

from carom.compiling import registry
from carom.compiling.cache import cached
from carom.compiling.code_digest import FACES, INLINED, Unknown, class_of, classes_in
from carom.compiling.compile_errors import of_models
from carom.compiling.compile_listeners import compiling
from carom.compiling.deferred_signals import signals_held
from carom.compiling.inlined_compiler import InlinedCompiler, OurCompiler, compile_once
from carom.errors import InputError

# Division must not test for zero, or no loop that divides can be vectorised.
STRICT: Any = {"error_model": "numpy", "nogil": True}
# What is called from Python alone.
ENTRY: Any = {**STRICT, "no_cfunc_wrapper": True, "pipeline_class": OurCompiler}
# Nobody but compiled code calls what is inlined: the two wrappers that Numba makes for every function would
# be a third of the time of compilation.
INLINE: Any = {
    **STRICT,
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": InlinedCompiler,
}
# No contraction, though it would gain some 2 %: what a search finds is computed again, alone, and must come
# out the same to the bit, or ties and grazing contacts are decided in two ways. A run has the same bits then
# on every machine that rounds as IEEE 754 says, too.
FAST: Any = {**INLINE, "fastmath": {"nsz"}}
APPROXIMATE: Any = {**INLINE, "fastmath": {"nsz", "contract"}}
OPTIONS = {"inner": INLINE, "fast": FAST, "approximate": APPROXIMATE}
"""How a function that compiled code inlines is compiled, by what the registry notes of it."""


def _compile(function, how: str) -> None:
    """Register the compiled code of a function that :mod:`carom.compiling.registry` noted."""

    def itself(*args):
        return function

    def answer(model, *args):
        cls = class_of(model)
        known = cls is not None if how == "optional" else cls in function.registry
        return function.dispatch(cls) if known else None

    if how in OPTIONS:
        INLINED[function] = OPTIONS[how]
        compile_once(function, itself, OPTIONS[how])
        return
    function.register = _in_time(function)
    FACES.add(function)
    compile_once(function, answer, INLINE)


IN_USE: set = set()  # classes of models for which an entry point has been compiled, or loaded


def _in_time(generic):
    """Return its ``register``, which raises a RuntimeError rather than replace what is compiled already."""
    register = generic.register

    def register_in_time(*args):
        if len(args) == 1 and isinstance(args[0], type):
            return partial(register_in_time, args[0])
        before = dict(generic.registry)
        function = register(*args)
        for cls in IN_USE & generic.registry.keys():
            if generic.registry[cls] is not before.get(cls):
                register(cls, before.get(cls, before[object]))
                raise RuntimeError(
                    f"{generic.__name__} is compiled for {cls.__name__}: another function would not be "
                    f"asked. Define {cls.__name__} anew, too (in a notebook: run its cell again)."
                )
        return function

    return register_in_time


def entry(function):
    """Compile an entry point of the engine, cached on disk where a cache folder can be written.

    It is specialised for the classes among its arguments, each set of which has code of its own: Numba takes
    two classes of tuples with the same name and fields for one, as those of a notebook cell run twice.
    """
    if config.DISABLE_JIT:  # type: ignore[attr-defined]  # made when Numba is imported
        return function
    compiled: dict[tuple[type, ...], Any] = {}

    @wraps(function)
    def chosen(*args):
        classes = tuple(_classes_of(args))
        if classes not in compiled:
            compiled[classes] = watched(cached(function, ENTRY))
        return compiled[classes](*args)

    return chosen


def _classes_of(values) -> list[type]:
    """Return the classes of all tuples among values, and of those within."""
    found = []
    for value in values:
        if isinstance(value, tuple):
            found.append(type(value))
            found += _classes_of(value)
    return found


def watched(compiled):
    """Return a compiled function that notes its models; InputError where one of the user's fails.

    It is compiled without garbage collection: millions of objects are made, nearly all of them to stay.
    """
    compile_for = compiled.compile

    def compile_watched(signature):
        collecting = gc.isenabled()
        gc.disable()
        try:
            with signals_held(), compiling():
                return compile_for(signature)
        except Exception as error:
            answers = _own_answers(signature)
            if not answers:
                raise
            raise InputError(of_models(error, answers)) from error
        finally:
            if collecting:
                gc.enable()
            with suppress(Unknown):
                IN_USE.update(cls for cls in classes_in(signature) if issubclass(cls, tuple))

    compiled.compile = compile_watched
    return compiled


def _own_answers(signature) -> list[tuple[str, type, Any]]:
    """Return what is registered for own classes of a signature: names of questions, classes, functions."""
    found = []
    with suppress(Unknown, TypeError):
        for cls in dict.fromkeys(classes_in(signature)):
            if _is_ours(cls.__module__):  # a rule is asked by a class of ours
                continue
            for face in FACES:
                function = face.registry.get(cls)
                if function is not None and not _is_ours(function.__globals__.get("__name__")):
                    found.append((face.__name__, cls, function))
    return found


def _is_ours(module: str | None) -> bool:
    return (module or "").partition(".")[0] == __name__.partition(".")[0]


registry.attach(_compile)
