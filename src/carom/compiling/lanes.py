"""Values of candidates side by side, seen as if they were still in their arrays.

A pair model reads ``pair.radii[j]`` of a candidate j. The search looks at eight candidates in one register,
and has put their radii side by side into a *lane*. :func:`lined` returns a view of the model, and
:func:`candidate` an index that knows its place in the lanes. In the view ``pair.radii[j]`` reads the lane and
``pair.radii[i]`` the array. Neither the view nor the index leaves a trace in the machine code.
"""

from __future__ import annotations

import operator
from typing import Any, NamedTuple

import numpy as np
from numba.core import cgutils, types
from numba.extending import intrinsic, models, overload, register_model

from carom.compiling import private
from carom.compiling.borrowed import BORROWING, BorrowedTuple, BorrowedUniTuple
from carom.compiling.columns import WIDTH, store_lane
from carom.compiling.dispatch import INLINE
from carom.compiling.private import VECTORS


class Lanes(NamedTuple):
    """Room for one field of the candidates of two searches, and for the other fields."""

    room: np.ndarray
    """(2 WIDTH,), of the type of the field."""
    rest: Any
    """Lanes, or None."""


def make_lanes(pair: Any) -> Lanes | None:
    """Return room for the fields that the type of a pair model names in ``lanes``; None where there are none,
    or where this Numba lacks what lanes need.
    """
    private.try_out(VECTORS, BORROWING)
    if not (private.has(VECTORS) and private.has(BORROWING)):
        return None
    lanes = None
    for name in reversed(lanes_of(type(pair))):
        lanes = Lanes(np.zeros(2 * WIDTH, getattr(pair, name).dtype), lanes)
    return lanes


def lanes_of(kind: type) -> tuple[str, ...]:
    """Return the names of the fields, one a component, that the search reads of candidates."""
    return tuple(getattr(kind, "lanes", ()))


def _rooms(builder, kind, value):
    """Yield the type and the value of every room of lanes."""
    while not isinstance(kind, types.NoneType):
        room, rest = kind.types
        first, value = cgutils.unpack_tuple(builder, value, 2)
        yield room, first
        kind = rest


@intrinsic
def _line_up_fields(typingctx, pair, lanes, words, begin, bits, place):
    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[0], len(pair))
        rooms = _rooms(builder, lanes, args[1])
        for name, room in zip(lanes_of(pair.instance_class), rooms, strict=True):
            at = pair.fields.index(name)
            values = pair.types[at], parts[at]
            store_lane(context, builder, values, (words, args[2]), args[3], args[4], room, args[5])
        return context.get_dummy_value()

    return types.void(pair, lanes, words, types.int64, types.int64, types.int64), codegen


def line_up_fields(pair, lanes, words, begin, bits, place):
    """Put what the search reads of eight candidates into the lanes: left to itself the compiler gathers,
    which takes several times as long.

    Parameters
    ----------
    pair : model
        The pair interaction.
    lanes : Lanes or None
        Filled from ``place`` on.
    words : uint32 array
        ``words[begin : begin + 8] >> bits`` are the candidates.
    """


@overload(line_up_fields, jit_options=INLINE)
def _line_up_fields_compiled(pair, lanes, words, begin, bits, place):
    if isinstance(lanes, types.NoneType):
        return lambda pair, lanes, words, begin, bits, place: None

    def body(pair, lanes, words, begin, bits, place):
        # Numba supplies the context
        _line_up_fields(pair, lanes, words, begin, bits, place)  # type: ignore[call-arg]

    return body


class Candidate(types.Type):
    """A component as the search sees it: its index, and its place in the lanes."""

    def __init__(self):
        super().__init__("candidate")


CANDIDATE = Candidate()


@register_model(Candidate)
class _CandidateModel(models.StructModel):
    """The layout of a candidate."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("index", types.int64), ("place", types.uint64)])


class LinedArray(types.Type):
    """An array of one value a component, and its lane."""

    def __init__(self, array, lane):
        self.array, self.lane = array, lane
        super().__init__(f"lined({array.name}, {lane.name})")


@register_model(LinedArray)
class _LinedModel(models.StructModel):
    """The layout of both."""

    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("array", kind.array), ("lane", kind.lane)])


@intrinsic
def _candidate(typingctx, index, place):
    def codegen(context, builder, signature, args):
        value = cgutils.create_struct_proxy(CANDIDATE)(context, builder)
        value.index, value.place = args
        return value._getvalue()

    return CANDIDATE(types.int64, types.uint64), codegen


def candidate(index, place):
    """Return a candidate of a search, for its pair model: from Python, its index."""
    return index


@overload(candidate, jit_options=INLINE)
def _candidate_compiled(index, place):
    return lambda index, place: _candidate(np.int64(index), np.uint64(place))  # type: ignore[call-arg]


@intrinsic
def _lined(typingctx, pair, lanes):
    names, kinds, lane = lanes_of(pair.instance_class), list(pair.types), lanes
    for name in names:
        room, rest = lane.types
        at = pair.fields.index(name)
        kinds[at], lane = LinedArray(kinds[at], room), rest
    alike = len(set(kinds)) == 1
    target: Any = (
        BorrowedUniTuple(kinds[0], len(kinds), pair.instance_class)
        if alike
        else BorrowedTuple(kinds, pair.instance_class)
    )

    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[0], len(pair))
        for name, (_, room) in zip(names, _rooms(builder, lanes, args[1]), strict=True):
            at = pair.fields.index(name)
            both = cgutils.create_struct_proxy(kinds[at])(context, builder)
            both.array, both.lane = parts[at], room
            parts[at] = both._getvalue()
        return context.make_tuple(builder, target, parts)

    return target(pair, lanes), codegen


def lined(pair, lanes):
    """Return a pair model whose fields read the lanes where they are asked for a candidate."""
    return pair


@overload(lined, jit_options=INLINE)
def _lined_compiled(pair, lanes):
    if isinstance(lanes, types.NoneType):
        return lambda pair, lanes: pair
    return lambda pair, lanes: _lined(pair, lanes)  # type: ignore[call-arg]


def _member(kind, name, result):
    """Return an intrinsic that takes a member out of a struct."""

    @intrinsic
    def take(typingctx, value):
        def codegen(context, builder, signature, args):
            return getattr(cgutils.create_struct_proxy(value)(context, builder, args[0]), name)

        return result(value)(value), codegen

    return take


_index = _member(Candidate, "index", lambda kind: types.int64)
_place = _member(Candidate, "place", lambda kind: types.uint64)
_array = _member(LinedArray, "array", lambda kind: kind.array)
_lane = _member(LinedArray, "lane", lambda kind: kind.lane)


@overload(operator.getitem, jit_options=INLINE)
def _getitem(array, j):
    if isinstance(array, LinedArray):
        if isinstance(j, Candidate):
            return lambda array, j: _lane(array)[_place(j)]
        return lambda array, j: _array(array)[j]
    if isinstance(array, types.Array) and isinstance(j, Candidate):
        return lambda array, j: array[np.uint64(_index(j))]
    return None


@overload(operator.ne, jit_options=INLINE)
def _differs(i, j):
    if isinstance(i, types.Integer) and isinstance(j, Candidate):
        return lambda i, j: np.int64(i) != _index(j)
    return None


@overload(operator.eq, jit_options=INLINE)
def _is_the_same(i, j):
    if isinstance(i, types.Integer) and isinstance(j, Candidate):
        return lambda i, j: np.int64(i) == _index(j)
    return None
