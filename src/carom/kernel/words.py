"""Eight members of a sector copied in one go, as the words of candidates.

The compiler does not: a store into one array might change what the next load from another finds, so it copies
one by one.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from carom.kernel.dispatch import INLINE

STEP = 8
"""Words copied in one go."""


@intrinsic
def _copy_words(typingctx, members, cell, start, words, total, bits, code):
    def codegen(context, builder, signature, args):
        word = ir.IntType(32)
        eight = ir.VectorType(word, STEP)
        source, target = (
            cgutils.create_struct_proxy(kind)(context, builder, value)
            for kind, value in ((members, args[0]), (words, args[3]))
        )

        def place(data, index):
            return builder.bitcast(builder.gep(data, [index]), eight.as_pointer())

        def spread(value):
            single = builder.insert_element(
                ir.Constant(eight, ir.Undefined), builder.trunc(value, word), ir.Constant(word, 0)
            )
            return builder.shuffle_vector(single, single, ir.Constant(eight, [0] * STEP))

        columns = cgutils.unpack_tuple(builder, source.shape)[1]
        first = builder.add(builder.mul(args[1], columns), args[2])
        copied = builder.load(place(source.data, first))
        copied.align = 4
        copied = builder.or_(builder.shl(copied, spread(args[5])), spread(args[6]))
        stored = builder.store(copied, place(target.data, args[4]))
        stored.align = 4
        return context.get_dummy_value()

    arguments = (members, types.int64, types.int64, words, types.int64, types.int64, types.int64)
    return types.void(*arguments), codegen


def copy_words(members, cell, start, words, total, bits, code):
    """Write ``member << bits | code`` of the eight members of a cell from ``start`` on to ``words`` from
    ``total`` on.

    Parameters
    ----------
    members : (cells, room) uint32 array
    words : uint32 array
    """
    eight = members[int(cell), int(start) : int(start) + STEP]
    words[int(total) : int(total) + STEP] = (eight << int(bits)) | int(code)


@overload(copy_words, jit_options=INLINE)
def _copy_words_compiled(members, cell, start, words, total, bits, code):
    def body(members, cell, start, words, total, bits, code):
        # Numba supplies the context
        _copy_words(members, cell, start, words, total, bits, code)  # type: ignore[call-arg]

    return body
