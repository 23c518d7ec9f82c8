"""Eight members of a sector at a time, in one register.

The compiler does not: a store into one array might change what the next load from another finds, so it goes
one by one; and a search for one member ends where nobody can foretell.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from carom.compiling import numba_features
from carom.compiling.dispatch import INLINE
from carom.compiling.numba_features import VECTORS

STEP = 8
"""Words copied in one go."""


EIGHT = ir.VectorType(ir.IntType(32), STEP)


def _data(context, builder, kind, value):
    return cgutils.create_struct_proxy(kind)(context, builder, value)


def _row(context, builder, kind, value, cell, start):
    """Return a pointer to eight words of a cell."""
    array = _data(context, builder, kind, value)
    columns = cgutils.unpack_tuple(builder, array.shape)[1]
    first = builder.add(builder.mul(cell, columns), start)
    return builder.bitcast(builder.gep(array.data, [first]), EIGHT.as_pointer())


def _filled(builder, value):
    """Return eight times the same word."""
    int_type = ir.IntType(32)
    single = builder.insert_element(
        ir.Constant(EIGHT, ir.Undefined), builder.trunc(value, int_type), ir.Constant(int_type, 0)
    )
    return builder.shuffle_vector(single, single, ir.Constant(EIGHT, [0] * STEP))


def _load(builder, address):
    loaded = builder.load(address)
    loaded.align = 4
    return loaded


def _store(builder, vector, address):
    builder.store(vector, address).align = 4


@intrinsic
def _copy_words(typingctx, members, cell, start, words, total, bits, code):
    def codegen(context, builder, signature, args):
        copied = _load(builder, _row(context, builder, members, args[0], args[1], args[2]))
        named = builder.or_(builder.shl(copied, _filled(builder, args[5])), _filled(builder, args[6]))
        target = builder.gep(_data(context, builder, words, args[3]).data, [args[4]])
        _store(builder, named, builder.bitcast(target, EIGHT.as_pointer()))
        return context.get_dummy_value()

    arguments = (members, types.int64, types.int64, words, types.int64, types.int64, types.int64)
    return types.void(*arguments), codegen


def copy_words(members, cell, start, words, total, bits, code):
    """Write ``member << bits | code`` of the eight members of a cell from ``start`` on to ``words`` from
    ``total`` on; the last of the eight may be the next cell's.

    Parameters
    ----------
    members : (cells, room) uint32 array
    words : uint32 array
    """
    first = int(cell) * members.shape[1] + int(start)
    eight = members.reshape(-1)[first : first + STEP]
    words[int(total) : int(total) + STEP] = (eight << int(bits)) | int(code)


@overload(copy_words, jit_options=INLINE)
def _copy_words_compiled(members, cell, start, words, total, bits, code):
    def body(members, cell, start, words, total, bits, code):
        # Numba supplies the context
        _copy_words(members, cell, start, words, total, bits, code)  # type: ignore[call-arg]

    def one_by_one(members, cell, start, words, total, bits, code):
        first = cell * members.shape[1] + start
        for k in range(STEP):
            int_type = members[(first + k) // members.shape[1], (first + k) % members.shape[1]]
            words[total + k] = (int_type << bits) | code

    return body if numba_features.has(VECTORS) else one_by_one


@intrinsic
def _replace_words(typingctx, members, cell, start, old, new):
    def codegen(context, builder, signature, args):
        address = _row(context, builder, members, args[0], args[1], args[2])
        held = _load(builder, address)
        same = builder.icmp_unsigned("==", held, _filled(builder, args[3]))
        _store(builder, builder.select(same, _filled(builder, args[4]), held), address)
        return context.get_dummy_value()

    return types.void(members, types.int64, types.int64, types.int64, types.int64), codegen


def replace_words(members, cell, start, old, new):
    """Write ``new`` wherever ``old`` is among the eight members of a cell from ``start`` on.

    Parameters
    ----------
    members : (cells, room) uint32 array
    """
    eight = members[int(cell), int(start) : int(start) + STEP]
    eight[eight == int(old)] = int(new)


@overload(replace_words, jit_options=INLINE)
def _replace_words_compiled(members, cell, start, old, new):
    def body(members, cell, start, old, new):
        # Numba supplies the context
        _replace_words(members, cell, start, old, new)  # type: ignore[call-arg]

    def one_by_one(members, cell, start, old, new):
        for k in range(STEP):
            if members[cell, start + k] == old:
                members[cell, start + k] = new

    return body if numba_features.has(VECTORS) else one_by_one


@numba_features.trial(VECTORS)
def _try() -> bool:
    from numba import njit

    def change(members, words):
        copy_words(members, 1, 2, words, 3, 4, 5)
        replace_words(members, 2, 0, 33, 7)

    done = []
    for function in (change, njit(error_model="numpy")(change)):
        members = np.arange(48, dtype=np.uint32).reshape(4, 12)
        words = np.zeros(16, np.uint32)
        members[2, 3] = members[2, 9] = 33
        function(members, words)
        done.append((members, words))
    return all((a == b).all() for a, b in zip(*done, strict=True))
