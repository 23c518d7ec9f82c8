"""Eight rows, or other values of eight components, side by side for loops that are vectorised.

The search wants one coordinate of eight candidates in one register; the rows hold all coordinates of one
candidate in one cache line. Left to itself the compiler gathers, element by element. Whole rows loaded and
shuffled (*spread*) take a third of the instructions, so that the processor works on two searches at a time.
Single values are loaded one by one and *lined up*: gathers take several times as long, and where the loop
stores something, too, the compiler dares not even those.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from carom.compiling import numba_features
from carom.compiling.dispatch import INLINE
from carom.compiling.numba_features import VECTORS

LANES = 8


def _transpose(builder, rows):
    """Return four vectors of eight from eight vectors of four."""
    lanes = ir.VectorType(ir.IntType(32), LANES)

    def shuffle(a, b, order):
        return builder.shuffle_vector(a, b, ir.Constant(lanes, order))

    joined = [shuffle(rows[q], rows[q + 4], list(range(8))) for q in range(4)]
    even, also_even = (shuffle(joined[q], joined[q + 1], [0, 8, 2, 10, 4, 12, 6, 14]) for q in (0, 2))
    odd, also_odd = (shuffle(joined[q], joined[q + 1], [1, 9, 3, 11, 5, 13, 7, 15]) for q in (0, 2))
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    return [
        shuffle(even, also_even, low),
        shuffle(odd, also_odd, low),
        shuffle(even, also_even, high),
        shuffle(odd, also_odd, high),
    ]


@intrinsic
def _spread(typingctx, rows, words, start_index, bits, chunk, half, lane):
    number = rows.dtype.fields["t"].type
    width = number.bitwidth // 8
    columns = rows.dtype.size // width

    def codegen(context, builder, signature, args):
        def data(kind, value):
            return cgutils.create_struct_proxy(kind)(context, builder, value).data

        base = builder.bitcast(data(rows, args[0]), ir.IntType(8).as_pointer())
        names = data(words, args[1])
        target = builder.bitcast(data(chunk, args[4]), ir.DoubleType().as_pointer())
        int_type = ir.IntType(64)
        four = ir.VectorType(ir.DoubleType(), 4)
        stored_four = ir.VectorType(context.get_value_type(number), 4)
        eight = ir.VectorType(ir.DoubleType(), LANES)
        row_size = ir.Constant(int_type, rows.dtype.size)
        offset = builder.add(args[6], builder.mul(args[5], ir.Constant(int_type, columns * WIDTH)))
        starts = []
        for k in range(LANES):
            name = builder.load(builder.gep(names, [builder.add(args[2], ir.Constant(int_type, k))]))
            source_row = builder.lshr(builder.zext(name, int_type), args[3])
            starts.append(builder.gep(base, [builder.mul(source_row, row_size)]))
        for group in range(0, columns, 4):
            parts = []
            for start in starts:
                part = builder.gep(start, [ir.Constant(int_type, width * group)])
                loaded = builder.load(builder.bitcast(part, stored_four.as_pointer()))
                loaded.align = width
                parts.append(loaded if width == 8 else builder.fpext(loaded, four))
            for column, vector in enumerate(_transpose(builder, parts), start=group):
                address = builder.gep(target, [builder.add(offset, ir.Constant(int_type, column * WIDTH))])
                stored = builder.store(vector, builder.bitcast(address, eight.as_pointer()))
                stored.align = 8
        return context.get_dummy_value()

    return types.void(rows, words, types.int64, types.int64, chunk, types.int64, types.int64), codegen


WIDTH = 32
"""Candidates a block holds."""


def spread(rows, words, start_index, bits, chunk, half, lane):
    """Copy the rows of eight candidates, widened to double precision, into the columns ``lane`` to ``lane +
    7`` of one half of a block.

    Parameters
    ----------
    rows : (n + 1,) array of rows
        All components.
    words : uint32 array
        ``words[start_index : start_index + 8] >> bits`` are the rows meant.
    block : (2, fields, WIDTH) float64 array
        One line a field of a row: x, t, v, event_time, padding.
    """
    for k in range(LANES):
        source_row = rows[int(words[start_index + k]) >> int(bits)]
        d = len(source_row.x)
        chunk[half, :d, lane + k] = source_row.x
        chunk[half, d, lane + k] = source_row.t
        chunk[half, d + 1 : 2 * d + 1, lane + k] = source_row.v
        chunk[half, 2 * d + 1, lane + k] = source_row.event_time


@overload(spread, jit_options=INLINE)
def _spread_compiled(rows, words, start_index, bits, chunk, half, lane):
    def body(rows, words, start_index, bits, chunk, half, lane):
        # Numba supplies the context
        _spread(rows, words, start_index, bits, chunk, half, lane)  # type: ignore[call-arg]

    def one_by_one(rows, words, start_index, bits, chunk, half, lane):
        for k in range(LANES):
            source_row = rows[words[start_index + k] >> bits]
            d = len(source_row.x)
            for axis in range(d):
                chunk[half, axis, lane + k] = source_row.x[axis]
                chunk[half, d + 1 + axis, lane + k] = source_row.v[axis]
            chunk[half, d, lane + k] = source_row.t
            chunk[half, 2 * d + 1, lane + k] = source_row.event_time

    return body if numba_features.has(VECTORS) else one_by_one


def store_lane(context, builder, values, words, start_index, bits, target, offset):
    """Emit the code that copies the values of eight candidates side by side.

    ``values``, ``words`` and ``target`` are types and values of arrays, the others are 64-bit integers.
    """

    def data(kind, value):
        return cgutils.create_struct_proxy(kind)(context, builder, value).data

    source, names, places = data(*values), data(*words), data(*target)
    int_type = ir.IntType(64)
    size = context.get_abi_sizeof(context.get_data_type(target[0].dtype))
    for k in range(LANES):
        name = builder.load(builder.gep(names, [builder.add(start_index, ir.Constant(int_type, k))]))
        source_row = builder.lshr(builder.zext(name, int_type), bits)
        value = builder.load(builder.gep(source, [source_row]))
        builder.store(value, builder.gep(places, [builder.add(offset, ir.Constant(int_type, k))]), align=size)


@intrinsic
def _line_up(typingctx, values, words, start_index, bits, target, offset):
    def codegen(context, builder, signature, args):
        given = (values, args[0]), (words, args[1]), args[2], args[3], (target, args[4]), args[5]
        store_lane(context, builder, *given)
        return context.get_dummy_value()

    return types.void(values, words, types.int64, types.int64, target, types.int64), codegen


def pack(values, words, start_index, bits, target, offset):
    """Copy the values of eight candidates side by side.

    Parameters
    ----------
    values : array
        One a component.
    words : uint32 array
        ``words[start_index : start_index + 8] >> bits`` are the components meant.
    target : array
        Of the same type, filled from ``offset`` on.
    """
    for k in range(LANES):
        target[int(offset) + k] = values[int(words[start_index + k]) >> int(bits)]


@overload(pack, jit_options=INLINE)
def _line_up_compiled(values, words, start_index, bits, target, offset):
    def body(values, words, start_index, bits, target, offset):
        # Numba supplies the context
        _line_up(values, words, start_index, bits, target, offset)  # type: ignore[call-arg]

    def one_by_one(values, words, start_index, bits, target, offset):
        for k in range(LANES):
            target[offset + k] = values[words[start_index + k] >> bits]

    return body if numba_features.has(VECTORS) else one_by_one


@numba_features.trial(VECTORS)
def _try() -> bool:
    from numba import njit

    def copy(rows, words, chunk, values, target):
        spread(rows, words, 1, 2, chunk, 1, 8)
        pack(values, words, 1, 2, target, 3)

    rows = np.zeros(9, [("x", "f8", (3,)), ("t", "f8"), ("v", "f8", (3,)), ("event_time", "f8")])
    for number, name in enumerate(("x", "t", "v", "event_time")):
        rows[name] = np.arange(rows[name].size).reshape(rows[name].shape) + 100.0 * number
    words = (np.arange(9, dtype=np.uint32)[::-1] << 2).copy()
    done = []
    for function in (copy, njit(error_model="numpy")(copy)):
        chunk, target = np.zeros((2, 8, WIDTH)), np.zeros(16)
        function(rows.view(np.recarray), words, chunk, np.arange(9.0), target)
        done.append((chunk, target))
    return all((a == b).all() for a, b in zip(*done, strict=True))
