"""Statements, and with them the whole of the language: a method for each construct."""

from __future__ import annotations

import ast
from typing import Any

from carom.compiling.arrays import element_type
from carom.compiling.calls import Scope, Widened
from carom.compiling.expressions import INSTEAD, Expressions
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    INT64,
    NONE,
    UINT64,
    Array,
    Known,
    Record,
    Several,
    described,
)

UNROLLED = 16
"""Rounds up to which a loop over known numbers is written out. One over lanes is left to be vectorized."""


class Translator(Expressions):
    """Writes functions of Python as one function of LLVM."""

    def statements(self, scope: Scope, body: list[Any]) -> None:
        """Translate statements, up to one that ends the block for good."""
        for each in body:
            if self.dead:
                return
            translate = getattr(self, f"do_{type(each).__name__}", None)
            try:
                if translate is None:
                    raise Untranslatable(INSTEAD.get(type(each).__name__, "this is not known here"))
                translate(scope, each)
            except Untranslatable as error:
                raise error.at(scope.plan.function, scope.plan.path, each.lineno) from error.__cause__
            except Widened:
                raise
            except RecursionError:
                raise Untranslatable("functions call each other too deeply").at(
                    scope.plan.function, scope.plan.path, each.lineno
                ) from None
            except Exception as error:
                if not self.careful:
                    raise
                raise Untranslatable("this is not known here").at(
                    scope.plan.function, scope.plan.path, each.lineno
                ) from error

    def do_Expr(self, scope: Scope, node: ast.Expr) -> None:
        """Call a function for what it does."""
        if not isinstance(node.value, ast.Constant):
            self.expr(scope, node.value)

    def do_Pass(self, scope: Scope, node: ast.Pass) -> None:
        """Do nothing."""

    def do_Return(self, scope: Scope, node: ast.Return) -> None:
        """Leave the function."""
        value = NONE if node.value is None else self.expr(scope, node.value)
        scope.returns.append(self.held(value, scope.exit))

    def do_Raise(self, scope: Scope, node: ast.Raise) -> None:
        """Leave all functions; the caller raises what is written here."""
        error, words = node.exc, ""
        if isinstance(error, ast.Call):
            words = _told(error.args[0]) if error.args else ""
            error = error.func
        name = ast.unparse(error).rpartition(".")[2] if error is not None else "RuntimeError"
        self.fail(f"{name}: {words}")

    def do_Assert(self, scope: Scope, node: ast.Assert) -> None:
        """Leave all functions unless something holds."""
        held = self.condition(scope, node.test)
        words = _told(node.msg or node.test)
        failed = self.op(f"xor i1 {self.text(held)}, true")
        self.fail_if(failed, f"AssertionError: {words}")

    def do_Assign(self, scope: Scope, node: ast.Assign) -> None:
        """Give names, fields and elements a value."""
        value = self.expr(scope, node.value)
        for each in node.targets:
            self.assign(scope, each, value)

    def do_AnnAssign(self, scope: Scope, node: ast.AnnAssign) -> None:
        """Do the same; the annotation is for readers."""
        if node.value is not None:
            self.assign(scope, node.target, self.expr(scope, node.value))

    def assign(self, scope: Scope, target: Any, value: Any) -> None:
        """Give a target a value."""
        if isinstance(target, ast.Tuple | ast.List):
            value = self.whole(value)
            if isinstance(value, Array) and isinstance(self.get(value.lengths[0]), Known):
                value = Several(tuple, [self.item(value, Known(k)) for k in range(value.lengths[0].value)])
            if not isinstance(value, Several) or len(value.items) != len(target.elts):
                raise Untranslatable(
                    f"{len(target.elts)} names for {described(value)}"
                    + (", whose length is not known here: write [0]" if isinstance(value, Array) else "")
                )
            for each, part in zip(target.elts, value.items, strict=True):
                self.assign(scope, each, part)
        elif isinstance(target, ast.Name):
            self.bind(scope, target.id, value)
        elif isinstance(target, ast.Attribute):
            kind, address = self._field(scope, target)
            self.store(kind, value, address)
        elif isinstance(target, ast.Subscript):
            self._assign_item(scope, target, value, None)
        else:
            raise Untranslatable("this cannot be assigned to")

    def _field(self, scope: Scope, node: ast.Attribute) -> tuple[Any, str]:
        """Return the type and the address of a field to write."""
        record = self.expr(scope, node.value)
        if not isinstance(record, Record):
            raise Untranslatable(
                f"a field of {described(record)} cannot be written: let it be an array, and write its element"
            )
        kind, address = self.field(record, node.attr)
        return element_type(kind), address

    def _assign_item(self, scope: Scope, node: ast.Subscript, value: Any, operation: type | None) -> None:
        """Write to an element, or to all that are in brackets; with an operation, what that gives.

        Without one ``value`` is known already; with one it is an expression, which comes after what is there.
        """
        array = self.expr(scope, node.value)
        if not isinstance(array, Array) or array.constant:
            raise Untranslatable(f"{described(array)} cannot be written to: let it be an array of the model")
        if array.dtype.names:
            raise Untranslatable("a record is written field by field")
        parts: list[Any] = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        cuts = [k for k, each in enumerate(parts) if isinstance(each, ast.Slice)]
        if not cuts:
            index = [self.expr(scope, each) for each in parts]
            if len(index) == 1 and isinstance(index[0], Several):
                index = index[0].items
            if len(index) == len(array.lengths):
                address = self.address(array, index)
                if operation is not None:
                    before = self.read(array, address)
                    value = self.binary(operation, before, self.expr(scope, value))
                return self.write(array, value, address)
            array = self.item(array, Several(tuple, index))
        elif len(parts) == 1:
            array = self._cut(scope, array, parts[0])
        if operation is not None:
            value = self.expr(scope, value)
        if len(parts) == 1 or not cuts:
            return self._assign_all(array, value, operation)
        if (
            len(cuts) > 1
            or parts[cuts[0]].step
            or len(parts) != len(array.lengths)
            or isinstance(value, Array | Several)
        ):
            raise Untranslatable("these parts of an array are not known here: write a loop")
        cut = parts[cuts[0]]
        given = [None if isinstance(each, ast.Slice) else self.expr(scope, each) for each in parts]
        length = self.get(array.lengths[cuts[0]])
        low = self._end(self.expr(scope, cut.lower), length) if cut.lower else Known(0)
        high = self._end(self.expr(scope, cut.upper), length) if cut.upper else length

        def one(k: Any) -> None:
            address = self.address(array, [k if each is None else each for each in given])
            self._write(array, address, value, operation)

        return self.count_up(low, self.cast(high, INT64), Known(1), one)

    def _write(self, array: Array, address: str, value: Any, operation: type | None) -> None:
        """Write a number to an element, or what an operation gives of both."""
        if operation is not None:
            value = self.binary(operation, self.read(array, address), value)
        self.write(array, value, address)

    def _assign_all(self, array: Array, value: Any, operation: type | None) -> None:
        """Write to all elements of an array."""
        self.fill(array, value, lambda address, each: self._write(array, address, each, operation))

    def do_AugAssign(self, scope: Scope, node: ast.AugAssign) -> None:
        """Change a name, a field or elements by an operation."""
        target, kind = node.target, type(node.op)
        if isinstance(target, ast.Name):
            before = self.get(self.of_Name(scope, target))
            value = self.expr(scope, node.value)
            if isinstance(before, Array):
                return self._assign_all(before, value, kind)
            return self.bind(scope, target.id, self.binary(kind, before, value))
        if isinstance(target, ast.Attribute):
            field, address = self._field(scope, target)
            before = self.load(field, address)
            return self.store(field, self.binary(kind, before, self.expr(scope, node.value)), address)
        return self._assign_item(scope, target, node.value, kind)

    def do_If(self, scope: Scope, node: ast.If) -> None:
        """Translate the branch that is taken, or both."""
        condition = self.condition(scope, node.test)
        if isinstance(condition, Known):
            return self.statements(scope, node.body if condition.value else node.orelse)
        yes, no, end = self.label(), self.label(), self.label()
        self.branch(condition.text, yes, no)
        scope.depth += 1
        before, ways = scope.sure, []
        for label, body in ((yes, node.body), (no, node.orelse)):
            self.start(label)
            scope.sure = {*before}
            self.statements(scope, body)
            if not self.dead:
                ways.append(scope.sure)
            self.jump(end)
        scope.depth -= 1
        self._together(scope, end, ways)
        return None

    def _together(self, scope: Scope, label: str, ways: list[set[str]]) -> None:
        """Go on where several ways meet, if there is one: with the names that have a value on all of them."""
        if ways:
            self.start(label)
            scope.sure = set.intersection(*ways)

    def do_While(self, scope: Scope, node: ast.While) -> None:
        """Translate a loop with a condition."""
        top, inside, otherwise, end = self.label(), self.label(), self.label(), self.label()
        self.jump(top)
        self.start(top)
        scope.depth += 1
        condition, before = self.condition(scope, node.test), {*scope.sure}
        breaks: list[set[str]] = []
        if isinstance(condition, Known):
            self.jump(inside if condition.value else otherwise)
        else:
            self.branch(condition.text, inside, otherwise)
        if inside in self.targets:
            self.start(inside)
            scope.loops.append((end, top, breaks, []))
            self.open_loops += 1
            self.statements(scope, node.body)
            self.open_loops -= 1
            scope.loops.pop()
            self.jump(top)
        if otherwise in self.targets:
            self.start(otherwise)
            scope.sure = before
            self._otherwise(scope, node, end, breaks)
        scope.depth -= 1
        self._together(scope, end, breaks)

    def _otherwise(self, scope: Scope, node: Any, end: str, ways: list[set[str]]) -> None:
        """Translate what follows a loop that was not left."""
        self.statements(scope, node.orelse)
        if not self.dead:
            ways.append(scope.sure)
        self.jump(end)

    def do_Break(self, scope: Scope, node: ast.Break) -> None:
        """Leave a loop."""
        scope.loops[-1][2].append(scope.sure)
        self.jump(scope.loops[-1][0])

    def do_Continue(self, scope: Scope, node: ast.Continue) -> None:
        """Go on with the next round."""
        scope.loops[-1][3].append(scope.sure)
        self.jump(scope.loops[-1][1])

    def do_For(self, scope: Scope, node: ast.For) -> None:
        """Translate a loop over a range, the parts of a tuple, or the elements of an array."""
        end, leaves = self.label(), _leaves(node.body)
        breaks: list[set[str]] = []
        given = node.iter
        if isinstance(given, ast.Call) and _is_range(self.expr(scope, given.func)):
            if not given.args or len(given.args) > 3 or given.keywords:
                raise Untranslatable("range takes one to three numbers")
            ends = [self.integer(each, "the end of a range") for each in self._values(scope, given.args)]
            if len(ends) == 1:
                ends.insert(0, Known(0, UINT64 if ends[0].type is UINT64 else INT64))
            start, stop, step = ends if len(ends) == 3 else (*ends, Known(1))
            known = all(isinstance(each, Known) for each in (start, stop, step))
            rounds = (
                range(start.value, stop.value, step.value) if known and step.value else range(UNROLLED + 1)
            )
            few = not rounds[UNROLLED:] and not _is_over_lanes(node)
            if known and step.value and few:
                kind = UINT64 if UINT64 is start.type is stop.type else INT64
                self._written_out(scope, node, [Known(k, kind) for k in rounds], end, leaves, breaks)
            else:
                self._counted(scope, node, start, stop, step, end, breaks, lambda k: k)
        else:
            value = self.whole(self.expr(scope, given))
            if isinstance(value, Several):
                self._written_out(scope, node, value.items, end, leaves, breaks)
            elif isinstance(value, Array):
                count = self.cast(self.length(value), INT64)
                self._counted(
                    scope, node, Known(0), count, Known(1), end, breaks, lambda k: self.item(value, k)
                )
            else:
                raise Untranslatable(f"a loop over {described(value)} is not known here: write range(...)")
        if not self.dead:
            self._otherwise(scope, node, end, breaks)
        self._together(scope, end, breaks)

    def _written_out(
        self, scope: Scope, node: ast.For, values: list[Any], end: str, leaves: bool, breaks: list[set[str]]
    ) -> None:
        """Write the body of a loop once for each value."""
        scope.depth += leaves
        for each in values:
            again = self.label()
            self._bind_each(scope, node.target, each)
            ways: list[set[str]] = []
            scope.loops.append((end, again, breaks, ways))
            self.statements(scope, node.body)
            scope.loops.pop()
            if not self.dead:
                ways.append(scope.sure)
            self.jump(again)
            self._together(scope, again, ways)
            if not ways:
                break
        scope.depth -= leaves

    def _bind_each(self, scope: Scope, target: Any, value: Any) -> None:
        """Let the target of a loop stand for a value: one that only counts needs no place."""
        if isinstance(target, ast.Name) and target.id in scope.plan.counters:
            scope.sure.add(target.id)
            scope.names[target.id] = self.get(value)
            return
        if isinstance(target, ast.Tuple) and isinstance(self.get(value), Several):
            for name, part in zip(target.elts, self.get(value).items, strict=True):
                self._bind_each(scope, name, part)
            return
        self.assign(scope, target, value)

    def _counted(
        self,
        scope: Scope,
        node: ast.For,
        start: Any,
        stop: Any,
        step: Any,
        end: str,
        breaks: list[set[str]],
        each: Any,
    ) -> None:
        """Translate a loop that is counted while it runs."""
        again, before = self.label(), {*scope.sure}
        scope.depth += 1

        def body(k: Any) -> None:
            self._bind_each(scope, node.target, each(k))
            scope.loops.append((end, again, breaks, []))
            self.statements(scope, node.body)
            scope.loops.pop()

        self.count_up(start, stop, step, body, again)
        scope.sure = before
        scope.depth -= 1


def _leaves(body: list[Any]) -> bool:
    """Tell whether a loop may be left, or a round cut short."""
    return any(isinstance(each, ast.Break | ast.Continue) for part in body for each in ast.walk(part))


def _told(node: Any) -> str:
    """Return what an error says; numbers are told by their names."""
    parts = node.values if isinstance(node, ast.JoinedStr) else [node]
    parts = [each.value if isinstance(each, ast.FormattedValue) else each for each in parts]
    words = (
        str(each.value) if isinstance(each, ast.Constant) else f"({ast.unparse(each)})" for each in parts
    )
    return "".join(words).replace("{", "(").replace("}", ")")


def _is_range(function: Any) -> bool:
    return isinstance(function, Known) and function.value is range


def _is_over_lanes(node: ast.For) -> bool:
    """Tell whether a loop is over the lanes of a register."""
    named = any(isinstance(each, ast.Name) and each.id == "LANES" for each in ast.walk(node.iter))
    return named or (isinstance(node.target, ast.Name) and node.target.id == "_")
