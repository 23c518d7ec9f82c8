"""The text of a module of LLVM: functions, what they declare, and how they may fail."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.compiling.faults import Untranslatable
from carom.compiling.language import BOOL, NUMBERS, Type

_KEPT: list[Any] = []  # what holds the code of functions that Numba has compiled


CALL = """
def call(fault, {names}):
    try:
        return kind(function({names}))
    except Exception:
        carray(fault, 1)[0] = number
        return kind(0)
"""
"""What C calls: an error of Numba's would be printed, and forgotten."""


def _compiled_by_numba(function: Any, kinds: tuple[Type, ...], number: int) -> tuple[Any, Type]:
    """Return a function compiled by Numba as one that C can call, and the type of its result."""
    import numba

    def named(kind: Type) -> Any:
        return getattr(numba, "boolean" if kind is BOOL else kind.name)

    given = tuple(map(named, kinds))
    try:
        function.compile(given)
        result = str(numba.types.unliteral(function.overloads[given].signature.return_type))
        kind = {"bool": BOOL}.get(result) or {each.name: each for each in NUMBERS}.get(result)
        if kind is None:
            raise Untranslatable(f"{function.__name__} gives {result}, expected a number")
        scope = {"function": function, "kind": named(kind), "number": number, "carray": numba.carray}
        exec(CALL.format(names=", ".join(f"x{k}" for k in range(len(kinds)))), scope)
        pointer = numba.types.CPointer(numba.int64)
        return numba.cfunc(named(kind)(pointer, *given))(scope["call"]), kind
    except numba.NumbaError as error:
        raise Untranslatable(f"Numba cannot compile {function.__name__}") from error


class Module:
    """What is translated for one entry point."""

    def __init__(self, size: int, checked: bool = False):
        self.size = size  # words of the context
        self.checked = checked  # whether indices are looked at
        self.functions: list[str] = []
        self.declared: dict[str, str] = {}
        self.cold: dict[Any, Any] = {}  # functions that are called, by what they depend on
        self.faults: list[str] = []  # what went wrong, by number less one
        self.foreign: list[tuple[Any, int, Any]] = []  # functions compiled by Numba, addresses, and results
        self.reached: dict[Any, None] = {}  # functions of the user's
        self.arrays: dict[int, tuple[str, np.ndarray]] = {}

    def declare(self, name: str, text: str) -> None:
        """Declare a function from outside."""
        self.declared[name] = text

    def constant(self, values: np.ndarray, llvm: str) -> str:
        """Return the name of an array that is known while compiling."""
        known = self.arrays.get(id(values))
        if known is None:
            name = f"@a{len(self.arrays)}"
            octets = "".join(f"\\{each:02X}" for each in np.ascontiguousarray(values).tobytes())
            size = len(octets) // 3
            self.declared[name] = f'{name} = private constant [{size} x i8] c"{octets}", align 64'
            known = self.arrays[id(values)] = name, values
        return known[0]

    def foreign_function(self, function: Any, kinds: tuple[Type, ...]) -> tuple[int, Type]:
        """Return the word with the address of a function compiled by Numba, and the type of its result."""
        for k, (key, _, result) in enumerate(self.foreign):
            if key == (function, kinds):
                return self.size + k, result
        number = self.fault(
            f"RuntimeError: {function.__name__}, which Numba has compiled, has raised an error"
        )
        compiled, result = _compiled_by_numba(function, kinds, number)
        self.foreign.append(((function, kinds), compiled.address, result))
        _KEPT.append(compiled)
        return self.size + len(self.foreign) - 1, result

    def fault(self, words: str) -> int:
        """Return the number of a way to fail."""
        if words not in self.faults:
            self.faults.append(words)
        return self.faults.index(words) + 1

    def text(self) -> str:
        """Return the module's text."""
        return "\n".join([*self.declared.values(), *self.functions, "!0 = !{}", ""])
