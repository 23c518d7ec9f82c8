"""Compiling functions that compiled code inlines and nobody else calls: once each, and no further than that.

Numba makes machine code of each, again for each kind of caller: a quarter of the time of compilation. Half of
its passes look for what our functions do not have, and recompute what has not changed.
"""

from __future__ import annotations

from numba.extending import overload

from carom.compiling.numba_parts import (
    JITCodeLibrary,
    PassManager,
    PostProcessor,
    builtin_registry,
    compiler,
    typed_passes,
    untyped_passes,
)

PASSES = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.NopythonRewrites,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)
"""What our own functions need of Numba's passes."""

OTHERS = {"literal_unroll", "literally", "objmode"}  # names of what needs more


def compile_once(function, choose, options) -> None:
    """Register ``choose``, which returns ``function``'s code by types: the same for all callers."""
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


class FewPasses(PassManager):
    """Runs passes without messages and timers; only pruned branches change what is computed anew."""

    def _runPass(self, index, pss, state):
        pss.analysis = self._analysis
        changed = [each(state) for each in (pss.run_initialization, pss.run_pass, pss.run_finalizer)]
        if any(changed) and isinstance(pss, untyped_passes.DeadBranchPrune):
            PostProcessor(state.func_ir).run()


FEW = FewPasses("nopython")
for each in PASSES:
    FEW.add_pass(each, each.__name__)
FEW.finalize()


class OurCompiler(compiler.Compiler):
    """Numba's compiler, with few passes for functions of this package."""

    def define_pipelines(self):
        """Return the passes."""
        function = self.state.func_id.func
        code, (package, _, _) = function.__code__, __name__.partition(".")
        ours = (function.__globals__.get("__name__") or "").partition(".")[0] == package
        plain = not OTHERS & set(code.co_names) and not any(
            hasattr(each, "co_code") for each in code.co_consts
        )
        return [FEW] if ours and plain else super().define_pipelines()


class InlinedCompiler(OurCompiler):
    """The same, without the last step."""

    def __init__(self, typingctx, targetctx, library, *rest, **more):
        if library is None:
            library = InlinedLibrary(targetctx.codegen(), "inlined")
        super().__init__(typingctx, targetctx, library, *rest, **more)


class InlinedLibrary(JITCodeLibrary):
    """Code to be linked into that of others, where it becomes machine code.

    LLVM optimises where it links: to do so here too took a tenth of the time, and made nothing faster.
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
