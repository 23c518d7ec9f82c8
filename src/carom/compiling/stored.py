"""Machine code kept on disk, and used again only where nothing that it was made of has changed.

A file has the SHA-256 of what follows it, a line of facts, and the code. Its name follows from the types of
the arguments, the processor, the versions of Python and LLVM, the sources of this package, and all that is
read of the user's models. What cannot be followed is compiled in every process.
"""

from __future__ import annotations

import contextlib
import enum
import hashlib
import json
import os
import re
import sys
import types
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import filelock
import llvmlite
import numpy as np

from carom.compiling import machine, registry

CHECKED = hashlib.sha256().digest_size
"""Bytes at the beginning of a file: the SHA-256 of the others."""

PATIENCE = 600.0
"""Seconds for which a process waits for another that compiles the same. The lock of one that is killed ends
with it; nobody waits longer for one that is stopped, or whose drive keeps its lock."""

ROOMS = ("compiling", "engine", "geometry", "models", "observables")
"""Rooms of this package of whose functions compiled code may be made, wherever its entry point is."""

KNOWN_BY_VERSION = sys.stdlib_module_names | {"numpy", "numba", "llvmlite", "scipy"}


class Unknown(Exception):
    """Something that compiled code may be made of, and that cannot be followed."""


def digest(*words: Any) -> str:
    """Return a short name that follows from words."""
    return hashlib.sha256(repr(words).encode()).hexdigest()[:32]


@cache
def sources(*more: str) -> str:
    """Return the SHA-256 of the sources of these rooms, and of ``more``."""
    found = hashlib.sha256()
    package = Path(__file__).parents[1]
    for room in (*ROOMS, *more):
        for path in sorted((*package.glob(f"{room}.py"), *(package / room).rglob("*.py"))):
            found.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()


def sources_of(function: Any) -> str:
    """Return the same; the room of a function of this package is one of them."""
    room = function.__module__.split(".")[1] if registry.is_ours(function.__module__) else ROOMS[0]
    return sources(*{room}.difference(ROOMS))


def folders() -> list[Path]:
    """Return where code may be kept, the best place first."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given:
        return [Path(given) / "carom"]
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or Path.home() / ".cache"
    return [Path(__file__).parents[1] / "__pycache__" / "compiled", Path(home) / "carom"]


class Shelf:
    """The place of one entry point for arguments of some types."""

    def __init__(self, function: Any, kind: list[Any], classes: list[type], checked: bool):
        said = [
            f"{each.__module__}.{each.__qualname__}" if isinstance(each, type) else str(each) for each in kind
        ]
        self.entry = re.sub(r"\W", "", function.__name__, flags=re.ASCII)  # a lambda's has brackets
        versions = (sys.version_info[:3], llvmlite.__version__, machine.processor(), checked)
        self.kind = digest(function.__module__, said, versions)
        self.walk: Walk | None = Walk()
        origins = sources_of(function)
        try:
            if not registry.is_ours(function.__module__):
                self.walk.visit(function)
            self.walk.visit_classes(classes)
            origins += self.walk.found.hexdigest()
        except (Unknown, RecursionError):
            self.walk = None
        self.name = f"{self.entry}_{digest(self.kind, origins, self.walk is None and id(self))}"
        self.file = f"{self.entry}-{self.kind}.{digest(origins)}.o"

    def read(self) -> tuple[dict[str, Any], bytes] | None:
        """Return the facts and the code; None where there are none, or none that are whole."""
        for folder in folders() if self.walk else ():
            with contextlib.suppress(OSError, ValueError, KeyError):  # not there, or damaged: compiled again
                content = (folder / self.file).read_bytes()
                if hashlib.sha256(content[CHECKED:]).digest() == content[:CHECKED]:
                    facts, _, code = content[CHECKED:].partition(b"\n")
                    return json.loads(facts), code
        return None

    def write(self, facts: dict[str, Any], code: bytes, reached: list[Any]) -> None:
        """Keep code, in the place of what was compiled of other sources."""
        if self.walk is None or any(each not in self.walk.functions for each in reached):
            return
        content = json.dumps(facts).encode() + b"\n" + code
        for folder in folders():
            with contextlib.suppress(OSError):  # read-only, or full: that is no reason to stop
                folder.mkdir(parents=True, exist_ok=True)
                made = folder / f"{self.file}.{os.getpid()}"
                try:
                    made.write_bytes(hashlib.sha256(content).digest() + content)
                    made.replace(folder / self.file)
                finally:
                    made.unlink(missing_ok=True)
                for old in folder.glob(f"{self.entry}-{self.kind}.*.o"):
                    if old.name != self.file:
                        old.unlink(missing_ok=True)
                return

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Let one process at a time compile this; the others find it on disk then."""
        lock = None
        for folder in folders() if self.walk else ():
            if (folder / self.file).exists():
                break
            with contextlib.suppress(
                OSError, NotImplementedError
            ):  # nothing can be written, or no locks there
                folder.mkdir(parents=True, exist_ok=True)
                lock = filelock.FileLock(folder / f"{self.entry}-{self.kind}.lock", thread_local=False)
                lock.acquire(PATIENCE)  # a Timeout is an OSError
                break
        try:
            yield
        finally:
            if lock is not None:
                lock.release()


class Walk:
    """Follows what is read of the user's functions and classes, each thing once."""

    def __init__(self) -> None:
        self.found = hashlib.sha256()
        self.functions: dict[Any, None] = {}

    def add(self, *words: Any) -> None:
        """Add words to the digest."""
        self.found.update(repr(words).encode())

    def visit_classes(self, classes: list[type]) -> None:
        """Note the classes of models that are not Carom's, and all methods that are not Carom's."""
        for cls in dict.fromkeys(classes):
            self.visit_class(cls)
            self.add(getattr(cls, "lanes", ()))
            for base in cls.__mro__[:-1]:
                for name, method in vars(base).items():
                    if _may_be_called(name, method) and not _is_by_name(method):
                        self.add(name, base.__qualname__)
                        self.visit_method(method)

    def visit(self, value: Any) -> None:
        """Note anything that compiled code may read."""
        if isinstance(value, enum.Enum):
            value = value.value
        if value is None or isinstance(
            value, bool | int | float | complex | str | bytes | np.generic | np.dtype
        ):
            self.add(type(value).__name__, value)
        elif isinstance(value, tuple | list):
            self.add(type(value).__qualname__, len(value))
            for each in value:
                self.visit(each)
        elif isinstance(value, dict | types.MappingProxyType):
            for key, each in value.items():
                self.add(key)
                self.visit(each)
        elif isinstance(value, np.ndarray) and not value.dtype.hasobject:
            self.add(value.dtype.descr, value.shape, value.tobytes())
        elif isinstance(value, types.FunctionType):
            self.visit_function(value)
        elif isinstance(value, types.ModuleType | types.BuiltinFunctionType | np.ufunc):
            self.add(value.__name__)
        elif isinstance(value, type):
            self.visit_class(value)
        else:
            raise Unknown(value)

    def visit_class(self, cls: type) -> None:
        """Note a class that a function names."""
        self.add(cls.__module__, cls.__qualname__)
        if not _known(cls.__module__):
            if issubclass(cls, enum.Enum):
                self.visit({each.name: each.value for each in cls})
            elif issubclass(cls, tuple):
                self.add(getattr(cls, "_fields", ()))
                self.visit(getattr(cls, "_field_defaults", {}))
                for base in cls.__mro__:
                    self.visit_attributes(vars(base) if not _known(base.__module__) else {})
            elif not issubclass(cls, BaseException):
                raise Unknown(cls)

    def visit_method(self, method: Any) -> None:
        """Note a method of a class; one that cannot be followed is not called."""
        before = {**self.functions}
        try:
            self.visit(method)
        except Unknown:
            self.functions = before

    def visit_attributes(self, attributes: Any) -> None:
        """Note the methods and the constants of a class."""
        for name, value in attributes.items():
            value = getattr(value, "__func__", value)
            if _may_be_called(name, value):
                self.visit_method(value)
            elif not name.startswith("__") and not hasattr(value, "__get__"):  # neither field nor property
                self.add(name)
                self.visit(value)

    def visit_function(self, function: Any) -> None:
        """Note a function, and all that it reads."""
        self.add(function.__qualname__)
        if _is_by_name(function):
            self.add(sources_of(function))
            return
        if function in self.functions:
            return
        self.functions[function] = None
        self.add(registry.FLAGS.get(function))
        self.visit(function.__defaults__)
        for cell in function.__closure__ or ():
            try:
                self.visit(cell.cell_contents)
            except ValueError:
                raise Unknown(function) from None
        self.visit_code(function.__code__, function.__globals__)

    def visit_code(self, code: types.CodeType, scope: dict[str, Any]) -> None:
        """Note the code of a function, and what its names stand for."""
        self.add(
            code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_argcount, code.co_flags
        )
        for constant in code.co_consts:
            if not isinstance(constant, types.CodeType | frozenset):
                self.visit(constant)
        for name in code.co_names:
            if name in scope:
                self.visit_parts(scope[name], code.co_names, set())

    def visit_parts(self, value: Any, names: tuple[str, ...], seen: set[str]) -> None:
        """Note a value; of a module what has one of the names, of one that is known numbers and functions."""
        self.visit(value)
        if isinstance(value, types.ModuleType) and value.__name__ not in seen:
            seen.add(value.__name__)
            for part in names:
                found = getattr(value, part, None)
                number = isinstance(found, int | float | np.generic)
                if number or not _known(value.__name__) or _is_by_name(found):
                    self.visit_parts(found, names, seen)


def _may_be_called(name: str, method: Any) -> bool:
    """Tell whether a part of a class is a method that compiled code may call: no private one but a user's."""
    if not isinstance(method, types.FunctionType) or name.startswith("__"):
        return False
    return name[0] != "_" or not _known(method.__globals__.get("__name__"))


def _known(module: str | None) -> bool:
    """Tell whether the code of a module is known by its version, or by this package's sources."""
    return registry.is_ours(module) or (module or "").partition(".")[0] in KNOWN_BY_VERSION


def _is_by_name(function: Any) -> bool:
    """Tell whether a function is known by its name: one of this package that is found under it."""
    scope = getattr(function, "__globals__", {})
    if not _known(scope.get("__name__")):
        return False
    found: Any = sys.modules.get(function.__module__)
    for name in function.__qualname__.split("."):
        found = getattr(found, name, None)
    return getattr(found, "__code__", None) is function.__code__ and function.__closure__ is None
