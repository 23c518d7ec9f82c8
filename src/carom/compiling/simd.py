"""Values of eight components in one register: copied side by side, and read from there.

The compiler leaves these loops as they are: a store might change what the next load finds. Here

- whole rows are loaded and shuffled into columns (:func:`gather_rows`): a third of the instructions. A loop
  over just eight reads them from the stack (:func:`candidate_block`), and keeps them in registers;
- single values are loaded one by one and stored side by side (:func:`pack`, :func:`pack_fields`): gathers
  take several times as long;
- members of a cell are copied and replaced in one go (:func:`copy_words`, :func:`replace_words`).

Of what a pair model reads of a candidate j, eight values are side by side in a *lane*. :func:`asked_of` gives
the model a view and a j of a type of its own: ``pair.radii[j]`` reads the lane, ``pair.radii[i]`` the array.
Neither leaves a trace in the machine code. Each function works in plain Python, too.
"""

from __future__ import annotations

import math
import operator
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

from carom.compiling.borrowed import BorrowedArray, BorrowedTuple, BorrowedUniTuple
from carom.compiling.dispatch import INLINE
from carom.compiling.intrinsics import compiled_as
from carom.compiling.numba_parts import Conversion, cgutils, cpu_target
from carom.compiling.registry import room_for

LANES = 8  # values in a register

WIDTH = 32  # candidates that the last bits of a time tell apart

INT, DOUBLE = ir.IntType(64), ir.DoubleType()
WORDS = ir.VectorType(ir.IntType(32), LANES)


def _data(context, builder, kind, value):
    """Return a pointer to the first element of an array."""
    return cgutils.create_struct_proxy(kind)(context, builder, value).data


def _named(builder, words, start_index, bits):
    """Yield the components that eight words name."""
    for k in range(LANES):
        ref = builder.load(builder.gep(words, [builder.add(start_index, ir.Constant(INT, k))]))
        yield builder.lshr(builder.zext(ref, INT), bits)


def gather_rows(rows, words, start_index, bits, block):
    """Copy eight rows, ``words[start_index:][:8] >> bits``, as doubles into the columns of a block."""
    for k in range(LANES):
        old_event = rows[int(words[start_index + k]) >> int(bits)]
        d = len(old_event.x)
        for axis in range(d):
            block[axis, k] = old_event.x[axis]
            block[d + 1 + axis, k] = old_event.v[axis]
        block[d, k] = old_event.t
        block[2 * d + 1, k] = old_event.event_time


@compiled_as(gather_rows)
def _gather_rows(typingctx, rows, words, start_index, bits, block):
    number = rows.dtype.fields["t"].type
    width = number.bitwidth // 8
    columns = rows.dtype.size // width

    def codegen(context, builder, signature, args):
        base = builder.bitcast(_data(context, builder, rows, args[0]), ir.IntType(8).as_pointer())
        names = _data(context, builder, words, args[1])
        target = builder.bitcast(_data(context, builder, block, args[4]), DOUBLE.as_pointer())
        four = ir.VectorType(DOUBLE, 4)
        stored_four = ir.VectorType(context.get_value_type(number), 4)
        eight = ir.VectorType(DOUBLE, LANES)
        row_size = ir.Constant(INT, rows.dtype.size)
        components = _named(builder, names, args[2], args[3])
        starts = [builder.gep(base, [builder.mul(component, row_size)]) for component in components]
        for group in range(0, columns, 4):
            parts = []
            for start in starts:
                part = builder.gep(start, [ir.Constant(INT, width * group)])
                loaded = builder.load(builder.bitcast(part, stored_four.as_pointer()), align=width)
                parts.append(loaded if width == 8 else builder.fpext(loaded, four))
            for column, vector in enumerate(_transpose(builder, parts), start=group):
                address = builder.gep(target, [ir.Constant(INT, column * LANES)])
                builder.store(vector, builder.bitcast(address, eight.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.void(rows, words, types.int64, types.int64, block), codegen


def _transpose(builder, rows):
    """Return four vectors of eight from eight vectors of four."""

    def shuffle(a, b, order):
        return builder.shuffle_vector(a, b, ir.Constant(WORDS, order))

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


def _on_stack(context, builder, kind, shape):
    """Return an array of that type and shape on the stack."""
    number, size = context.get_value_type(kind.dtype), math.prod(shape)
    room = cgutils.alloca_once(builder, ir.ArrayType(number, size))
    room.align = 64
    array = cgutils.create_struct_proxy(kind)(context, builder)
    array.data = builder.bitcast(room, number.as_pointer())
    array.nitems, array.itemsize = ir.Constant(INT, size), ir.Constant(INT, 8)
    array.shape = cgutils.pack_array(builder, [ir.Constant(INT, length) for length in shape])
    strides = [8 * math.prod(shape[k + 1 :]) for k in range(len(shape))]
    array.strides = cgutils.pack_array(builder, [ir.Constant(INT, stride) for stride in strides])
    array.meminfo = array.parent = ir.Constant(context.get_value_type(types.voidptr), None)
    return array._getvalue()


def candidate_block(rows):
    """Return room on the caller's stack for eight old events, (fields, LANES), and keys (LANES,) int64."""
    columns = rows.dtype.itemsize // rows.dtype["t"].itemsize
    return np.zeros((columns, LANES)), np.zeros(LANES, np.int64)


@compiled_as(candidate_block)
def _candidate_block(typingctx, rows):
    columns = rows.dtype.size // (rows.dtype.fields["t"].type.bitwidth // 8)
    block = BorrowedArray(types.Array(types.float64, 2, "C"))
    keys = BorrowedArray(types.Array(types.int64, 1, "C"))

    def codegen(context, builder, signature, args):
        parts = [_on_stack(context, builder, block, (columns, LANES))]
        parts.append(_on_stack(context, builder, keys, (LANES,)))
        return context.make_tuple(builder, signature.return_type, parts)

    return types.Tuple([block, keys])(rows), codegen


MOST_AXES = 16  # for which there is room in a place


@compiled_as(room_for)
def _room_for(typingctx, x):
    place = BorrowedArray(types.Array(types.float64, 1, "C"))

    def codegen(context, builder, signature, args):
        room = _on_stack(context, builder, place, (MOST_AXES,))
        array = cgutils.create_struct_proxy(place)(context, builder, value=room)
        given = cgutils.create_struct_proxy(signature.args[0])(context, builder, value=args[0])
        array.nitems, array.shape = given.nitems, given.shape
        return array._getvalue()

    return place(x), codegen


def least(keys):
    """Return the smallest of eight keys."""
    return keys.min()


@compiled_as(least)
def _least(typingctx, keys):
    def codegen(context, builder, signature, args):
        eight = ir.VectorType(INT, LANES)
        data = _data(context, builder, keys, args[0])
        loaded = builder.load(builder.bitcast(data, eight.as_pointer()), align=8)
        kind = ir.FunctionType(INT, [eight])
        smallest = cgutils.get_or_insert_function(builder.module, kind, "llvm.vector.reduce.smin.v8i64")
        return builder.call(smallest, [loaded])

    return types.int64(keys), codegen


def _line_up(context, builder, values, words, start_index, bits, target, offset):
    """Emit the code that copies the values of eight candidates side by side.

    ``values``, ``words`` and ``target`` are types and values of arrays, the others are 64-bit integers.
    """
    source, names, places = (_data(context, builder, *array) for array in (values, words, target))
    size = context.get_abi_sizeof(context.get_data_type(target[0].dtype))
    for k, component in enumerate(_named(builder, names, start_index, bits)):
        value = builder.load(builder.gep(source, [component]))
        builder.store(value, builder.gep(places, [builder.add(offset, ir.Constant(INT, k))]), align=size)


def pack(values, words, start_index, bits, target, offset):
    """Copy eight values, ``words[start_index:][:8] >> bits``, side by side to ``target[offset:]``."""
    for k in range(LANES):
        target[int(offset) + k] = values[int(words[start_index + k]) >> int(bits)]


@compiled_as(pack)
def _pack(typingctx, values, words, start_index, bits, target, offset):
    def codegen(context, builder, signature, args):
        given = (values, args[0]), (words, args[1]), args[2], args[3], (target, args[4]), args[5]
        _line_up(context, builder, *given)
        return context.get_dummy_value()

    return types.void(values, words, types.int64, types.int64, target, types.int64), codegen


def _eight(context, builder, kind, value, cell, start):
    """Return a pointer to eight words of a cell."""
    array = cgutils.create_struct_proxy(kind)(context, builder, value)
    columns = cgutils.unpack_tuple(builder, array.shape)[1]
    offset = builder.add(builder.mul(cell, columns), start)
    return builder.bitcast(builder.gep(array.data, [offset]), WORDS.as_pointer())


def _filled(builder, value):
    """Return eight times the same word."""
    int32 = ir.IntType(32)
    single = builder.insert_element(
        ir.Constant(WORDS, ir.Undefined), builder.trunc(value, int32), ir.Constant(int32, 0)
    )
    return builder.shuffle_vector(single, single, ir.Constant(WORDS, [0] * LANES))


def copy_words(members, cell, start, words, total, bits, code):
    """Write ``member << bits | code`` of eight, the last of another cell, to ``words`` at ``total``."""
    cell_capacity = members.shape[1]
    offset = int(cell) * cell_capacity + int(start)
    for k in range(LANES):
        member = members[(offset + k) // cell_capacity, (offset + k) % cell_capacity]
        words[int(total) + k] = (member << np.uint32(bits)) | np.uint32(code)


@compiled_as(copy_words)
def _copy_words(typingctx, members, cell, start, words, total, bits, code):
    def codegen(context, builder, signature, args):
        copied = builder.load(_eight(context, builder, members, args[0], args[1], args[2]), align=4)
        named = builder.or_(builder.shl(copied, _filled(builder, args[5])), _filled(builder, args[6]))
        target = builder.gep(_data(context, builder, words, args[3]), [args[4]])
        builder.store(named, builder.bitcast(target, WORDS.as_pointer()), align=4)
        return context.get_dummy_value()

    arguments = (members, types.int64, types.int64, words, types.int64, types.int64, types.int64)
    return types.void(*arguments), codegen


def replace_words(members, cell, start, old, new):
    """Write ``new`` wherever ``old`` is among the eight members of a cell from ``start`` on."""
    for k in range(LANES):
        if members[cell, int(start) + k] == old:
            members[cell, int(start) + k] = new


@compiled_as(replace_words)
def _replace_words(typingctx, members, cell, start, old, new):
    def codegen(context, builder, signature, args):
        address = _eight(context, builder, members, args[0], args[1], args[2])
        held = builder.load(address, align=4)
        same = builder.icmp_unsigned("==", held, _filled(builder, args[3]))
        builder.store(builder.select(same, _filled(builder, args[4]), held), address, align=4)
        return context.get_dummy_value()

    return types.void(members, types.int64, types.int64, types.int64, types.int64), codegen


class Lanes(NamedTuple):
    """Room for one field of the candidates of two searches, and for the other fields."""

    scratch: np.ndarray  # (2 WIDTH,), of the type of the field
    rest: Any  # lanes, or None


def make_lanes(pair: Any) -> Lanes | None:
    """Return room for the fields that the type of a pair model names in ``lanes``; None if it names none."""
    lanes = None
    for name in reversed(lanes_of(type(pair))):
        lanes = Lanes(np.zeros(2 * WIDTH, getattr(pair, name).dtype), lanes)
    return lanes


def lanes_of(kind: type) -> tuple[str, ...]:
    """Return the names of the fields, one a component, that the search reads of candidates."""
    return tuple(getattr(kind, "lanes", ()))


def _rooms(builder, pair, kind, value):
    """Yield the places in a model of the fields that have lanes, and the types and values of their rooms."""
    for name in lanes_of(pair.instance_class):
        scratch, rest = kind.types
        lane, value = cgutils.unpack_tuple(builder, value, 2)
        yield pair.fields.index(name), scratch, lane
        kind = rest


def pack_fields(pair, lanes, words, start_index, bits, address):
    """Put eight candidates' values into the lanes: left alone the compiler gathers, several times as long."""


@compiled_as(pack_fields)
def _pack_fields(typingctx, pair, lanes, words, start_index, bits, address):
    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[0], len(pair))
        for at, kind, room in _rooms(builder, pair, lanes, args[1]):
            given = (pair.types[at], parts[at]), (words, args[2]), args[3], args[4], (kind, room), args[5]
            _line_up(context, builder, *given)
        return context.get_dummy_value()

    return types.void(pair, lanes, words, types.int64, types.int64, types.int64), codegen


class Candidate(types.Integer):
    """The index of the component that a search looks at: an int64, which is never negative."""

    def __init__(self):
        # NumPy's functions know it by this name. Numba looks at the sign of a signed index.
        super().__init__("int64", signed=False)

    def can_convert_to(self, typingctx, other):
        """Return how well it stands for a number of another type: as an int64 does."""
        whole = types.int64
        return Conversion.promote if other == whole else typingctx.can_convert(whole, other)


CANDIDATE = Candidate()
register_model(Candidate)(models.IntegerModel)


class LinedArray(types.Type):
    """An array of one value a component, its lane, and the place of the candidate there."""

    def __init__(self, array, lane):
        self.array, self.lane = array, lane
        super().__init__(f"lined({array.name}, {lane.name})")


@register_model(LinedArray)
class _LinedModel(models.StructModel):
    """The layout of the three."""

    def __init__(self, manager, kind):
        members = [("array", kind.array), ("lane", kind.lane), ("address", types.uint64)]
        super().__init__(manager, kind, members)


@intrinsic
def _candidate(typingctx, index):
    return CANDIDATE(types.int64), lambda context, builder, signature, args: args[0]


def _view(pair, lanes):
    """Return the type of the view of a model, and those of its fields."""
    kinds, lane = list(pair.types), lanes
    for name in lanes_of(pair.instance_class):
        scratch, rest = lane.types
        at = pair.fields.index(name)
        kinds[at], lane = LinedArray(kinds[at], scratch), rest
    view: Any = (
        BorrowedUniTuple(kinds[0], len(kinds), pair.instance_class)
        if len(set(kinds)) == 1
        else BorrowedTuple(kinds, pair.instance_class)
    )
    return view, kinds


@intrinsic
def _lined(typingctx, pair, lanes, address):
    view, kinds = _view(pair, lanes)

    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[0], len(pair))
        for at, _, room in _rooms(builder, pair, lanes, args[1]):
            all_three = cgutils.create_struct_proxy(kinds[at])(context, builder)
            all_three.array, all_three.lane, all_three.address = parts[at], room, args[2]
            parts[at] = all_three._getvalue()
        return context.make_tuple(builder, view, parts)

    return view(pair, lanes, types.uint64), codegen


def asked_of(question, pair, lanes, address, i, j, others):
    """Return the answer of a pair model to a question about i, the candidate j, and others."""
    return question(pair, int(i), int(j), *others)


@overload(asked_of, jit_options=INLINE)
def _asked_of_compiled(question, pair, lanes, address, i, j, others):
    def plain(question, pair, lanes, address, i, j, others):
        return question(pair, np.int64(i), np.int64(j), *others)

    def in_lanes(question, pair, lanes, address, i, j, others):
        view: Any = _lined(pair, lanes, np.uint64(address))  # type: ignore[call-arg]
        return question(view, np.int64(i), _candidate(np.int64(j)), *others)

    if isinstance(lanes, types.NoneType):
        return plain
    try:
        question.get_call_type(
            cpu_target.typing_context, (_view(pair, lanes)[0], types.int64, CANDIDATE, *others), {}
        )
    except Exception:  # the model does with j what only a plain int64 can: slower, with the same bits
        return plain
    return in_lanes


def _member(name, result):
    """Return an intrinsic that takes a member out of a lined array."""

    @intrinsic
    def take(typingctx, value):
        def codegen(context, builder, signature, args):
            return getattr(cgutils.create_struct_proxy(value)(context, builder, args[0]), name)

        return result(value)(value), codegen

    return take


_array = _member("array", lambda kind: kind.array)
_lane = _member("lane", lambda kind: kind.lane)
_address = _member("address", lambda kind: types.uint64)


@overload(operator.getitem, jit_options=INLINE)
def _getitem(array, j):
    if not isinstance(array, LinedArray):
        return None
    if isinstance(j, Candidate):
        return lambda array, j: _lane(array)[_address(array)]
    return lambda array, j: _array(array)[j]
