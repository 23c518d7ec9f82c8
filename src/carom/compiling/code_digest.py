"""What compiled code is made of, as a digest: the functions of the models, and all that those read.

Carom's own sources have one digest for all (``dispatch.source_digest``). Functions from elsewhere, those of a
model of one's own, are followed here: their code, what they call, the constants that they read, and so on
through any number of modules. What cannot be followed has no digest, and code made of it is not kept.
"""

from __future__ import annotations

import dis
import enum
import hashlib
import sys
import types as python
from collections.abc import Iterator

import numpy as np
from numba import types
from numba.core.dispatcher import Dispatcher

FACES: list = []
"""Functions that are generic in the type of a model (``registry.required``, ``registry.optional``)."""

INLINED: dict = {}
"""The options of the functions that are compiled as they stand (``registry.inner`` and the like)."""

TRUSTED = frozenset(sys.stdlib_module_names) | {"carom", "numba", "numpy", "llvmlite"}
"""Packages whose code is known by their versions."""

FOREIGN_TO_ALL = ("__main__", "__mp_main__")
"""Modules that no other process finds under that name."""

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
    """Yield the classes of models within types of arguments.

    Raises
    ------
    Unknown
        For a type that may hold code of its own.
    """
    for kind in kinds:
        cls = class_of(kind)
        if cls is not None:
            yield cls
        if isinstance(kind, types.BaseTuple):
            yield from classes_in(kind)
        elif not isinstance(kind, _PLAIN):
            raise Unknown(kind)


def digest_of(function, kinds) -> str | None:
    """Return the SHA-256 of all that a function is compiled of for arguments of these types and that is not
    Carom's own, or None if that cannot be known.
    """
    walker = _Walk()
    try:
        walker.visit_function(function)
        for cls in classes_in(kinds):
            walker.visit_class(cls)
    except (Unknown, RecursionError):
        return None
    return walker.digest.hexdigest()


def is_trusted(module: str | None) -> bool:
    """Tell whether the code of a module is known by its version."""
    return (module or "").partition(".")[0] in TRUSTED


def _importable(cls) -> bool:
    """Tell whether another process finds this class under its name."""
    if cls.__module__ in FOREIGN_TO_ALL:
        return False
    found = sys.modules.get(cls.__module__)
    for name in cls.__qualname__.split("."):
        found = getattr(found, name, None)
    return found is cls


class _Walk:
    """Follows what functions are made of, each thing once."""

    def __init__(self):
        self.digest = hashlib.sha256()
        self.seen = set()

    def add(self, *words):
        """Add words to the digest."""
        self.digest.update(repr(words).encode())

    def visit(self, value):
        """Follow anything that compiled code reads."""
        if isinstance(value, _VALUES):
            self.add(type(value).__name__, value)
        elif isinstance(value, type):
            self.visit_class(value)
        elif any(value is face for face in FACES):
            self.visit_generic(value)
        elif isinstance(value, python.FunctionType):
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
        """Follow a class, and the functions registered for it."""
        self.add("class", cls.__module__, cls.__qualname__)
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
        # Not in the order of imports, and without Carom's own: which modules a process has imported must not
        # matter. A resumed run imports others than a new one, and both run the same code.
        for face in sorted(FACES, key=lambda face: (face.__module__, face.__qualname__)):
            function = face.registry.get(cls)
            if function is not None and not is_trusted(function.__globals__.get("__name__")):
                self.add(face.__module__, face.__qualname__)
                self.visit_function(function)

    def visit_generic(self, face):
        """Follow all that is registered for a function of somebody else's that is generic."""
        self.add("generic", face.__module__, face.__qualname__)
        if not is_trusted(face.__module__) and face not in self.seen:
            self.seen.add(face)
            for cls, function in face.registry.items():
                self.visit(cls)
                self.visit_function(function)

    def visit_function(self, function):
        """Follow a function: its code, and what that reads."""
        module = function.__globals__.get("__name__")
        self.add("function", module, function.__qualname__)
        if is_trusted(module) or function in self.seen:
            return
        self.seen.add(function)
        self.visit_code(function.__code__, function.__globals__)
        self.visit(function.__defaults__)
        self.visit(tuple((function.__kwdefaults__ or {}).items()))
        for cell in function.__closure__ or ():
            try:
                inside = cell.cell_contents
            except ValueError:
                raise Unknown(function) from None
            self.visit(inside)

    def visit_code(self, code, scope):
        """Follow the code of a function, and of those within."""
        self.add(code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        self.add(code.co_argcount, code.co_kwonlyargcount, code.co_flags)
        for constant in code.co_consts:
            if isinstance(constant, python.CodeType):
                self.visit_code(constant, scope)
            else:
                self.visit(constant)
        for name in sorted(_globals_of(code)):
            if name in scope:
                self.add(name)
                if isinstance(scope[name], python.ModuleType):
                    self.visit_module(scope[name], code)
                else:
                    self.visit(scope[name])

    def visit_module(self, module, code):
        """Follow what code may read of a module: all that has one of the names in it."""
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
