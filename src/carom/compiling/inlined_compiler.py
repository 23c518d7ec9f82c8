"""Compiling functions that compiled code inlines and nobody else calls: once each, and no further than that.

Left alone, Numba makes machine code of every one of them, and compiles it again for each kind of caller. Both
together were a quarter of the time of compilation.
"""

from __future__ import annotations

import weakref
from functools import cache

from numba.core import compiler
from numba.extending import overload

from carom.compiling import numba_features

SHARING = "code shared by all callers"
INLINING = "inlining without machine code"


def compile_once(function, choose, options) -> None:
    """Register ``choose``, which returns the code of ``function`` for the types of arguments given."""
    overload(function, strict=False, jit_options=options)(choose)
    if numba_features.has(SHARING):
        try:
            _share(function)
        except Exception as error:
            numba_features.leave_out(SHARING, error)


def _share(function) -> None:
    """Let all callers of a function that has just been registered use the same code."""
    from numba.core.typing.templates import builtin_registry

    registered, kind = builtin_registry.globals[-1]
    if registered is not function:
        raise LookupError("the last function registered is another")
    for template in kind.templates:
        if not isinstance(template._impl_cache, dict):
            raise LookupError("code is not kept in a dict")
        template._impl_cache = _ByMeaning()


class _ByMeaning(dict):
    """Compiled functions by the types of their arguments, and by what they inherit of their caller.

    Numba's key holds all options of the caller, also those that mean nothing to what it calls.
    """

    def __getitem__(self, key):
        return super().__getitem__(_meaning(key))

    def __setitem__(self, key, value):
        super().__setitem__(_meaning(key), value)


def _meaning(key):
    if not numba_features.has(SHARING):
        return key
    context, args, keywords, flags = key
    return context, args, keywords, frozenset(flags.fastmath.flags) if flags else None


class InlinedCompiler(compiler.Compiler):
    """Numba's compiler, without the last step."""

    def __init__(self, typingctx, targetctx, library, *rest, **more):
        if library is None:
            library = _library(targetctx.codegen())
        super().__init__(typingctx, targetctx, library, *rest, **more)


def _library(codegen):
    """Return a library for code to be inlined, or None: what Numba takes for any code."""
    if numba_features.has(INLINING):
        try:
            return _library_class()(codegen, "inlined")
        except (ImportError, AttributeError, TypeError) as error:
            numba_features.leave_out(INLINING, error)
    return None


@cache
def _library_class():
    from numba.core.codegen import JITCodeLibrary

    # What is overridden, and what is called, must be there.
    for name in ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals"):
        getattr(JITCodeLibrary, name)

    class InlinedLibrary(JITCodeLibrary):
        """Code to be linked into that of others, where it becomes machine code.

        LLVM simplifies each function on its own, and optimises all of them together where they are linked: to
        do so here as well took a tenth of the time of compilation, and made nothing faster.
        """

        def _optimize_final_module(self):
            """Do nothing."""

        def _finalize_final_module(self):
            self._finalize_dynamic_globals()
            self._final_module.__library = weakref.proxy(self)
            self._finalized = True

        def get_pointer_to_function(self, name):
            """Return zero: there is no machine code."""
            return 0

        @property
        def codegen(self):
            """Who is asked to tell the machine code of its environment: for want of any, the library."""
            return self

        def set_env(self, name, env):
            """Do nothing."""

    return InlinedLibrary
