"""Expressions: a method for each construct, which returns its value."""

from __future__ import annotations

import ast
from typing import Any

from carom.compiling.calls import Calls, Scope
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    INT64,
    Array,
    Known,
    Number,
    Several,
    described,
)

INSTEAD = {
    "Try": "try is not known here: test beforehand",
    "With": "with is not known here",
    "ListComp": "a list is not known here: write a loop over an array that is a field or np.zeros(3)",
    "List": "a list is not known here: write a tuple, or np.array([...])",
    "Dict": "a dictionary is not known here: write fields, or a tuple",
    "Set": "a set is not known here: write a tuple",
    "SetComp": "a set is not known here: write a loop",
    "DictComp": "a dictionary is not known here: write a loop",
    "GeneratorExp": "a generator is not known here: write a loop",
    "JoinedStr": "text is not known here",
    "Lambda": "a function within a function is not known here: define it outside",
    "FunctionDef": "a function within a function is not known here: define it outside",
    "ClassDef": "a class within a function is not known here: define it outside",
    "Import": "import is not known here: write it at the top of the file",
    "ImportFrom": "import is not known here: write it at the top of the file",
    "Global": "global is not known here: write to an array that is a field",
    "Nonlocal": "nonlocal is not known here: write to an array that is a field",
    "Yield": "yield is not known here",
    "Await": "await is not known here",
    "Delete": "del is not known here: leave it out",
    "NamedExpr": ":= is not known here: assign before",
    "Match": "match is not known here: write if",
    "Starred": "* is known in calls only",
}


class Expressions(Calls):
    """What translates expressions."""

    def expr(self, scope: Scope, node: Any) -> Any:
        """Return the value of an expression."""
        translate = getattr(self, f"of_{type(node).__name__}", None)
        try:
            if translate is None:
                raise Untranslatable(INSTEAD.get(type(node).__name__, "this is not known here"))
            return self.get(translate(scope, node))
        except Untranslatable as error:
            raise error.at(scope.plan.function, scope.plan.path, node.lineno) from error.__cause__

    # Expressions.

    def of_Constant(self, scope: Scope, node: ast.Constant) -> Any:
        """Return a number, None, or text."""
        return Known(node.value)

    def of_Name(self, scope: Scope, node: ast.Name) -> Any:
        """Return what a name stands for."""
        if node.id in scope.names and (node.id in scope.sure or not self.careful):
            return scope.names[node.id]
        if node.id in scope.plan.assigned:
            raise Untranslatable(f"{node.id} has no value here, or not always: give it one before")
        found = Known(scope.plan.lookup(node.id))
        return self.constant(found) if isinstance(found.value, tuple) else found

    def of_Attribute(self, scope: Scope, node: ast.Attribute) -> Any:
        """Return what stands after a point."""
        return self.attribute(self.expr(scope, node.value), node.attr)

    def of_Subscript(self, scope: Scope, node: ast.Subscript) -> Any:
        """Return an element, a row, or a part of a tuple or an array."""
        value = self.expr(scope, node.value)
        if isinstance(node.slice, ast.Slice):
            return self._cut(scope, value, node.slice)
        if isinstance(node.slice, ast.Tuple) and any(isinstance(each, ast.Slice) for each in node.slice.elts):
            raise Untranslatable("a part along several dimensions is not known here: write a loop")
        return self.item(value, self.expr(scope, node.slice))

    def _cut(self, scope: Scope, value: Any, node: ast.Slice) -> Any:
        """Return a part of a tuple, or rows of an array."""
        value = self.whole(value)
        step = self.expr(scope, node.step) if node.step else Known(1)
        low = self.expr(scope, node.lower) if node.lower else None
        high = self.expr(scope, node.upper) if node.upper else None
        if isinstance(value, Several):
            if not all(each is None or isinstance(each, Known) for each in (low, high, step)):
                raise Untranslatable("the ends of a part of a tuple must be known while compiling")
            first, last = (each.value if each else None for each in (low, high))
            return Several(tuple, value.items[first : last : step.value])
        if not isinstance(value, Array) or not isinstance(step, Known) or step.value != 1:
            raise Untranslatable(f"a part of {described(value)} is not known here: write a loop")
        length = self.get(value.lengths[0])
        low, high = (
            given if each is None else self._end(each, length)
            for each, given in ((low, Known(0)), (high, length))
        )
        count = self.binary(ast.Sub, high, low)
        if not isinstance(count, Known):
            below = self.op(f"icmp slt i64 {count.text}, 0")
            count = Number(INT64, self.choose(below, "0", count.text), natural=True)
        elif count.value < 0:
            count = Known(0)
        start = low
        for each in value.lengths[1:]:
            start = self.binary(ast.Mult, start, each)
        address = self.element(value, self.cast(start, INT64))
        return value._replace(data=address, lengths=[count, *value.lengths[1:]])

    def _end(self, end: Any, length: Any) -> Any:
        """Return an end of a part as Python takes it: from the end if negative, and within the array."""
        end = self.cast(self.integer(end, "an end"), INT64)
        if isinstance(end, Known) and isinstance(length, Known):
            return Known(slice(end.value).indices(length.value)[1])
        length = self.cast(length, INT64)
        n = self.text(length)
        below = self.op(f"icmp slt i64 {self.text(end)}, 0")
        text = self.choose(below, self.text(self.binary(ast.Add, end, length)), self.text(end))
        text = self.choose(self.op(f"icmp slt i64 {text}, 0"), "0", text)
        return Number(INT64, self.choose(self.op(f"icmp sgt i64 {text}, {n}"), n, text), natural=True)

    def of_Tuple(self, scope: Scope, node: ast.Tuple) -> Any:
        """Return a tuple."""
        return Several(tuple, self._values(scope, node.elts))

    def _values(self, scope: Scope, nodes: list[Any]) -> list[Any]:
        found = []
        for each in nodes:
            if isinstance(each, ast.Starred):
                several = self.expr(scope, each.value)
                if not isinstance(several, Several):
                    raise Untranslatable(f"* needs a tuple, found {described(several)}")
                found += several.items
            else:
                found.append(self.expr(scope, each))
        return found

    def of_BinOp(self, scope: Scope, node: ast.BinOp) -> Any:
        """Return the result of an operation."""
        left = self.expr(scope, node.left)
        return self.binary(type(node.op), left, self.expr(scope, node.right))

    def of_UnaryOp(self, scope: Scope, node: ast.UnaryOp) -> Any:
        """Return the result of an operation of one value."""
        if isinstance(node.op, ast.Not):
            value = self.condition(scope, node.operand)
            if isinstance(value, Known):
                return Known(not value.value)
            return Number(BOOL, self.op(f"xor i1 {value.text}, true"))
        value = self.expr(scope, node.operand)
        if isinstance(node.op, ast.UAdd):
            return self.wide(value)
        return self.negative(value) if isinstance(node.op, ast.USub) else self.inverted(value)

    def of_Compare(self, scope: Scope, node: ast.Compare) -> Any:
        """Return what comparisons give; the second is made only where the first holds."""
        left = self.expr(scope, node.left)
        if len(node.ops) == 1:
            return self.compare(type(node.ops[0]), left, self.expr(scope, node.comparators[0]))
        held = [left]

        def link(k: int) -> Any:
            held.append(self.expr(scope, node.comparators[k]))
            return self.compare(type(node.ops[k]), held[k], held[k + 1])

        return self.decided(True, [lambda k=k: link(k) for k in range(len(node.ops))])

    def of_BoolOp(self, scope: Scope, node: ast.BoolOp) -> Any:
        """Return what and or or gives for bools; the second is looked at only where it matters."""

        def way(each: Any) -> Any:
            value = self.expr(scope, each)
            if getattr(value, "type", None) is not BOOL:
                raise Untranslatable(
                    f"and and or join bools here, found {described(value)}: write a if b else c"
                )
            return value

        return self.decided(
            isinstance(node.op, ast.And), [lambda each=each: way(each) for each in node.values]
        )

    def condition(self, scope: Scope, node: Any) -> Any:
        """Return the truth of an expression; and and or may join anything there."""
        if not isinstance(node, ast.BoolOp):
            return self.truth(self.expr(scope, node))
        ways = [lambda each=each: self.condition(scope, each) for each in node.values]
        return self.decided(isinstance(node.op, ast.And), ways)

    def decided(self, is_and: bool, ways: list[Any]) -> Any:
        """Return whether all hold, or any, asked in turn until that is decided."""
        incoming: list[tuple[str, str]] = []
        end = ""
        for k, each in enumerate(ways):
            value = self.truth(each())
            last = k == len(ways) - 1
            decides = isinstance(value, Known) and bool(value.value) != is_and
            if isinstance(value, Known) and not decides and not last:
                continue
            if last or decides:
                if not end:
                    return value
                incoming.append((self.text(value), self.block))
                self.jump(end)
                break
            end, more = end or self.label(), self.label()
            incoming.append(("false" if is_and else "true", self.block))
            self.branch(value.text, more if is_and else end, end if is_and else more)
            self.start(more)
        self.start(end)
        return Number(
            BOOL, self.op("phi i1 " + ", ".join(f"[ {text}, %{block} ]" for text, block in incoming))
        )

    def of_IfExp(self, scope: Scope, node: ast.IfExp) -> Any:
        """Return one of two values."""
        condition = self.condition(scope, node.test)
        if isinstance(condition, Known):
            return self.expr(scope, node.body if condition.value else node.orelse)
        if _is_there(node.body) and _is_there(node.orelse):
            both = self.expr(scope, node.body), self.expr(scope, node.orelse)
            if all(isinstance(each, Known | Number) and each.type is not None for each in both):
                return self.select(condition.text, *both)
        yes, no, end = self.label(), self.label(), self.label()
        self.branch(condition.text, yes, no)
        ways = []
        scope.depth += 1
        for label, each in ((yes, node.body), (no, node.orelse)):
            self.start(label)
            ways.append(self.held(self.expr(scope, each), end))
        scope.depth -= 1
        self.start(end)
        return self.merged(ways)

    def of_Call(self, scope: Scope, node: ast.Call) -> Any:
        """Return what a function gives."""
        function = self.expr(scope, node.func)
        listed = isinstance(function, Known) and getattr(function.value, "__name__", "") == "array"
        arguments = []
        for each in node.args:
            if listed and isinstance(each, ast.List):
                arguments.append(Several(tuple, self._values(scope, each.elts)))
            else:
                arguments += self._values(scope, [each])
        if any(each.arg is None for each in node.keywords):
            raise Untranslatable("** is not known here: name the arguments")
        named = {str(each.arg): self.expr(scope, each.value) for each in node.keywords}
        return self.call(function, arguments, named)


def _is_there(node: Any) -> bool:
    """Tell whether a value needs no computation: for a branch LLVM would move loads into it."""
    if isinstance(node, ast.UnaryOp):
        node = node.operand
    return isinstance(node, ast.Name | ast.Constant)
