"""What compiled code is made of, as a digest: the functions of the kernel, and all that those read.

Calls and constants are followed through all modules; this room counts as its files. Of a question the default
and answers of classes that occur count. What cannot be followed has no digest: its code is not kept.
"""

from __future__ import annotations

import dis
import enum
import hashlib
import sys
import types as python
from collections import deque
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
from numba import types

from carom.compiling.numba_parts import Dispatcher

FACES: set = set()
"""Functions that are generic in the type of a model (``registry.required``, ``registry.optional``)."""

INLINED: dict = {}
"""The options of the functions that are compiled as they stand (``registry.inner`` and the like)."""

TRUSTED = frozenset(sys.stdlib_module_names) | {"numba", "numpy", "llvmlite"}
"""Packages whose code is known by their versions."""

PACKAGE = __name__.rpartition(".")[0]  # this package, whose code is known by its files

FOREIGN_TO_ALL = ("__main__", "__mp_main__")  # modules that no other process finds under that name

_VALUES = (bool, int, float, complex, str, bytes, np.generic, np.dtype, type(None), type(...), slice)
_PLAIN = (types.Number, types.Boolean, types.NoneType, types.Array, types.UnicodeType, types.Literal)


class Unknown(Exception):
    """Something that Numba may compile, and that cannot be followed from here."""


def class_of(model):
    """Return the Python class that stands for a Numba type in the registry, or None."""
    if isinstance(model, types.NoneType):
        return type(None)
    if isinstance(model, types.Array):
        return np.ndarray
    return getattr(model, "instance_class", None)


def classes_in(kinds) -> Iterator[type]:
    """Yield the classes of models within types of arguments."""
    for kind in kinds:
        cls = class_of(kind)
        if cls is not None:
            yield cls
        if isinstance(kind, types.BaseTuple):
            yield from classes_in(kind)
        elif not isinstance(kind, _PLAIN):
            raise Unknown(kind)


def digest_of(function, kinds) -> str | None:
    """Return the SHA-256 of all that a function is compiled of for these types, or None if unknown."""
    try:
        return Walk(function, kinds).digest.hexdigest()
    except (Unknown, RecursionError):
        return None


@lru_cache(maxsize=1)
def room_digest() -> str:
    """Return the SHA-256 of the sources of this package."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def is_trusted(module: str | None) -> bool:
    """Tell whether the code of a module is known without following it."""
    name = module or ""
    return name.partition(".")[0] in TRUSTED or name.startswith(f"{PACKAGE}.")


def _importable(cls) -> bool:
    """Tell whether another process finds this class under its name."""
    if cls.__module__ in FOREIGN_TO_ALL:
        return False
    found = sys.modules.get(cls.__module__)
    for name in cls.__qualname__.split("."):
        found = getattr(found, name, None)
    return found is cls


class Walk:
    """Follows what a function is made of for arguments of some types, each thing once."""

    def __init__(self, function, kinds):
        self.digest = hashlib.sha256(room_digest().encode())
        self.functions, self.classes, self.generics, self.seen = {}, {}, {}, set()
        self.waiting: deque = deque()
        self.visit(function)
        for cls in (type(None), np.ndarray, *classes_in(kinds)):  # the first two occur everywhere
            self.visit_class(cls)
        while self.waiting:
            self.visit_body(self.waiting.popleft())

    def add(self, *words):
        """Add words to the digest."""
        self.digest.update(repr(words).encode())

    def visit_body(self, function):
        """Note what a function reads: its code, and what is bound to it."""
        self.add("body", self.functions[function])
        self.visit_code(function.__code__, function.__globals__)
        self.visit(function.__defaults__)
        self.visit(tuple((function.__kwdefaults__ or {}).items()))
        for cell in function.__closure__ or ():
            try:
                inside = cell.cell_contents
            except ValueError:
                raise Unknown(function) from None
            self.visit(inside)

    def visit(self, value):
        """Note anything that compiled code reads."""
        if isinstance(value, _VALUES):
            self.add(type(value).__name__, value)
        elif isinstance(value, type):
            self.visit_class(value)
        elif isinstance(value, python.FunctionType):
            if value in FACES:
                self.visit_generic(value)
                return
            if value not in INLINED and not is_trusted(value.__globals__.get("__name__")):
                raise Unknown(value)  # compiled by somebody's rule, which is not in its code
            self.add(sorted(INLINED.get(value, {}).get("fastmath", ())))
            self.visit_function(value)
        elif isinstance(value, Dispatcher):
            self.visit(tuple(sorted(value.targetoptions.items())))
            self.visit_function(value.py_func)
        elif isinstance(value, (tuple, list)):
            self.add("sequence", len(value))
            self.visit_class(type(value))
            for each in value:
                self.visit(each)
        elif isinstance(value, (set, frozenset)):
            self.add("set", sorted(map(repr, value)))
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self.add("array", value.dtype.descr, value.shape, value.tobytes())
        elif isinstance(value, enum.Enum):
            self.add(value.name)
            self.visit_class(type(value))
        elif isinstance(value, types.Type) and is_trusted(type(value).__module__):
            self.add(value.name)
        elif isinstance(value, (python.BuiltinFunctionType, np.ufunc)):
            self.add(value.__name__)
        else:
            raise Unknown(value)

    def visit_class(self, cls):
        """Note a class, and the functions registered for it."""
        self.add("class", cls.__module__, cls.__qualname__)
        if cls in self.classes:
            return
        self.classes[cls] = None
        # NoneType is in no module, and is what a scene holds of all that it lacks.
        if cls is not type(None) and not (is_trusted(cls.__module__) and _importable(cls)):
            if issubclass(cls, tuple) and hasattr(cls, "_fields"):
                if not _importable(cls):
                    raise Unknown(cls)
                self.add(cls._fields, getattr(cls, "lanes", ()))
                self.visit(tuple(cls._field_defaults.items()))
            elif issubclass(cls, enum.Enum):
                self.visit(tuple((each.name, each.value) for each in cls))
            elif not issubclass(cls, BaseException):
                raise Unknown(cls)
        for generic in self.generics:
            self.visit_answers(generic, cls)

    def visit_generic(self, generic):
        """Note a generic function, and what is registered for the classes that occur, in an order of its own.

        Other classes and the order of registration depend on which modules a process has imported.
        """
        self.add("generic", generic.__module__, generic.__qualname__)
        if generic not in self.generics:
            self.generics[generic] = None
            self.visit_function(generic.registry[object])
            for cls in self.classes:
                self.visit_answers(generic, cls)

    def visit_answers(self, generic, cls):
        """Note what a class may be answered: what is registered for it and for its bases."""
        bases = [base for base in generic.registry if base is not object and issubclass(cls, base)]
        for base in sorted(bases, key=lambda base: (base.__module__, base.__qualname__)):
            self.add("answer", generic.__qualname__, cls.__qualname__)
            self.visit_function(generic.registry[base])

    def visit_function(self, function):
        """Note a function, to be followed."""
        module = function.__globals__.get("__name__")
        self.add("function", module, function.__qualname__)
        if not is_trusted(module):
            if function not in self.functions:
                self.functions[function] = len(self.functions)
                self.waiting.append(function)
            self.add(self.functions[function])  # many have one name

    def visit_code(self, code, scope):
        """Note the code of a function, and of those within."""
        self.add(code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        self.add(code.co_argcount, code.co_kwonlyargcount, code.co_flags)
        for constant in code.co_consts:
            if isinstance(constant, python.CodeType):
                self.visit_code(constant, scope)
            else:
                self.visit(constant)
        for name in code.co_names:  # those of attributes, too: to tell them apart takes ten times as long
            if name in scope:
                self.add(name)
                try:
                    if isinstance(scope[name], python.ModuleType):
                        self.visit_module(scope[name], code)
                    else:
                        self.visit(scope[name])
                except Unknown:
                    if name in _globals_of(code):
                        raise

    def visit_module(self, module, code):
        """Note what code may read of a module: all that has one of the names in it."""
        self.add("module", module.__name__)
        if is_trusted(module.__name__) or (module, code) in self.seen:
            return
        self.seen.add((module, code))
        for name in (*code.co_names, *(text for text in code.co_consts if isinstance(text, str))):
            value = getattr(module, name, None)
            if isinstance(value, python.ModuleType):
                self.visit_module(value, code)
            elif value is not None:
                self.add(name)
                self.visit(value)


def _globals_of(code) -> set[str]:
    return {step.argval for step in dis.get_instructions(code) if step.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
