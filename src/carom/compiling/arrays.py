"""Arrays, records, tuples and their parts: where they lie, what is read and written."""

from __future__ import annotations

import ast
import inspect
import math
import types
from collections import namedtuple
from typing import Any

import numpy as np

from carom.compiling.arithmetic import Arithmetic
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    INT64,
    LINE,
    OF_DTYPE,
    POINTER,
    UINT8,
    Array,
    Bound,
    Candidate,
    Known,
    Leaf,
    Lined,
    Number,
    Record,
    Several,
    Type,
    described,
)

MOST_LOCAL = 4096  # numbers of an array on the stack
MOST_UNKNOWN = 16  # if their number is not known while compiling: there is room for a place


def element_type(dtype: np.dtype) -> Type:
    """Return the type of the numbers of an array, as they lie in memory."""
    kind = OF_DTYPE.get(dtype)
    if kind is None:
        raise Untranslatable(f"an array of {dtype} is not known here")
    return UINT8 if kind is BOOL else kind


OF_TUPLES = {name for name in vars(namedtuple("Any", ())) if name.startswith("_")}
"""What every named tuple has."""


class Arrays(Arithmetic):
    """What reads and writes memory."""

    def load(self, kind: Type, address: str) -> Number:
        """Return the number at an address."""
        return Number(kind, self.op(f"load {kind.llvm}, ptr {address}, align {kind.bits // 8}"))

    def store(self, kind: Type, value: Any, address: str) -> None:
        """Write a number to an address."""
        value = self.cast(value, kind)
        self.emit(f"store {kind.llvm} {self.text(value)}, ptr {address}, align {kind.bits // 8}")

    def fail_if(self, condition: str, words: str, *shown: str) -> None:
        """Leave the function where a condition holds; two numbers are told with the words."""
        failed, more = self.label(), self.label()
        self.branch(condition, failed, more)
        self.start(failed)
        self.fail(words, *shown)
        self.start(more)

    def fail(self, words: str, *shown: str) -> None:
        """Leave the function, and tell the caller why: the name of an exception, and what it says."""
        self.faulty = True
        fault = self.leaf(Leaf(0, POINTER))
        for k, value in enumerate((str(self.module.fault(words)), *shown)):
            address = self.op(f"getelementptr i64, ptr {fault}, i64 {k}")
            self.emit(f"store i64 {value}, ptr {address}, align 8")
        self.jump("failed")

    def leave_if_failed(self) -> None:
        """Leave the function if one that it called has failed."""
        self.faulty = True
        fault = self.leaf(Leaf(0, POINTER))
        number = self.op(f"load i64, ptr {fault}, align 8")
        more = self.label()
        self.branch(self.op(f"icmp ne i64 {number}, 0"), "failed", more)
        self.start(more)

    def index(self, value: Any, length: Any) -> Any:
        """Return an index along a dimension, as it counts from the beginning."""
        value, length = self.integer(value, "an index"), self.get(length)
        if isinstance(value, Known):
            if value.value >= 0:
                if isinstance(length, Known) and value.value >= length.value:
                    raise Untranslatable(f"index {value.value} of an array of {length.value}")
            elif isinstance(length, Known):
                if value.value < -length.value:
                    raise Untranslatable(f"index {value.value} of an array of {length.value}")
                value = Known(value.value + length.value)
            else:
                value = self.binary(ast.Add, length, value)
        elif self.careful and value.type.signed and not value.natural:
            below = self.op(f"icmp slt i64 {value.text}, 0")
            value = Number(INT64, self.choose(below, self.binary(ast.Add, value, length).text, value.text))
        if self.module.checked and not (isinstance(value, Known) and isinstance(length, Known)):
            x, n = self.text(value), self.text(length)
            self.fail_if(self.op(f"icmp uge i64 {x}, {n}"), "IndexError: index {} of an array of {}", x, n)
        return value

    def address(self, array: Array, indices: list[Any]) -> str:
        """Return the address of an element, or of the first one of a row."""
        if len(indices) > len(array.lengths):
            raise Untranslatable(f"{len(indices)} indices of an array of {len(array.lengths)} dimensions")
        flat: Any = None
        for each, length in zip(indices, array.lengths, strict=False):
            each = self.cast(self.index(each, length), INT64)
            flat = each if flat is None else self.binary(ast.Add, self.binary(ast.Mult, flat, length), each)
        for length in array.lengths[len(indices) :]:
            flat = self.binary(ast.Mult, flat, length)
        return self.element(array, flat)

    def element(self, array: Array, flat: Any) -> str:
        """Return the address of the element of a number, counted through all dimensions."""
        size = array.dtype.itemsize
        size = LINE if array.spaced else size
        kind = f"[{size} x i8]" if array.dtype.names or array.spaced else element_type(array.dtype).llvm
        return self.op(f"getelementptr {kind}, ptr {self.place(array.data)}, i64 {self.text(flat)}")

    def read(self, array: Array, address: str) -> Any:
        """Return what is at the address of an element."""
        if array.dtype.names:
            return Record(array.dtype, address)
        found = self.load(element_type(array.dtype), address)
        if array.dtype == np.bool_:
            return self.truth(found)
        return found if found.type.is_float else self.wide(found)

    def write(self, array: Array, value: Any, address: str) -> None:
        """Write an element of an array of numbers to its address."""
        if array.dtype == np.bool_:
            value = self.truth(self.number(value))
        self.store(element_type(array.dtype), value, address)

    def item(self, value: Any, index: Any) -> Any:
        """Return what is in brackets: an element, a row, or a part of a tuple."""
        index = self.get(index)
        if isinstance(value, Lined) and isinstance(index, Candidate):
            return self.read(value.lane, self.element(value.lane, value.address))
        value = self.whole(value)
        if isinstance(value, Several):
            return self.part(value, index)
        if isinstance(value, Array):
            given = index.items if isinstance(index, Several) else [index]
            address = self.address(value, given)
            if len(given) < len(value.lengths):
                return value._replace(data=address, lengths=value.lengths[len(given) :])
            return self.read(value, address)
        if isinstance(value, Record) and isinstance(index, Known) and isinstance(index.value, str):
            return self.attribute(value, index.value)
        if isinstance(value, Known) and isinstance(value.value, dict):
            raise Untranslatable("a dictionary is not known here: write fields, or a tuple")
        raise Untranslatable(f"{described(value)} has no elements")

    def whole(self, value: Any) -> Any:
        """Return what has parts: a tuple or an array, also of one that is known, or that has lanes."""
        value = self.get(value)
        if isinstance(value, Known):
            return self.constant(value)
        return value.array if isinstance(value, Lined) else value

    def constant(self, value: Known) -> Any:
        """Return a tuple or an array that is known as a value with parts."""
        given = value.value
        if isinstance(given, tuple | list):
            parts = [self.constant(Known(each)) if isinstance(each, tuple) else Known(each) for each in given]
            return Several(type(given) if isinstance(given, tuple) else tuple, parts)
        if isinstance(given, np.ndarray):
            kind = element_type(given.dtype)
            name = self.module.constant(given, kind.llvm)
            return Array(given.dtype, name, [Known(each) for each in given.shape], constant=True)
        return value

    def part(self, several: Several, index: Any) -> Any:
        """Return a part of a tuple, by a number known while compiling or not."""
        index = self.integer(index, "an index")
        items, count = several.items, len(several.items)
        if isinstance(index, Known):
            if not -count <= index.value < count:
                raise Untranslatable(f"index {index.value} of a tuple of {count}")
            return self.get(items[index.value])
        if not items:
            raise Untranslatable("an empty tuple has no elements")
        index = self.cast(self.index(index, Known(count)), INT64)
        return self._chosen(items, self.cast(self.index(index, Known(count)), INT64))

    def _chosen(self, items: list[Any], index: Any) -> Any:
        """Return one of several values, all of one kind: models that are alike lie at equal distances."""
        first = items[0]
        if isinstance(first, Leaf) and all(
            isinstance(each, Leaf) and each.type is first.type for each in items
        ):
            stride = items[-1].place - items[-2].place if len(items) > 1 else 1
            if all(each.place == first.place + k * stride for k, each in enumerate(items)):
                word = self.binary(ast.Add, self.binary(ast.Mult, index, Known(stride)), Known(first.place))
                address = self.op(f"getelementptr i64, ptr %context, i64 {self.text(word)}")
                return self.word(first.type, address)
        if isinstance(first, Several) and all(
            isinstance(each, Several) and each.cls is first.cls and len(each.items) == len(first.items)
            for each in items
        ):
            columns = zip(*(each.items for each in items), strict=True)
            return Several(first.cls, [self._chosen(list(each), index) for each in columns])
        if isinstance(first, Array) and all(
            isinstance(each, Array)
            and (each.dtype, each.spaced) == (first.dtype, first.spaced)
            and len(each.lengths) == len(first.lengths)
            for each in items
        ):
            data = self._chosen([each.data for each in items], index)
            columns = zip(*(each.lengths for each in items), strict=True)
            lengths = [self._chosen(list(each), index) for each in columns]
            return Array(first.dtype, self.text(data), lengths, spaced=first.spaced)
        if isinstance(first, Known) and all(first.same(each) for each in items):
            return first
        numbers = [self.number(each) for each in items]
        kind = numbers[0].type
        if any(each.type is not kind for each in numbers):
            raise Untranslatable("parts of different types need an index that is known while compiling")
        found = self.text(numbers[-1])
        for k in range(len(items) - 2, -1, -1):
            here = self.compare(ast.Eq, index, Known(k))
            found = self.choose(here.text, self.text(numbers[k]), found, kind.llvm)
        return Number(kind, found)

    def field(self, record: Record, name: str) -> tuple[np.dtype, str]:
        """Return the type and the address of a field of a record."""
        if name not in (record.dtype.fields or {}):
            raise Untranslatable(f"this record has no {name}")
        kind, offset = record.dtype.fields[name][:2]  # type: ignore[index]
        if offset % kind.base.alignment or record.dtype.itemsize % kind.base.alignment:
            raise Untranslatable(f"{name} is not aligned: make the type by np.dtype(..., align=True)")
        address = self.place(record.address)
        return kind, self.op(f"getelementptr i8, ptr {address}, i64 {offset}") if offset else address

    def attribute(self, value: Any, name: str) -> Any:
        """Return what stands after a point."""
        value = self.whole(value)
        if isinstance(value, Several):
            fields = getattr(value.cls, "_fields", ())
            if name in OF_TUPLES or name.startswith("__"):
                raise Untranslatable(f"{name} is not known here: write the fields that you need")
            if name in fields:
                return self.get(value.items[fields.index(name)])
            found = getattr(value.cls, name, None)
            static = isinstance(inspect.getattr_static(value.cls, name, None), staticmethod)
            if isinstance(found, types.FunctionType) and not static:
                return Bound(found, value)
            if found is not None:
                return Known(found)
            raise Untranslatable(f"{described(value)} has no {name}")
        if isinstance(value, Record):
            kind, address = self.field(value, name)
            if kind.subdtype:
                return Array(kind.base, address, [Known(each) for each in kind.shape])
            return self.read(Array(kind, address, []), address)
        if isinstance(value, Array):
            if name == "shape":
                return Several(tuple, [self.get(each) for each in value.lengths])
            if name == "ndim":
                return Known(len(value.lengths))
            if name == "size":
                return self.total(value)
            if name == "copy":
                return Bound(name, value)
            raise Untranslatable(f".{name} of an array is not known here: write a loop")
        if isinstance(value, Known) and value.type is None:
            try:
                return Known(getattr(value.value, name))
            except AttributeError:
                raise Untranslatable(f"{described(value)} has no {name}") from None
        if name in ("view", "item"):
            return Bound(name, value)
        raise Untranslatable(f".{name} of {described(value)} is not known here")

    def total(self, array: Array) -> Any:
        """Return the number of elements."""
        total: Any = Known(1)
        for each in array.lengths:
            total = self.binary(ast.Mult, total, self.get(each))
        return total

    def length(self, value: Any) -> Any:
        """Return the length of a tuple, or along the first dimension of an array."""
        value = self.whole(value)
        if isinstance(value, Several):
            return Known(len(value.items))
        if isinstance(value, Array):
            found = self.get(value.lengths[0])
            return found if isinstance(found, Known) else Number(found.type, found.text, natural=True)
        raise Untranslatable(f"{described(value)} has no length")

    def local_array(self, shape: Any, dtype: np.dtype, fill: Any = None) -> Array:
        """Return an array on the stack, whose shape is known while compiling."""
        given = shape.items if isinstance(shape, Several) else [shape]
        lengths = [self.integer(each, "a length") for each in given]
        if len(lengths) == 1 and isinstance(lengths[0], Number):  # such as len(x)
            size, number = MOST_UNKNOWN, self.text(lengths[0])
            words = f"an array of {{}} numbers; {size} at most if its size is not known while compiling"
            self.fail_if(self.op(f"icmp ugt i64 {number}, {size}"), f"ValueError: {words}", number)
        elif any(not isinstance(each, Known) or each.value < 0 for each in lengths):
            raise Untranslatable("the size of an array must be known while compiling: write numbers")
        else:
            size = math.prod(each.value for each in lengths)
        if size > MOST_LOCAL:
            raise Untranslatable(f"an array of {size} numbers is too large for a function: make it a field")
        if self.open_loops > self.loops_outside and self.careful:
            raise Untranslatable("an array cannot be made in a loop: make it before, and fill it here")
        kind = element_type(dtype)
        array = Array(dtype, self.alloca(f"[{max(size, 1)} x {kind.llvm}]", 64), lengths, True)
        if fill is not None:
            self.fill(array, fill)
        return array

    def fill(self, array: Array, value: Any, write: Any = None) -> None:
        """Write a number, or the elements of a tuple or another array in turn, to all elements."""
        if array.constant:
            raise Untranslatable("an array that is known while compiling cannot be written to")
        write, value = write or (lambda address, each: self.write(array, each, address)), self.get(value)
        if isinstance(value, Array | Several):
            self._alike_in_length(array, value)
        if isinstance(value, Several):
            for k, each in enumerate(value.items):
                write(self.element(array, Known(k)), each)
            return
        if not isinstance(value, Array):
            value = self.number(value)

        def one(k: Number) -> None:
            each = self.read(value, self.element(value, k)) if isinstance(value, Array) else value
            write(self.element(array, k), each)

        self.count_up(Known(0), self.total(array), Known(1), one)

    def _alike_in_length(self, array: Array, value: Any) -> None:
        """See that an array can take all values of a tuple or an array, and none before another is read."""
        lengths = value.lengths if isinstance(value, Array) else [Known(len(value.items))]
        if len(lengths) != len(array.lengths):
            raise Untranslatable("these have different dimensions: write a loop")
        for have, want in zip(map(self.get, lengths), map(self.get, array.lengths), strict=True):
            differ = self.compare(ast.NotEq, have, want)
            if not isinstance(differ, Known):
                if not (self.careful or self.module.checked):
                    continue
                words = "ValueError: {} values in the place of {}"
                self.fail_if(differ.text, words, self.text(have), self.text(want))
            elif differ.value:
                raise Untranslatable(f"{have.value} values in the place of {want.value}")
        if isinstance(value, Array) and self.careful:
            here, there = (self.op(f"ptrtoint ptr {self.place(each.data)} to i64") for each in (array, value))
            size = self.text(self.binary(ast.Mult, self.total(array), Known(array.dtype.itemsize)))
            behind = self.op(f"sub i64 {here}, {there}")
            inside = self.op(f"icmp ult i64 {self.op(f'sub i64 {behind}, 1')}, {size}")
            within = self.op(f"and i1 {inside}, {self.op(f'icmp ult i64 {behind}, {size}')}")
            self.fail_if(within, "ValueError: one part of an array in the place of another: write a loop")

    def count_up(self, start: Any, stop: Any, step: Any, body: Any, again: str = "") -> None:
        """Translate a loop over numbers; ``body`` gets the counter, and ``again`` is where it goes on."""
        start, stop, step = (self.integer(each, "the end of a range") for each in (start, stop, step))
        if not isinstance(step, Known) or step.value == 0:
            raise Untranslatable("the step of a range must be a known number, not 0")
        both = INT64 if start.type.signed or stop.type.signed else stop.type
        start, stop = self.cast(start, both), self.cast(stop, both)
        counter = self.alloca("i64")
        self.emit(f"store i64 {self.text(start)}, ptr {counter}")
        top, inside = self.label(), self.label()
        again, end = again or self.label(), self.label()
        self.jump(top)
        self.start(top)
        natural = step.value > 0 and (
            start.value >= 0 if isinstance(start, Known) else start.natural or not both.signed
        )
        k = Number(both, self.op(f"load i64, ptr {counter}"), natural and both.signed)
        sign = ("s" if both.signed else "u") + ("lt" if step.value > 0 else "gt")
        self.branch(self.op(f"icmp {sign} i64 {k.text}, {self.text(stop)}"), inside, end)
        self.start(inside)
        self.open_loops += 1
        body(k)
        self.open_loops -= 1
        self.jump(again)
        if again in self.targets:
            self.start(again)
            if self.careful and abs(step.value) > 1:  # the next one may need more than 64 bits
                more, way = self.label(), (stop, k) if step.value > 0 else (k, stop)
                left = self.op(f"sub i64 {self.text(way[0])}, {self.text(way[1])}")
                self.branch(self.op(f"icmp ugt i64 {left}, {abs(step.value)}"), more, end)
                self.start(more)
            following = self.op(f"add i64 {k.text}, {self.text(self.cast(step, both))}")
            self.emit(f"store i64 {following}, ptr {counter}")
            self.jump(top)
        self.start(end)
