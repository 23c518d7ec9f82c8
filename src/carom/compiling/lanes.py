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

import ast
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.arrays import element_type
from carom.compiling.calls import Calls
from carom.compiling.faults import Untranslatable
from carom.compiling.functions import compiled_as
from carom.compiling.language import (
    INT64,
    NONE,
    UINT32,
    UINT64,
    Array,
    Candidate,
    Known,
    Lined,
    Number,
    Several,
    described,
)

LANES = 8  # values in a register

WIDTH = 32  # candidates that the last bits of a time tell apart


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


def candidate_block(rows):
    """Return room on the caller's stack: eight old events (fields, LANES), keys (LANES,), times (WIDTH,)."""
    columns = rows.dtype.itemsize // rows.dtype["t"].itemsize
    return np.zeros((columns, LANES)), np.zeros(LANES, np.int64), np.zeros(WIDTH)


def least(keys):
    """Return the smallest of eight keys."""
    return keys.min()


def pack(values, words, start_index, bits, target, offset):
    """Copy eight values, ``words[start_index:][:8] >> bits``, side by side to ``target[offset:]``."""
    for k in range(LANES):
        target[int(offset) + k] = values[int(words[start_index + k]) >> int(bits)]


def copy_words(members, cell, start, words, total, bits, code):
    """Write ``member << bits | code`` of eight, the last of another cell, to ``words`` at ``total``."""
    cell_capacity = members.shape[1]
    offset = int(cell) * cell_capacity + int(start)
    for k in range(LANES):
        member = members[(offset + k) // cell_capacity, (offset + k) % cell_capacity]
        words[int(total) + k] = (member << np.uint32(bits)) | np.uint32(code)


def replace_words(members, cell, start, old, new):
    """Write ``new`` wherever ``old`` is among the eight members of a cell from ``start`` on."""
    for k in range(LANES):
        if members[cell, int(start) + k] == old:
            members[cell, int(start) + k] = new


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


def pack_fields(pair, lanes, words, start_index, bits, address):
    """Put eight candidates' values into the lanes: left alone the compiler gathers, several times as long."""


def asked_of(question, pair, lanes, address, i, j, others):
    """Return the answer of a pair model to a question, by its name, about i, the candidate j, and others."""
    return getattr(pair, question)(int(i), int(j), *others)


def _named(self: Calls, words: Array, start: Any, bits: Any) -> Iterator[Any]:
    """Yield the components that eight words name."""
    for k in range(LANES):
        place = self.element(words, self.binary(ast.Add, start, Known(k)))
        word = self.cast(self.load(UINT32, place), UINT64)
        none = isinstance(bits, Known) and bits.value == 0
        yield word if none else self.binary(ast.RShift, word, self.cast(bits, UINT64))


@compiled_as(gather_rows)
def _gather_rows(self: Calls, rows: Any, words: Any, start: Any, bits: Any, block: Any) -> Any:
    width = rows.dtype["t"].itemsize
    number = "double" if width == 8 else "float"
    starts = [self.element(rows, word) for word in _named(self, words, start, bits)]
    for group in range(0, rows.dtype.itemsize // width, 4):
        parts = []
        for each in starts:
            place = self.op(f"getelementptr i8, ptr {each}, i64 {width * group}")
            part = self.op(f"load <4 x {number}>, ptr {place}, align {width}")
            parts.append(part if width == 8 else self.op(f"fpext <4 x float> {part} to <4 x double>"))
        for column, vector in enumerate(_transposed(self, parts), start=group):
            place = self.op(f"getelementptr double, ptr {self.place(block.data)}, i64 {column * LANES}")
            self.emit(f"store <8 x double> {vector}, ptr {place}, align 8")
    return NONE


def _transposed(self: Calls, rows: list[str]) -> list[str]:
    """Return four vectors of eight from eight vectors of four."""

    def shuffle(a: str, b: str, count: int, order: list[int]) -> str:
        given = ", ".join(f"i32 {each}" for each in order)
        kind = f"<{count} x double>"
        return self.op(f"shufflevector {kind} {a}, {kind} {b}, <8 x i32> <{given}>")

    joined = [shuffle(rows[q], rows[q + 4], 4, list(range(8))) for q in range(4)]
    even, also_even = (shuffle(joined[q], joined[q + 1], 8, [0, 8, 2, 10, 4, 12, 6, 14]) for q in (0, 2))
    odd, also_odd = (shuffle(joined[q], joined[q + 1], 8, [1, 9, 3, 11, 5, 13, 7, 15]) for q in (0, 2))
    low, high = [0, 1, 8, 9, 4, 5, 12, 13], [2, 3, 10, 11, 6, 7, 14, 15]
    return [
        shuffle(even, also_even, 8, low),
        shuffle(odd, also_odd, 8, low),
        shuffle(even, also_even, 8, high),
        shuffle(odd, also_odd, 8, high),
    ]


@compiled_as(candidate_block)
def _candidate_block(self: Calls, rows: Any) -> Any:
    columns = rows.dtype.itemsize // rows.dtype["t"].itemsize
    block = self.alloca(f"[{columns * LANES} x double]", 64)
    keys = self.alloca(f"[{LANES} x i64]", 64)
    times = self.alloca(f"[{WIDTH} x double]", 64)
    return Several(
        tuple,
        [
            Array(np.dtype(np.float64), block, [Known(columns), Known(LANES)]),
            Array(np.dtype(np.int64), keys, [Known(LANES)]),
            Array(np.dtype(np.float64), times, [Known(WIDTH)]),
        ],
    )


@compiled_as(least)
def _least(self: Calls, keys: Any) -> Any:
    vector = self.op(f"load <8 x i64>, ptr {self.place(keys.data)}, align 8")
    name = "llvm.vector.reduce.smin.v8i64"
    self.module.declare(name, f"declare i64 @{name}(<8 x i64>)")
    return Number(INT64, self.op(f"call i64 @{name}(<8 x i64> {vector})"))


@compiled_as(pack)
def _pack(self: Calls, values: Any, words: Any, start: Any, bits: Any, target: Any, offset: Any) -> Any:
    kind = element_type(target.dtype)
    for k, word in enumerate(list(_named(self, words, start, bits))):
        value = self.load(kind, self.element(values, word))
        self.store(kind, value, self.element(target, self.binary(ast.Add, offset, Known(k))))
    return NONE


def _eight(self: Calls, members: Any, cell: Any, start: Any) -> str:
    """Return the address of eight words of a cell."""
    row = self.binary(ast.Mult, self.cast(cell, INT64), self.get(members.lengths[1]))
    return self.element(members, self.binary(ast.Add, row, self.cast(start, INT64)))


def _filled(self: Calls, value: Any) -> str:
    """Return eight times the same word."""
    word = self.text(self.cast(self.wide(value), UINT32))
    one = self.op(f"insertelement <8 x i32> undef, i32 {word}, i32 0")
    return self.op(f"shufflevector <8 x i32> {one}, <8 x i32> {one}, <8 x i32> zeroinitializer")


@compiled_as(copy_words)
def _copy_words(
    self: Calls, members: Any, cell: Any, start: Any, words: Any, total: Any, bits: Any, code: Any
) -> Any:
    eight = self.op(f"load <8 x i32>, ptr {_eight(self, members, cell, start)}, align 4")
    shifted = self.op(f"shl <8 x i32> {eight}, {_filled(self, bits)}")
    named = self.op(f"or <8 x i32> {shifted}, {_filled(self, code)}")
    self.emit(f"store <8 x i32> {named}, ptr {self.element(words, self.wide(total))}, align 4")
    return NONE


@compiled_as(replace_words)
def _replace_words(self: Calls, members: Any, cell: Any, start: Any, old: Any, new: Any) -> Any:
    address = _eight(self, members, cell, start)
    held = self.op(f"load <8 x i32>, ptr {address}, align 4")
    same = self.op(f"icmp eq <8 x i32> {held}, {_filled(self, old)}")
    written = self.op(f"select <8 x i1> {same}, <8 x i32> {_filled(self, new)}, <8 x i32> {held}")
    self.emit(f"store <8 x i32> {written}, ptr {address}, align 4")
    return NONE


def _rooms(self: Calls, pair: Several, lanes: Any) -> Iterator[tuple[int, Any]]:
    """Yield the places in a model of the fields that have lanes, and their rooms."""
    for name in lanes_of(pair.cls):
        scratch, lanes = (self.get(each) for each in lanes.items)
        yield pair.cls._fields.index(name), scratch  # type: ignore[attr-defined]


@compiled_as(pack_fields)
def _pack_fields(self: Calls, pair: Any, lanes: Any, words: Any, start: Any, bits: Any, address: Any) -> Any:
    if isinstance(pair, Several):
        for at, scratch in _rooms(self, pair, lanes):
            _pack(self, self.get(pair.items[at]), words, start, bits, scratch, address)
    return NONE


@compiled_as(asked_of)
def _asked_of(
    self: Calls, question: Any, pair: Any, lanes: Any, address: Any, i: Any, j: Any, others: Any
) -> Any:
    candidate = self.cast(self.wide(j), INT64)
    if isinstance(lanes, Several):
        items = list(pair.items)
        for at, scratch in _rooms(self, pair, lanes):
            items[at] = Lined(self.get(items[at]), scratch, address)
        pair, candidate = Several(pair.cls, items), Candidate(INT64, self.text(candidate))
    method = getattr(pair.cls, question.value, None)
    if method is None:
        raise Untranslatable(f"{described(pair)} has no {question.value}")
    return self.call(Known(method), [pair, self.cast(self.wide(i), INT64), candidate, *others.items], {})
