"""Declared values: frozen dataclasses whose fields say, once, how they are checked and what they are.

A field is an :func:`option`, or, where several classes share it, has its check and its :class:`Opt` in its
annotation::

    replicas: int = option(integer(low=1), "Independent runs of each point.", default=2)
    Replicas = Annotated[int, integer(low=1), Opt("Independent runs of each point.")]

The check gets a value and the name of the field, and returns the value as it is used, or raises InputError.
From the declaration follow the constructor's checks, the docstring, options of commands, keys of files and
their JSON schema. Nothing slow is imported here before a value is checked: the help of a command reads it.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Any, ClassVar, TypeVar, Union, get_args, get_origin, get_type_hints

from carom.errors import InputError

Check = Callable[[Any, str], Any]


@dataclass(frozen=True)
class Opt:
    """How a field is set."""

    help: str  # in files, on the command line, in the docstring of the function
    panel: str = ""  # heading in the help of the command
    flags: tuple[str, ...] | None = ()  # by default the field's name; None: files and arguments only
    read: Callable[[Any], Any] | None = None
    """The value from the text of the option; from all its texts if ``many``."""
    many: bool = False  # whether it may be repeated


def needed(check: Check | None, *how: Any, **more: Any) -> Any:
    """Return a field that must be given, with its check and what :class:`Opt` is told."""
    return dataclasses.field(metadata={"marks": (check, Opt(*how, **more))})


def option(check: Check | None, *how: Any, default: Any = None, factory: Any = None, **more: Any) -> Any:
    """Return a field with a default, or what makes one, with its check and what :class:`Opt` is told."""
    given: dict[str, Any] = {"default": default} if factory is None else {"default_factory": factory}
    return dataclasses.field(**given, metadata={"marks": (check, Opt(*how, **more))})


@dataclass(frozen=True)
class Declared:
    """Base of declared values.

    Raises
    ------
    InputError
        If a value is refused by its check; a field that is None is not checked.
    """

    before: ClassVar[str] = ""
    """What stands before the name of a field in an error."""
    after: ClassVar[str] = ""
    """What stands behind it."""

    def __post_init__(self) -> None:
        for name, field in fields_of(type(self)).items():
            value = getattr(self, name)
            if value is None and field.default is not dataclasses.MISSING:  # as if it were left out
                self._put(name, value := field.default)
            if field.check is not None and (value is not None or field.needed):
                self._put(name, field.check(value, self.before + name + self.after))
        self.complete()

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def complete(self) -> None:
        """Check what concerns several fields, and set those whose default depends on others."""


@dataclass(frozen=True)
class SpecField:
    """A field of a specification: its name, type, check and option, and whether it has no default."""

    name: str
    kind: Any
    default: Any
    check: Check | None
    opt: Opt | None

    @property
    def needed(self) -> bool:
        """Whether a value must be given."""
        return self.default is dataclasses.MISSING

    @property
    def is_option(self) -> bool:
        """Whether an option of the command sets it."""
        return self.opt is not None and self.opt.flags is not None

    def of_option(self, value: Any) -> Any:
        """Return the value of the option, of which some are texts that a field reads in its own way."""
        return value if self.opt is None or self.opt.read is None else self.opt.read(value)


S = TypeVar("S", bound=Declared)


def described(kind: type[S]) -> type[S]:
    """Add the fields to the docstring of a class of specifications, as its parameters."""
    lines, fields = ["Parameters", "----------"], fields_of(kind)
    for name in inspect.signature(kind).parameters:
        opt = fields[name].opt
        assert opt is not None
        lines += [f"{name} : {_words(fields[name].kind)}", f"    {opt.help}"]
    head, mark, rest = inspect.cleandoc(kind.__doc__ or "").partition("Raises\n")
    kind.__doc__ = "\n".join([head + lines[0], *lines[1:], "", mark + rest])
    return kind


def _words(hint: Any) -> str:
    """Return a type as docstrings have it."""
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    names = [
        f"{_words(get_args(kind)[0])}s" if get_origin(kind) is tuple else getattr(kind, "__name__", "value")
        for kind in kinds
    ]
    words = ["value" if name == "Any" else name for name in names if name != "NoneType"]
    return " or ".join(words) + (", optional" if "NoneType" in names or hint is Any else "")


def checked(kind: type[Declared], name: str, value: Any) -> Any:
    """Return a value as a field of a specification has it."""
    check = fields_of(kind)[name].check
    return value if check is None else check(value, kind.before + name + kind.after)


def of_options(kind: type[Declared], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the fields that options set, of all that are ``given``."""
    fields = fields_of(kind)
    return {k: fields[k].of_option(v) for k, v in given.items() if k in fields and v not in (None, [])}


_FIELDS: dict[type, dict[str, SpecField]] = {}


def fields_of(kind: type) -> dict[str, SpecField]:
    """Return the fields of a class of specifications by name."""
    if kind in _FIELDS:
        return _FIELDS[kind]
    try:
        hints = get_type_hints(kind, include_extras=True)
    except NameError:  # of a class of the user's, which names what is known within a function alone
        hints = get_type_hints(kind.__base__, include_extras=True)
    found = {}
    for field in dataclasses.fields(kind):
        hint = hints.get(field.name, Any)
        marks = (*getattr(hint, "__metadata__", ()), *field.metadata.get("marks", ()))
        check = next((mark for mark in marks if callable(mark)), None)
        opt = next((mark for mark in marks if isinstance(mark, Opt)), None)
        default = field.default
        if field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        found[field.name] = SpecField(
            field.name, get_args(hint)[0] if hasattr(hint, "__metadata__") else hint, default, check, opt
        )
    _FIELDS[kind] = found
    return found


def said(check: Check, **schema: Any) -> Check:
    """Return a check that says, in the words of JSON schemas, which values it accepts."""
    check.schema = schema  # type: ignore[attr-defined]
    return check


def schema_of(check: Check | None) -> dict[str, Any]:
    """Return what a check says about the values that it accepts; nothing where it says nothing."""
    found = getattr(check, "schema", {})
    return dict(found() if callable(found) else found)


def schema_of_several(one: Check) -> dict[str, Any]:
    """Return the schema of one value that a check accepts, or of a list of them."""
    return {"anyOf": [schema_of(one), {"type": "array", "items": schema_of(one), "minItems": 1}]}


def schema_of_table(kind: type[Declared], named: str | None = None) -> dict[str, Any]:
    """Return the JSON schema of a table with the fields of a declared value, and its type where ``named``."""
    fields = {name: field for name, field in fields_of(kind).items() if field.check is not None}
    properties: dict[str, Any] = {} if named is None else {"type": {"const": named}}
    for name, field in fields.items():
        told = {"description": field.opt.help.replace("`", "")} if field.opt is not None else {}
        properties[name] = {**schema_of(field.check), **told}
    needed = ["type"] * (named is not None) + [name for name, field in fields.items() if field.needed]
    return {"type": "object", "properties": properties, "required": needed, "additionalProperties": False}


def _bounds(limits: Mapping[str, Any]) -> dict[str, Any]:
    """Return limits of a number in the words of JSON schemas."""
    lowest = "exclusiveMinimum" if limits.get("open_low") else "minimum"
    return {word: limits[name] for name, word in (("low", lowest), ("high", "maximum")) if name in limits}


def number(**limits: Any) -> Check:
    """Return the check of a number; see :func:`carom.checks.number`."""

    def test(value: Any, name: str) -> float:
        from carom import checks

        return checks.number(value, name, **limits)

    return said(test, type="number", **_bounds(limits))


def integer(**limits: Any) -> Check:
    """Return the check of an integer; see :func:`carom.checks.integer`."""

    def test(value: Any, name: str) -> int:
        from carom import checks

        return checks.integer(value, name, **limits)

    return said(test, type="integer", **_bounds(limits))


SEED = integer(low=0, high=2**63 - 1)  # the check of a seed


def positive(value: Any, name: str) -> float:
    """Check a length, a mass or a time; see :func:`carom.checks.positive`."""
    from carom import checks

    return checks.positive(value, name)


said(positive, type="number", exclusiveMinimum=0)


def word(*known: str) -> Check:
    """Return the check of a word that is one of those known."""

    def test(value: Any, name: str) -> str:
        from carom import checks, suggestions

        if isinstance(value, str) and value in known:
            return value
        hint = suggestions.suggestion(value, known, listed=True) if isinstance(value, str) else ""
        raise InputError(f"{name} must be one of {', '.join(known)}; found {checks.describe(value)}{hint}.")

    return said(test, enum=list(known))


def switch(value: Any, name: str) -> bool:
    """Check true or false."""
    from carom import checks

    if not isinstance(value, bool):
        raise InputError(f"{name} must be true or false, found {checks.describe(value)}.")
    return value


said(switch, type="boolean")


def several(one: Check) -> Check:
    """Return the check of one value or of several different ones, which are sorted."""

    def test(value: Any, name: str) -> tuple[Any, ...]:
        listed = isinstance(value, Iterable) and not isinstance(value, str | Mapping)
        many = list(value) if listed else [value]
        found = [one(each.item() if hasattr(each, "item") else each, name) for each in many]
        if not found:
            raise InputError(f"{name} must hold at least one value, found none.")
        if len(set(found)) < len(found):
            raise InputError(f"{name} names a value twice; replicas= repeats a point.")
        return tuple(sorted(found))

    return said(test, **schema_of_several(one))
