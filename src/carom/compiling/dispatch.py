"""The compiler of what the registry notes: Numba chooses an answer by a model's type while it infers types.

The same source runs as plain Python under ``NUMBA_DISABLE_JIT=1``.
"""

from __future__ import annotations

import gc
import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import config

from carom.compiling import registry
from carom.compiling.inlining import InlinedCompiler, compile_once

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
APPROXIMATE: Any = {**INLINE, "fastmath": {"nsz", "contract"}}


def _class_of(model):
    """Return the Python class that stands for a Numba type in the registry."""
    if isinstance(model, types.NoneType):
        return type(None)
    if isinstance(model, types.Array):
        return np.ndarray
    return getattr(model, "instance_class", None)


def _compile(function, how: str) -> None:
    """Register the compiled code of a function that :mod:`carom.compiling.registry` noted."""

    def itself(*args):
        return function

    def answer(model, *args):
        cls = _class_of(model)
        known = cls is not None if how == "optional" else cls in function.registry
        return function.dispatch(cls) if known else None

    options = {"fast": FAST, "approximate": APPROXIMATE}.get(how, INLINE)
    compile_once(function, answer if how in ("required", "optional") else itself, options)


registry.attach(_compile)


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
