"""Memory asked for before it is needed: one request to the processor."""

from __future__ import annotations

from llvmlite import ir
from numba import types

from carom.compiling.intrinsics import compiled_as
from carom.compiling.numba_parts import cgutils

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
