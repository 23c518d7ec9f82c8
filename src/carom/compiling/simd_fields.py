"""Values of candidates side by side, seen as if they were still in their arrays.

A pair model reads ``pair.radii[j]`` of a candidate j. The search looks at eight candidates in one register,
and has put their radii side by side into a *lane*. :func:`asked_of` gives the model a view of itself, and a j
of a type of its own. In the view ``pair.radii[j]`` reads the lane and ``pair.radii[i]`` the array. Neither
leaves a trace in the machine code, and j is a whole number like any other.
"""

from __future__ import annotations

import operator
from typing import Any, NamedTuple

import numpy as np
from numba.core import cgutils, types
from numba.core.registry import cpu_target
from numba.core.typeconv import Conversion
from numba.extending import intrinsic, models, overload, register_model

from carom.compiling import numba_features
from carom.compiling.borrowed import BORROWING, BorrowedTuple, BorrowedUniTuple
from carom.compiling.dispatch import INLINE
from carom.compiling.numba_features import VECTORS
from carom.compiling.simd import WIDTH, store_lane


class Lanes(NamedTuple):
    """Room for one field of the candidates of two searches, and for the other fields."""

    scratch: np.ndarray
    """(2 WIDTH,), of the type of the field."""
    rest: Any
    """Lanes, or None."""


def make_lanes(pair: Any) -> Lanes | None:
    """Return room for the fields that the type of a pair model names in ``lanes``; None where there are none,
    or where this Numba lacks what lanes need.
    """
    numba_features.try_out(VECTORS, BORROWING)
    if not (numba_features.has(VECTORS) and numba_features.has(BORROWING)):
        return None
    lanes = None
    for name in reversed(lanes_of(type(pair))):
        lanes = Lanes(np.zeros(2 * WIDTH, getattr(pair, name).dtype), lanes)
    return lanes


def lanes_of(kind: type) -> tuple[str, ...]:
    """Return the names of the fields, one a component, that the search reads of candidates."""
    return tuple(getattr(kind, "lanes", ()))


def _scratches(builder, kind, value):
    """Yield the type and the value of every room of lanes."""
    while not isinstance(kind, types.NoneType):
        scratch, rest = kind.types
        first, value = cgutils.unpack_tuple(builder, value, 2)
        yield scratch, first
        kind = rest


@intrinsic
def _pack_fields(typingctx, pair, lanes, words, start_index, bits, address):
    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[0], len(pair))
        scratches = _scratches(builder, lanes, args[1])
        for name, scratch in zip(lanes_of(pair.instance_class), scratches, strict=True):
            at = pair.fields.index(name)
            values = pair.types[at], parts[at]
            store_lane(context, builder, values, (words, args[2]), args[3], args[4], scratch, args[5])
        return context.get_dummy_value()

    return types.void(pair, lanes, words, types.int64, types.int64, types.int64), codegen


def pack_fields(pair, lanes, words, start_index, bits, address):
    """Put what the search reads of eight candidates into the lanes: left to itself the compiler gathers,
    which takes several times as long.

    Parameters
    ----------
    pair : model
        The pair interaction.
    lanes : Lanes or None
        Filled from ``address`` on.
    words : uint32 array
        ``words[start_index : start_index + 8] >> bits`` are the candidates.
    """


@overload(pack_fields, jit_options=INLINE)
def _pack_fields_compiled(pair, lanes, words, start_index, bits, address):
    if isinstance(lanes, types.NoneType):
        return lambda pair, lanes, words, start_index, bits, address: None

    def body(pair, lanes, words, start_index, bits, address):
        # Numba supplies the context
        _pack_fields(pair, lanes, words, start_index, bits, address)  # type: ignore[call-arg]

    return body


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
        scratches = _scratches(builder, lanes, args[1])
        for name, (_, scratch) in zip(lanes_of(pair.instance_class), scratches, strict=True):
            at = pair.fields.index(name)
            all_three = cgutils.create_struct_proxy(kinds[at])(context, builder)
            all_three.array, all_three.lane, all_three.address = parts[at], scratch, args[2]
            parts[at] = all_three._getvalue()
        return context.make_tuple(builder, view, parts)

    return view(pair, lanes, types.uint64), codegen


def asked_of(question, pair, lanes, address, i, j, others):
    """Return the answer of a pair model to a question about i, the candidate j, and others.

    Parameters
    ----------
    question : function
        Which is asked as ``question(pair, i, j, *others)``.
    pair, lanes : models
        The pair interaction, and its lanes or None.
    address : int
        Where in the lanes the candidate is.
    i, j : int
        The two.
    others : tuple
        What else the question takes.
    """
    return question(pair, int(i), int(j), *others)


@overload(asked_of, jit_options=INLINE)
def _asked_of_compiled(question, pair, lanes, address, i, j, others):
    def plain(question, pair, lanes, address, i, j, others):
        return question(pair, np.int64(i), np.int64(j), *others)

    def in_lanes(question, pair, lanes, address, i, j, others):
        # Numba supplies the context
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
