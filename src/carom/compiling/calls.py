"""Calls: functions are written where they are called, cold ones once each."""

from __future__ import annotations

import types
from collections.abc import Callable
from typing import Any

import numpy as np

from carom.compiling import registry
from carom.compiling.faults import Untranslatable
from carom.compiling.language import (
    BOOL,
    NONE,
    OF_CLASS,
    POINTER,
    Array,
    Bound,
    Known,
    Leaf,
    Lined,
    Number,
    Record,
    Several,
    Type,
    described,
)
from carom.compiling.source import Plan, plan_of
from carom.compiling.variables import Scope, Variables, Widened

FUNCTIONS: dict[Any, Callable[..., Any]] = {}
"""What compiled code has in the place of functions of Python, NumPy and this package."""

DEEPEST = 40  # calls of one function within itself


class Calls(Variables):
    """What calls functions."""

    stack: list[Any]  # functions that are being written

    def statements(self, scope: Scope, body: list[Any]) -> None:
        """Translate statements."""
        raise NotImplementedError

    def decided(self, is_and: bool, ways: list[Callable[[], Any]]) -> Any:
        """Return whether all hold, or any, asked in turn until that is decided."""
        raise NotImplementedError

    # Functions.

    def call(self, function: Any, arguments: list[Any], named: dict[str, Any]) -> Any:
        """Return what a function gives for values."""
        if isinstance(function, Bound):
            return self._method(function, arguments, named)
        if not isinstance(function, Known) or function.type is not None:
            raise Untranslatable(f"{described(function)} is no function")
        given = function.value
        try:
            special = FUNCTIONS.get(given)
        except TypeError:
            special = None
        if special is not None:
            try:
                return special(self, *arguments, **named)
            except TypeError as error:
                if "argument" not in str(error):
                    raise
                raise Untranslatable(f"{described(function)} does not take these arguments here") from None
        if isinstance(given, type):
            return self._made(given, arguments, named)
        if hasattr(given, "py_func"):
            return self._foreign(given, [self.number(each) for each in arguments])
        if not isinstance(given, types.FunctionType):
            raise Untranslatable(f"{getattr(given, '__name__', given)} is not known here")
        return self.invoke(given, arguments, named, given in registry.COLD)

    def _method(self, bound: Bound, arguments: list[Any], named: dict[str, Any]) -> Any:
        if bound.function == "view":
            target = OF_CLASS.get(arguments[0].value) if len(arguments) == 1 else None
            if target is None:
                raise Untranslatable("view takes the type of a number here")
            return self.viewed(bound.owner, target)
        if bound.function == "item":
            return bound.owner
        if bound.function == "copy":
            return self.local_array(Several(tuple, bound.owner.lengths), bound.owner.dtype, bound.owner)
        cold = bound.function in registry.COLD
        return self.invoke(bound.function, [bound.owner, *arguments], named, cold)

    def _made(self, cls: type, arguments: list[Any], named: dict[str, Any]) -> Any:
        """Return a number of a type, or a tuple."""
        kind = OF_CLASS.get(cls)
        if kind is not None:
            if len(arguments) != 1 or named:
                raise Untranslatable(f"{cls.__name__} takes one number here")
            value = self.number(arguments[0])
            return self.cast(value, kind)
        if issubclass(cls, tuple):
            fields = getattr(cls, "_fields", None)
            if fields is None:
                if cls is tuple and len(arguments) == 1 and isinstance(arguments[0], Several):
                    return Several(tuple, arguments[0].items)
                raise Untranslatable(f"{cls.__name__} is not known here: write (a, b)")
            items = dict(zip(fields, arguments, strict=False)) | named
            for name in fields:
                if name not in items:
                    if name not in cls._field_defaults:  # type: ignore[attr-defined]
                        raise Untranslatable(f"{cls.__name__} needs {name}")
                    items[name] = Known(cls._field_defaults[name])  # type: ignore[attr-defined]
            return Several(cls, [items[name] for name in fields])
        raise Untranslatable(f"{cls.__name__} is not known here")

    def _foreign(self, function: Any, arguments: list[Any]) -> Any:
        """Return what a function compiled by Numba gives: its address is a word of the context."""
        arguments = [
            each if each.type.is_float or each.type is BOOL else self.wide(each) for each in arguments
        ]
        kinds = tuple(each.type for each in arguments)
        place, result = self.module.foreign_function(function, kinds)
        octet = OF_CLASS[np.uint8]  # what C has for a bool
        arguments = [self.cast(each, octet) if each.type is BOOL else each for each in arguments]
        given = "".join(f", {each.type.llvm} {self.text(each)}" for each in arguments)
        address, fault = self.leaf(Leaf(place, POINTER)), self.leaf(Leaf(0, POINTER))
        raw = self.op(f"call {'i8' if result is BOOL else result.llvm} {address}(ptr {fault}{given})")
        self.leave_if_failed()
        return self.truth(Number(octet, raw)) if result is BOOL else Number(result, raw)

    def invoke(self, function: Any, arguments: list[Any], named: dict[str, Any], cold: bool = False) -> Any:
        """Write a function of Python here, or call it where it is cold."""
        if not isinstance(function, types.FunctionType):
            raise Untranslatable(f"{getattr(function, '__name__', function)} is not known here")
        plan = plan_of(function)
        values = list(arguments)
        rest = values[len(plan.names) :] if plan.rest else []
        del values[len(plan.names) if plan.rest else len(values) :]
        for k, name in enumerate(plan.names[len(values) :], start=len(values)):
            first = len(plan.names) - len(plan.defaults)
            if name in named:
                values.append(named.pop(name))
            elif k >= first:
                values.append(Known(plan.defaults[k - first]))
            else:
                raise Untranslatable(f"{function.__name__} needs {name}")
        if named or len(values) > len(plan.names):
            raise Untranslatable(f"{function.__name__} takes ({', '.join(plan.names)})")
        if plan.foreign:
            self.module.reached[function] = None
        if cold and not plan.rest:
            return self.call_cold(function, values)
        return self.inline(plan, values, rest)

    def inline(self, plan: Plan, values: list[Any], rest: list[Any] = []) -> Any:  # noqa: B006 (only read)
        """Write the body of a function here, and return what it gives."""
        function = plan.function
        if self.stack.count(function) >= DEEPEST:
            raise Untranslatable(f"{function.__name__} calls itself: write a loop")
        before = self.flags, self.careful, self.loops_outside
        self.loops_outside = self.open_loops
        self.flags = registry.FLAGS.get(function, self.flags)
        self.careful = plan.foreign
        self.stack.append(function)
        wide: dict[str, Type] = {}
        while True:
            lines, top = len(self.body), len(self.entry)
            before_it = {**self.leaves}, self.block, self.dead, {*self.targets}, self.open_loops
            scope = Scope(plan, self.label(), wide)
            try:
                result = self._written(scope, values, rest)
                break
            except Untranslatable as error:
                raise error.at(function, plan.path, function.__code__.co_firstlineno) from error.__cause__
            except Widened as need:
                if need.scope is not scope or wide.get(need.name) is need.kind:
                    raise
                wide[need.name] = need.kind
                del self.body[lines:], self.entry[top:]
                self.leaves, self.block, self.dead, self.targets, self.open_loops = before_it
        self.flags, self.careful, self.loops_outside = before
        self.stack.pop()
        looped = self.open_loops > self.loops_outside and self.careful
        if looped and isinstance(result, Array) and result.local:
            raise Untranslatable(f"{function.__name__} makes an array in a loop: give it one to fill")
        return result

    def _written(self, scope: Scope, values: list[Any], rest: list[Any]) -> Any:
        plan = scope.plan
        for name, value in zip(plan.names, values, strict=True):
            if plan.assigned.get(name):
                slot = self.slot_for(scope, name, self.get(value))
                if not isinstance(slot, Known | Lined | Bound):
                    scope.in_slots.add(name)
                    scope.names[name] = slot
                    self.put(scope, name, slot, value)
                    continue
            scope.names[name] = value
        if plan.rest:
            scope.names[plan.rest] = Several(tuple, rest)
        scope.sure = {*scope.names}
        self.statements(scope, plan.body)
        if not self.dead:
            scope.returns.append(self.held(NONE, scope.exit))
        if not scope.returns:
            return NONE  # it never comes back
        self.start(scope.exit)
        return self.merged(scope.returns)

    def call_cold(self, function: Any, values: list[Any]) -> Any:
        """Call a function of its own: numbers and pointers are its parameters, all else is in the context."""
        given = ["ptr %context"]
        values = [self.get(each) for each in values]
        key = (function, self.flags, *(self._apart(each, given) for each in values))
        if key not in self.module.cold:
            self.module.cold[key] = self._cold(function, values)
        name, llvm, result, faulty = self.module.cold[key]
        if llvm == "void":
            self.emit(f"call void @{name}({', '.join(given)})")
            whole = ""
        else:
            whole = self.op(f"call {llvm} @{name}({', '.join(given)})")
        if faulty:
            self.leave_if_failed()
        taken = 0

        def here(value: Any) -> Any:
            nonlocal taken
            if isinstance(value, Number):
                text = self.op(f"extractvalue {llvm} {whole}, {taken}") if llvm.startswith("{") else whole
                taken += 1
                return Number(value.type, text, value.natural)
            return (
                Several(value.cls, [here(each) for each in value.items])
                if isinstance(value, Several)
                else value
            )

        return here(result)

    def _cold(self, function: Any, values: list[Any]) -> tuple[str, str, Any, bool]:
        """Write a cold function; return its name, its type, what it gives, and whether it may fail."""
        name = f"cold{len(self.module.cold)}_{function.__name__}"
        inside = type(self)(self.module, name)
        inside.flags, inside.stack = self.flags, [*self.stack]
        parameters: list[str] = []

        def parameter(llvm: str) -> str:
            parameters.append(f"{llvm} %p{len(parameters)}")
            return f"%p{len(parameters) - 1}"

        def within(value: Any) -> Any:
            if isinstance(value, Number):
                return type(value)(value.type, parameter(value.type.llvm), value.natural)
            if isinstance(value, Several):
                return Several(value.cls, [within(each) for each in value.items])
            if isinstance(value, Record):
                return Record(value.dtype, parameter("ptr"))
            if isinstance(value, Array):
                data = value.data if isinstance(value.data, Leaf) else parameter("ptr")
                return value._replace(data=data, lengths=[within(each) for each in value.lengths])
            return value

        result = inside.inline(plan_of(function), [within(each) for each in values])
        found: list[Number] = []

        def out(value: Any) -> Any:
            value = inside.get(value)
            if isinstance(value, Number):
                found.append(value)
            elif isinstance(value, Several):
                return Several(value.cls, [out(each) for each in value.items])
            elif not isinstance(value, Known):
                raise Untranslatable(f"{function.__name__} is cold and gives {described(value)}")
            return value

        result = out(result)
        kinds = [each.type.llvm for each in found]
        llvm = "void" if not kinds else kinds[0] if len(kinds) == 1 else "{ " + ", ".join(kinds) + " }"
        whole = found[0].text if len(found) == 1 else "undef"
        if len(found) > 1 and not inside.dead:
            for k, each in enumerate(found):
                whole = inside.op(f"insertvalue {llvm} {whole}, {each.type.llvm} {each.text}, {k}")
        if not inside.dead:
            inside.emit("ret void" if not found else f"ret {llvm} {whole}")
        inside.finish(llvm, parameters, "internal", "noinline nounwind")
        return name, llvm, result, inside.faulty

    def _apart(self, value: Any, given: list[str]) -> Any:
        """Return what of a value a cold function depends on, and add what it is given at run time."""
        if isinstance(value, Number):
            given.append(f"{value.type.llvm} {value.text}")
            return type(value), value.type, value.natural
        if isinstance(value, Several):
            return (value.cls, *(self._apart(each, given) for each in value.items))
        if isinstance(value, Record):
            given.append(f"ptr {self.place(value.address)}")
            return "record", value.dtype
        if isinstance(value, Array):
            data = value.data if isinstance(value.data, Leaf) else None
            if data is None:
                given.append(f"ptr {self.place(value.data)}")
            lengths = (self._apart(each, given) for each in value.lengths)
            return ("array", value.dtype, data, value.local, value.constant, value.spaced, *lengths)
        if isinstance(value, Known):
            return "known", repr(value.value) if value.type else id(value.value), value.type
        return value if isinstance(value, Leaf) else object()  # nothing that another call could have, too

    def finish(self, llvm: str, parameters: list[str], linkage: str, attributes: str) -> None:
        """Add the function to its module."""
        given = ", ".join(["ptr noalias readonly %context", *parameters])
        lines = [*self.entry, "  br label %start", "start:", *_flat(self.body)]
        if self.faulty:
            lines += [
                "failed:",
                f"  ret {llvm}"
                + (" zeroinitializer" if llvm.startswith("{") else " undef") * (llvm != "void"),
            ]
        head = f"define {linkage} {llvm} @{self.name}({given}) {attributes} {{\nentry:\n"
        self.module.functions.append(head + "\n".join(lines) + "\n}")


def _flat(lines: list[Any]) -> list[str]:
    found = []
    for each in lines:
        if isinstance(each, list):
            found += each
        else:
            found.append(each)
    return found
