"""Numbers that several threads read and write: each access is whole, and in order with those before it."""

from __future__ import annotations

import os

from llvmlite import ir
from numba import types

from carom.compiling.intrinsics import compiled_as
from carom.compiling.numba_parts import cgutils
from carom.compiling.registry import inner


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
    return


def _place(context, builder, array, value, index):
    data = cgutils.create_struct_proxy(array)(context, builder, value).data
    return builder.gep(data, [index])


@compiled_as(load)
def _load(typingctx, array, index):
    def codegen(context, builder, signature, args):
        return builder.load_atomic(_place(context, builder, array, *args), "acquire", 8)

    return array.dtype(array, types.int64), codegen


@compiled_as(store)
def _store(typingctx, array, index, value):
    def codegen(context, builder, signature, args):
        address = _place(context, builder, array, *args[:2])
        builder.store_atomic(args[2], address, "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.int64, array.dtype), codegen


@compiled_as(take)
def _take(typingctx, array, index):
    def codegen(context, builder, signature, args):
        one = ir.Constant(ir.IntType(64), 1)
        return builder.atomic_rmw("xchg", _place(context, builder, array, *args), one, "acq_rel")

    return array.dtype(array, types.int64), codegen


def _let_others(typingctx):
    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.IntType(32), [])
        builder.call(cgutils.get_or_insert_function(builder.module, kind, "sched_yield"), [])
        return context.get_dummy_value()

    return types.void(), codegen


if hasattr(os, "sched_yield"):
    compiled_as(yield_thread)(_let_others)
else:
    inner(yield_thread)
