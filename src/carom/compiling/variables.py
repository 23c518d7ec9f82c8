"""Variables: what names stand for in a function, and values that come from several blocks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from carom.compiling.arrays import Arrays
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    FLOAT32,
    FLOAT64,
    INT64,
    POINTER,
    UINT64,
    Array,
    Bound,
    Known,
    Leaf,
    Lined,
    Number,
    Record,
    Several,
    Slot,
    Type,
    described,
)
from carom.compiling.source import Plan


class Widened(Exception):
    """A variable must hold numbers of a wider type than its first value has."""

    def __init__(self, scope: Scope, name: str, kind: Type):
        self.scope, self.name, self.kind = scope, name, kind


class Scope:
    """What the names of a function stand for while it is written."""

    def __init__(self, plan: Plan, exit: str, wide: dict[str, Type]):
        self.plan, self.exit, self.wide = plan, exit, wide
        self.names: dict[str, Any] = {}
        self.in_slots: set[str] = set()
        self.returns: list[tuple[str, Any, list[str]]] = []  # block, value, and room for lines before its end
        self.sure: set[str] = set()  # names that have a value, whichever way was taken
        # Where break and continue go, and the names that have a value there.
        self.loops: list[tuple[str, str, list[set[str]], list[set[str]]]] = []
        self.depth = 0  # branches and loops in which the statement at hand is


def joined(old: Type, new: Type) -> Type | None:
    """Return the type of a variable that holds numbers of two types; None if there is none."""
    if old is new:
        return old
    if FLOAT64 in (old, new):
        return FLOAT64 if old is not FLOAT32 else None
    if FLOAT32 in (old, new):
        return None
    wide = {INT64 if each.signed or each is BOOL else each for each in (old, new)}
    if UINT64 in wide and INT64 in wide:
        return UINT64 if old is INT64 else None
    return UINT64 if wide == {UINT64} else UINT64 if not any(each.signed for each in wide) else INT64


class Variables(Arrays):
    """What holds the values of names."""

    # Variables.

    def slot_for(self, scope: Scope, name: str, value: Any) -> Any:
        """Return places for a value; what has no number stays as it is."""
        if isinstance(value, Known | Number) and value.type is not None:
            kind = scope.wide.get(name, value.type)
            return Slot(kind, self.alloca(kind.llvm))
        if isinstance(value, Several):
            parts = [
                self.slot_for(scope, f"{name}.{k}", self.get(each)) for k, each in enumerate(value.items)
            ]
            return Several(value.cls, parts)
        if isinstance(value, Array):
            lengths = [self.slot_for(scope, f"{name}.{k}", self.get(n)) for k, n in enumerate(value.lengths)]
            return value._replace(data=Slot(POINTER, self.alloca("ptr")), lengths=lengths)
        if isinstance(value, Record):
            return Record(value.dtype, Slot(POINTER, self.alloca("ptr")))
        return value

    def put(self, scope: Scope, name: str, slot: Any, value: Any) -> None:
        """Write a value to its places."""
        value = self.get(value)
        if isinstance(slot, Slot) and isinstance(value, Known | Number) and value.type is not None:
            kind = joined(slot.type, value.type)
            if isinstance(value, Known) and value.type is INT64 and value.value >= 0 and slot.type is UINT64:
                kind = UINT64
            if kind is None or (self.careful and slot.type is INT64 and kind is UINT64):
                raise Untranslatable(
                    f"{name.partition('.')[0]} was a {slot.type}, and is a {value.type} here: "
                    "give it another name"
                )
            if kind is not slot.type:
                raise Widened(scope, name, kind)
            self.emit(f"store {kind.llvm} {self.text(self.cast(value, kind))}, ptr {slot.address}")
        elif isinstance(slot, Several) and isinstance(value, Several) and alike(slot, value):
            for k, (place, part) in enumerate(zip(slot.items, value.items, strict=True)):
                self.put(scope, f"{name}.{k}", place, part)
        elif isinstance(slot, Array) and isinstance(value, Array) and alike(slot, value):
            self.emit(f"store ptr {self.place(value.data)}, ptr {slot.data.address}")
            for k, (place, part) in enumerate(zip(slot.lengths, value.lengths, strict=True)):
                self.put(scope, f"{name}.{k}", place, part)
        elif isinstance(slot, Record) and isinstance(value, Record) and slot.dtype == value.dtype:
            self.emit(f"store ptr {self.place(value.address)}, ptr {slot.address.address}")
        elif not (isinstance(slot, Known) and slot.same(value)) and slot is not value:
            raise Untranslatable(
                f"{name.partition('.')[0]} was {described(slot)}, and is {described(value)} here: "
                "give it another name"
            )

    def bind(self, scope: Scope, name: str, value: Any) -> None:
        """Let a name stand for a value from here on."""
        value = self.get(value)
        scope.sure.add(name)
        if name in scope.in_slots:
            if scope.depth > 0 or fits(scope.names[name], value):
                self.put(scope, name, scope.names[name], value)
                return
        elif scope.plan.assigned.get(name, 0) == 1 and scope.depth == 0:
            scope.names[name] = value
            return
        before = scope.names.get(name)
        if before is not None and scope.depth > 0 and not (isinstance(before, Known) and before.same(value)):
            raise Untranslatable(f"{name} is {described(before)} or {described(value)}: give it another name")
        if (isinstance(value, Known) and value.type is None) or isinstance(value, Lined | Bound):
            scope.names[name] = value
            return
        slot = self.slot_for(scope, name, value)
        scope.names[name] = slot
        scope.in_slots.add(name)
        self.put(scope, name, slot, value)

    # Values from several blocks.

    def held(self, value: Any, label: str) -> tuple[str, Any, list[str]]:
        """Go on at a label with a value: what :meth:`merged` takes."""
        room: list[str] = []
        self.body.append(room)
        block = self.block
        self.jump(label)
        return block, value, room

    def merged(self, ways: list[tuple[str, Any, list[str]]]) -> Any:
        """Return the value that comes from one of several blocks."""
        _, first, _ = ways[0]
        values = [each for _, each, _ in ways]
        if len(ways) == 1 or (isinstance(first, Known) and all(first.same(each) for each in values)):
            return first
        if all(isinstance(each, Known | Number) and each.type is not None for each in values):
            return self._merged_numbers(ways)
        if not all(alike(first, each) for each in values):
            other = next(each for each in values if not alike(first, each))
            raise Untranslatable(f"this is {described(first)} or {described(other)}: let both be alike")

        def part(column: Sequence[Any]) -> Any:
            return self.merged(
                [(way[0], self.get(each), way[2]) for way, each in zip(ways, column, strict=True)]
            )

        def pointer(column: Sequence[Any]) -> Any:
            if all(each == column[0] for each in column):
                return column[0]
            given = [f"[ {self.place(each)}, %{way[0]} ]" for way, each in zip(ways, column, strict=True)]
            return self.op(f"phi ptr {', '.join(given)}")

        if isinstance(first, Several):
            columns = zip(*(each.items for each in values), strict=True)
            return Several(first.cls, [part(column) for column in columns])
        if isinstance(first, Record):
            return Record(first.dtype, pointer([each.address for each in values]))
        if isinstance(first, Array):
            data = pointer([each.data for each in values])
            lengths = [part(column) for column in zip(*(each.lengths for each in values), strict=True)]
            return first._replace(data=data, lengths=lengths, local=any(each.local for each in values))
        raise Untranslatable(f"this is {described(first)} or another: let both be alike")

    def select(self, condition: str, yes: Any, no: Any) -> Any:
        """Return one of two numbers that both are there."""
        if isinstance(yes, Known) and yes.same(no):
            return yes
        both = together([yes.type, no.type])
        yes, no = self.cast(yes, both), self.cast(no, both)
        return Number(both, self.choose(condition, self.text(yes), self.text(no), both.llvm))

    def _merged_numbers(self, ways: list[tuple[str, Any, list[str]]]) -> Number:
        both = together([each.type for _, each, _ in ways])
        parts, body = [], self.body
        for block, value, room in ways:
            self.body = room
            parts.append(f"[ {self.text(self.cast(value, both))}, %{block} ]")
        self.body = body
        natural = all(isinstance(each, Number) and each.natural for _, each, _ in ways)
        return Number(both, self.op(f"phi {both.llvm} {', '.join(parts)}"), natural)


def together(kinds: Sequence[Type]) -> Type:
    """Return the type of a number that is one of several."""
    if len({*kinds}) == 1:
        return kinds[0]
    if any(each.is_float for each in kinds):
        return FLOAT64
    return INT64 if BOOL in kinds or any(each.signed for each in kinds) else UINT64


def alike(a: Any, b: Any) -> bool:
    """Tell whether two values are of one kind, whatever their numbers."""
    if isinstance(a, Several) and isinstance(b, Several):
        same = a.cls is b.cls and len(a.items) == len(b.items)
        return same and all(alike(x, y) for x, y in zip(a.items, b.items, strict=True))
    if isinstance(a, Array) and isinstance(b, Array):
        return (a.dtype, len(a.lengths), *a[4:]) == (b.dtype, len(b.lengths), *b[4:])
    if isinstance(a, Record) and isinstance(b, Record):
        return a.dtype == b.dtype
    if isinstance(a, Known) and a.type is None:
        return a.same(b)
    return all(isinstance(each, Known | Number | Slot | Leaf) and each.type is not None for each in (a, b))


def fits(place: Any, value: Any) -> bool:
    """Tell whether a place is of the very types of a value."""
    if isinstance(place, Slot):
        return getattr(value, "type", None) is place.type
    if isinstance(place, Several) and alike(place, value):
        return all(fits(a, b) for a, b in zip(place.items, value.items, strict=True))
    return alike(place, value)
