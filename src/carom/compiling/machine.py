"""Text of LLVM to machine code, and machine code to an address, by the public face of llvmlite."""

from __future__ import annotations

import ctypes
import os
import sys
from functools import lru_cache
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from carom.compiling.faults import Untranslatable

LEVEL = 3  # of optimization: below it half the rate is lost


@lru_cache(maxsize=1)
def processor() -> tuple[str, str]:
    """Return the processor's name and features, as LLVM knows them; the variables are those of Numba."""
    name = os.environ.get("NUMBA_CPU_NAME")
    if name:
        return name, os.environ.get("NUMBA_CPU_FEATURES", "")
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@lru_cache(maxsize=1)
def _machine() -> tuple[Any, Any]:
    """Return the target and what holds the code that was loaded: both live as long as the process."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    triple = llvm.get_process_triple()
    name, features = processor()
    relocation = "static" if triple.startswith(("x86", "i386", "i686")) else "default"
    target = llvm.Target.from_triple(triple).create_target_machine(
        cpu=name, features=features, opt=LEVEL, reloc=relocation, codemodel="jitdefault", jit=True
    )
    return target, llvm.create_mcjit_compiler(llvm.parse_assembly("", _context()), target)


@lru_cache(maxsize=1)
def _context() -> Any:
    """Return a context in which pointers have no types; llvmlite before 0.45 has to be told so."""
    module: Any = sys.modules["llvmlite.binding.context"]
    if hasattr(module, "opaque_pointers_enabled"):
        module.opaque_pointers_enabled = True
        try:
            return llvm.create_context()
        finally:
            module.opaque_pointers_enabled = llvmlite.opaque_pointers_enabled
    return llvm.create_context()


def machine_code(text: str) -> bytes:
    """Return the machine code of a module's text."""
    return _machine()[0].emit_object(_optimized(text))


def assembly(text: str) -> str:
    """Return the same for people to read."""
    return _machine()[0].emit_assembly(_optimized(text))


def _optimized(text: str) -> Any:
    """Return a module of a text, verified and optimized."""
    target, _ = _machine()
    try:
        module = llvm.parse_assembly(text, _context())
        module.triple, module.data_layout = llvm.get_process_triple(), str(target.target_data)
        module.verify()
    except RuntimeError:  # which shows the text
        raise Untranslatable("LLVM refuses what was made of this: report it as a fault") from None
    # Rotated loops first: else some that have two ends are not vectorized.
    cheap = _passes(target, 0, vectorize=False)
    manager = cheap.getModulePassManager()
    manager.add_loop_rotate_pass()
    manager.add_instruction_combine_pass()
    manager.add_jump_threading_pass()
    manager.run(module, cheap)
    full = _passes(target, LEVEL, vectorize=True)
    full.getModulePassManager().run(module, full)
    return module


def _passes(target: Any, level: int, vectorize: bool) -> Any:
    options = llvm.create_pipeline_tuning_options(speed_level=level)
    options.loop_vectorization = vectorize
    options.slp_vectorization = False
    return llvm.create_pass_builder(target, options)


def address_of(code: bytes, name: str) -> int:
    """Load machine code, and return the address of one of its functions."""
    _, engine = _machine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    return engine.get_function_address(name)


def function_at(address: int) -> Any:
    """Return the function at an address, which takes the context and lets other threads run meanwhile."""
    return ctypes.CFUNCTYPE(None, ctypes.c_char_p)(address)
