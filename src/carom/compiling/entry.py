"""Entry points of the engine: compiled for the types of their arguments, once for each in a process."""

from __future__ import annotations

import builtins
import ctypes
import gc
import os
import struct
import sys
import threading
import time
from functools import wraps
from typing import Any

from carom.compiling import registry
from carom.compiling.context import FAULT_WORDS, Flat, symbols
from carom.compiling.faults import Untranslatable, of_models
from carom.compiling.language import (
    FLOAT64,
    INT64,
    OF_CLASS,
    POINTER,
    UINT64,
    Known,
    Leaf,
    Several,
    Type,
)
from carom.errors import CaromError, InputError

DISABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""Whether all runs as plain Python."""

CHECKED = os.environ.get("NUMBA_BOUNDSCHECK", "0") not in ("", "0")
"""Whether an index out of bounds is an error."""

DEEPEST = 20_000
"""Calls of Python within each other while functions are written within each other."""

_spent = 0.0
_alone = threading.RLock()


def running() -> float:
    """Return wall time [s] that does not pass while this process compiles, or loads what it has compiled."""
    return time.perf_counter() - _spent


def entry(function):
    """Compile an entry point of the engine for the types of its arguments, as soon as it is called."""
    if DISABLED:
        return function
    kinds: dict[tuple[Any, ...], Compiled] = {}

    @wraps(function)
    def chosen(*arguments):
        flat = Flat(arguments)
        kind = tuple(flat.kind)
        compiled = kinds.get(kind)
        if compiled is None:
            with _alone:
                if kind not in kinds:
                    kinds[kind] = _made(function, arguments, flat)
            compiled = kinds[kind]
        return compiled(flat.words)

    return chosen


class Compiled:
    """Machine code for arguments of some types."""

    def __init__(
        self, call: Any, form: str, answer: Any, count: int, faults: list[str], foreign: tuple[int, ...]
    ):
        self.call, self.pack = call, struct.Struct(f"={form}").pack
        self.answer, self.faults, self.foreign = answer, faults, foreign
        self.room = ctypes.c_int64 * (FAULT_WORDS + count)

    def __call__(self, words: list[Any]) -> Any:
        """Run it, and return its answer; raise what has failed in it."""
        room = self.room()
        self.call(self.pack(ctypes.addressof(room), *words, *self.foreign))
        if room[0]:
            name, _, told = self.faults[room[0] - 1].partition(": ")
            error = getattr(builtins, name, CaromError)
            raise error(told.format(*room[1:FAULT_WORDS]))
        return _read(self.answer, bytes(room), FAULT_WORDS)[0]


def _read(answer: Any, room: bytes, place: int) -> tuple[Any, int]:
    """Return what an answer is, and the place of the word after it."""
    if isinstance(answer, list):
        parts = []
        for each in answer:
            part, place = _read(each, room, place)
            parts.append(part)
        return tuple(parts), place
    if answer is None:
        return None, place
    (value,) = struct.unpack_from(
        {"bool": "=?", "float64": "=d", "uint64": "=Q"}.get(answer, "=q"), room, 8 * place
    )
    return value, place + 1


def _made(function: Any, arguments: tuple[Any, ...], flat: Flat) -> Compiled:
    """Return an entry point for arguments like these: from disk, or translated and compiled."""
    global _spent
    from carom.compiling import machine, stored

    began, deepest = time.perf_counter(), sys.getrecursionlimit()
    classes = [each for each in flat.kind if isinstance(each, type)]
    collecting = gc.isenabled()
    gc.disable()  # a hundred thousand objects are made, and most stay until the end
    sys.setrecursionlimit(max(deepest, DEEPEST))
    try:
        shelf = stored.Shelf(function, flat.kind, classes, CHECKED)
        with shelf.alone():
            kept = shelf.read()
            if kept is None:
                translated = Translated(function, arguments, f"carom_{shelf.name}")
                code = machine.machine_code(translated.text)
                kept = translated.facts, code
                if not translated.foreign:
                    shelf.write(*kept, translated.reached)
            else:
                translated = None
        facts, code = kept
        call = machine.function_at(machine.address_of(code, f"carom_{shelf.name}"))
    except Untranslatable as error:
        if error.function is None or registry.is_ours(error.function.__globals__.get("__name__")):
            raise
        raise InputError(of_models(error, registry.own_methods(classes))) from error
    finally:
        sys.setrecursionlimit(deepest)
        if collecting:
            gc.enable()
        _spent += time.perf_counter() - began
    foreign = translated.addresses() if translated is not None else ()
    form = "Q" + "".join(flat.form) + "Q" * len(foreign)
    return Compiled(call, form, facts["answer"], facts["count"], facts["faults"], foreign)


class Translated:
    """The text of an entry point, and what its caller must know."""

    def __init__(self, function: Any, arguments: tuple[Any, ...], name: str, checked: bool = CHECKED):
        from carom.compiling import functions  # noqa: F401 (fills the table of functions)
        from carom.compiling.module import Module
        from carom.compiling.statements import Translator

        given, size = symbols(arguments)
        self.module = Module(size, checked)
        writer = Translator(self.module, name)
        writer.stack = []
        result = writer.invoke(function, given, {})
        self.count = 0
        try:
            answer = self._written(writer, writer.get(result)) if not writer.dead else None
        except Untranslatable as error:
            code = function.__code__
            raise error.at(function, code.co_filename, code.co_firstlineno) from None
        if not writer.dead:
            writer.emit("ret void")
        writer.finish("void", [], "dso_local", "nounwind")
        self.text = self.module.text()
        self.facts = {"answer": answer, "count": self.count, "faults": self.module.faults}
        self.foreign, self.reached = self.module.foreign, list(self.module.reached)

    def _written(self, writer: Any, value: Any) -> Any:
        """Write the answer to the caller's room, and return how it is read."""
        if isinstance(value, Several):
            return [self._written(writer, writer.get(each)) for each in value.items]
        if isinstance(value, Known) and value.value is None:
            return None
        value = writer.number(value)
        kind: Type = FLOAT64 if value.type.is_float else value.type if value.type is UINT64 else INT64
        fault = writer.leaf(Leaf(0, POINTER))
        place = writer.op(f"getelementptr i64, ptr {fault}, i64 {FAULT_WORDS + self.count}")
        writer.store(kind, value, place)
        self.count += 1
        return "bool" if value.type is OF_CLASS[bool] else kind.name

    def addresses(self) -> tuple[int, ...]:
        """Return the addresses of functions that Numba has compiled."""
        return tuple(address for _, address, _ in self.foreign)
