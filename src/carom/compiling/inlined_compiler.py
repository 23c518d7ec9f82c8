"""Compiling functions that compiled code inlines and nobody else calls: once each, and no further than that.

Left alone, Numba makes machine code of every one of them, and compiles it again for each kind of caller. Both
together were a quarter of the time of compilation.
"""

from __future__ import annotations

from numba.core import compiler
from numba.core.codegen import JITCodeLibrary
from numba.core.typing.templates import builtin_registry
from numba.extending import overload


def compile_once(function, choose, options) -> None:
    """Register ``choose``, which returns the code of ``function`` for the types of arguments given: the same
    code for all callers.
    """
    overload(function, strict=False, jit_options=options)(choose)
    registered, kind = builtin_registry.globals[-1]
    assert registered is function
    for template in kind.templates:
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
    context, args, keywords, flags = key
    return context, args, keywords, frozenset(flags.fastmath.flags) if flags else None


class InlinedCompiler(compiler.Compiler):
    """Numba's compiler, without the last step."""

    def __init__(self, typingctx, targetctx, library, *rest, **more):
        if library is None:
            library = InlinedLibrary(targetctx.codegen(), "inlined")
        super().__init__(typingctx, targetctx, library, *rest, **more)


class InlinedLibrary(JITCodeLibrary):
    """Code to be linked into that of others, where it becomes machine code.

    LLVM simplifies each function on its own, and optimises all of them together where they are linked: to
    do so here as well took a tenth of the time of compilation, and made nothing faster.
    """

    def _optimize_final_module(self):
        """Do nothing."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
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
