"""Choosing code by the type of a model: ``functools.singledispatch``, understood by Numba.

A scene is a handful of small models (``NamedTuple``s). A basic function of the paper is written once per type
of model and registered here; inside compiled code the choice is made while Numba infers types, so what a
scene does not have leaves no branch and no byte behind. The same source runs as plain Python under
``NUMBA_DISABLE_JIT=1``.
"""

from __future__ import annotations

import gc
import hashlib
from functools import lru_cache, singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import config

from carom.kernel.held import signals_held
from carom.kernel.inlining import InlinedCompiler, compile_once

# Division must not test for zero, or no loop that divides can be vectorised.
STRICT: Any = {"error_model": "numpy", "nogil": True}
# What is called from Python alone.
ENTRY: Any = {**STRICT, "no_cfunc_wrapper": True}
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


def inlined(**options):
    """Make a function one that compiled code inlines; called from Python it stays as it is."""

    def decorate(function):
        """Register the function as the compiled code of itself."""
        compile_once(function, lambda *args: function, options)
        return function

    return decorate


inner = inlined(**INLINE)
"""Inlined into compiled code."""
fast = inlined(**FAST)
"""Inlined, and its loops vectorised."""


def _class_of(model):
    """Return the Python class that stands for a Numba type in the registry."""
    if isinstance(model, types.NoneType):
        return type(None)
    if isinstance(model, types.Array):
        return np.ndarray
    return getattr(model, "instance_class", None)


def generic(function):
    """Make ``function(model, ...)`` generic in the type of its first argument, compiled or not.

    Implementations are added with ``@function.register``; every one has the same parameters.
    """
    face = singledispatch(function)

    def choose(model, *args):
        cls = _class_of(model)
        return face.dispatch(cls) if cls in face.registry else None

    compile_once(face, choose, INLINE)
    return face


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Return the SHA-256 of the kernel's sources.

    Numba's cache looks at the file of the compiled function only. An entry point that closes over this digest
    is compiled anew after an edit to, or an upgrade of, any module of the kernel.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def entry(function):
    """Compile an entry point of the kernel, cached on disk where a cache folder can be written.

    Parameters
    ----------
    function : callable
        A factory ``(digest) -> python function`` whose result closes over ``digest``.
    """
    body = function(source_digest())
    if getattr(config, "DISABLE_JIT", 0):
        return body
    try:
        return undisturbed(forgiving(njit(**ENTRY, cache=True)(body)))
    except RuntimeError:  # Numba found no folder that can be written: compile in every process
        return undisturbed(njit(**ENTRY)(body))


def undisturbed(compiled):
    """Return a compiled function that is compiled without garbage collection: millions of objects are made
    then, nearly all of them to stay.
    """
    compile_for = compiled.compile

    def compile_undisturbed(signature):
        collecting = gc.isenabled()
        gc.disable()
        try:
            with signals_held():
                return compile_for(signature)
        finally:
            if collecting:
                gc.enable()

    compiled.compile = compile_undisturbed
    return compiled


def forgiving(compiled):
    """Return a cached function whose cache outlives a vanished model, and processes that save at one time.

    The index of Numba's cache holds the types of all arguments seen, and the first of them that is gone (with
    an upgrade, or with the module of an obstacle of one's own) would end every program that comes after.
    Numba numbers the files it saves: two processes that compile for different scenes could take the same
    number, and one would load the other's code. Here a file is named after what is in it.
    """
    file = compiled._cache._cache_file
    load = file._load_index

    def load_index():
        try:
            return load()
        except (AttributeError, ImportError):
            return {}

    def save(key, data):
        name = file._data_name_pattern.replace("{number:d}", hashlib.sha256(file._dump(key)).hexdigest()[:32])
        file._save_data(name, data)
        file._save_index({**file._load_index(), key: name})

    file._load_index = load_index
    file.save = save
    return compiled
