"""Numbers that several threads read and write: each access is whole, and in order with those before it."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from carom.compiling import numba_features
from carom.compiling.dispatch import INLINE

SHARING_NUMBERS = "numbers that threads share"
YIELDING = "threads that let others go first"


def _place(context, builder, array, value, index):
    data = cgutils.create_struct_proxy(array)(context, builder, value).data
    return builder.gep(data, [index])


@intrinsic
def _load(typingctx, array, index):
    def codegen(context, builder, signature, args):
        return builder.load_atomic(_place(context, builder, array, *args), "acquire", 8)

    return array.dtype(array, types.int64), codegen


@intrinsic
def _store(typingctx, array, index, value):
    def codegen(context, builder, signature, args):
        address = _place(context, builder, array, *args[:2])
        builder.store_atomic(args[2], address, "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.int64, array.dtype), codegen


@intrinsic
def _take(typingctx, array, index):
    def codegen(context, builder, signature, args):
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw("xchg", _place(context, builder, array, *args), one, "acq_rel")

    return array.dtype(array, types.int64), codegen


@intrinsic
def _let_others(typingctx):
    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(32), [])
        builder.call(cgutils.get_or_insert_function(builder.module, kind, "sched_yield"), [])
        return context.get_dummy_value()

    return types.void(), codegen


def load(array, index):
    """Return an element of a contiguous array of 64-bit numbers, and see all that was written before it."""
    return array[index]


def store(array, index, value):
    """Write an element of a contiguous array of 64-bit numbers, after all that this thread wrote before."""
    array[index] = value


def take(array, index):
    """Set an element of a contiguous array of int64 to 1, and return what it was."""
    before = array[index]
    array[index] = 1
    return before


def yield_thread():
    """Let another thread have the core, if one waits for it; nothing where the system has no such call."""


@overload(load, jit_options=INLINE)
def _load_compiled(array, index):
    return lambda array, index: _load(array, index)  # type: ignore[call-arg]  # Numba supplies the context


@overload(store, jit_options=INLINE)
def _store_compiled(array, index, value):
    return lambda array, index, value: _store(array, index, value)  # type: ignore[call-arg]


@overload(take, jit_options=INLINE)
def _take_compiled(array, index):
    return lambda array, index: _take(array, index)  # type: ignore[call-arg]


@overload(yield_thread, jit_options=INLINE)
def _let_others_compiled():
    return (lambda: _let_others()) if numba_features.has(YIELDING) else (lambda: None)  # type: ignore[call-arg]


@numba_features.trial(SHARING_NUMBERS)
def _try() -> bool:
    from numba import njit

    @njit(error_model="numpy")
    def change(times, counters):
        store(times, 1, 2.5)
        return take(counters, 0) + take(counters, 0) + load(times, 1)

    return change(np.zeros(2), np.zeros(1, np.int64)) == 3.5


@numba_features.trial(YIELDING)
def _try_yielding() -> bool:
    from numba import njit

    @njit(error_model="numpy")
    def spin():
        yield_thread()
        return 1

    return spin() == 1
