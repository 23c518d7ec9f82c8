"""Functions in plain Python for which compiled code takes instructions of its own.

Memory is asked for before it is needed, by one request to the processor. Of numbers that several threads read
and write each access is whole, and in order with those before it.
"""

from __future__ import annotations

import os

from llvmlite import ir
from numba import types

from carom.compiling.numba_parts import cgutils, infer, infer_global, make_intrinsic_template
from carom.compiling.registry import inner


def compiled_as(function):
    """Let compiled code take the decorated intrinsic's instructions for a ``function`` of its parameters.

    They are written where it is called: room on the stack ends with the function that asked for it.
    """

    def decorate(answer):
        template = make_intrinsic_template(function, answer, function.__name__)
        infer(template)
        infer_global(function, types.Function(template))
        return answer

    return decorate


FIRST_LEVEL, SECOND_LEVEL = 3, 2
"""The caches, as LLVM counts them: how soon something is needed."""


def prefetch(array, index):
    """Ask for the cache line of an element of a contiguous array; nothing without compilation."""


def prefetch_now(array, index):
    """Do so into the first-level cache: for what the next event needs."""


def _request(level):
    """Return the intrinsic that asks for an element of an array into the cache of a level."""

    def request(typingctx, array, index):
        kind = array.dtype
        size = kind.size if isinstance(kind, types.Record) else kind.bitwidth // 8

        def codegen(context, builder, signature, args):
            byte, int_type = ir.IntType(8), ir.IntType(32)
            data = cgutils.create_struct_proxy(array)(context, builder, args[0]).data
            base = builder.bitcast(data, byte.as_pointer())
            address = builder.gep(base, [builder.mul(args[1], ir.Constant(ir.IntType(64), size))])
            signature = ir.FunctionType(ir.VoidType(), [address.type, int_type, int_type, int_type])
            intrinsic = cgutils.get_or_insert_function(builder.module, signature, "llvm.prefetch.p0")
            read, locality, data_cache = (ir.Constant(int_type, value) for value in (0, level, 1))
            builder.call(intrinsic, [address, read, locality, data_cache])
            return context.get_dummy_value()

        return types.void(array, types.int64), codegen

    return request


compiled_as(prefetch)(_request(SECOND_LEVEL))
compiled_as(prefetch_now)(_request(FIRST_LEVEL))


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
