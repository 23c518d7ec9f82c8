"""Memory asked for before it is needed: one request to the processor."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from carom.compiling import numba_features
from carom.compiling.dispatch import INLINE

PREFETCHING = "memory asked for ahead"


FIRST_LEVEL, SECOND_LEVEL = 3, 2
"""The caches, as LLVM counts them: how soon something is needed."""


def _request(level):
    """Return the intrinsic that asks for an element of an array into the cache of a level."""

    @intrinsic
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


_prefetch, _prefetch_now = _request(SECOND_LEVEL), _request(FIRST_LEVEL)


def prefetch(array, index):
    """Ask for the cache line of an element of a contiguous array; nothing without compilation."""


def prefetch_now(array, index):
    """Do so into the first-level cache: for what the next event needs."""


@overload(prefetch, jit_options=INLINE)
def _prefetch_compiled(array, index):
    def body(array, index):
        _prefetch(array, index)

    return body if numba_features.has(PREFETCHING) else lambda array, index: None


@overload(prefetch_now, jit_options=INLINE)
def _prefetch_now_compiled(array, index):
    def body(array, index):
        _prefetch_now(array, index)

    return body if numba_features.has(PREFETCHING) else lambda array, index: None


@numba_features.trial(PREFETCHING)
def _try() -> bool:
    from numba import njit

    @njit(error_model="numpy")
    def fetch(array):
        prefetch(array, 1)
        prefetch_now(array, 1)
        return array[1]

    return fetch(np.arange(3.0)) == 1.0
