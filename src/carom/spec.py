"""What is asked for, said once: a frozen value that is also a file, options of a command, and arguments.

A field of a specification is annotated with its check and its :class:`Opt`::

    replicas: Annotated[int, integer(low=1), Opt("Independent runs of each point.")] = 2

The check gets a value and the name of the field, and returns the value as it is used, or raises InputError.

The help of a command reads these fields, so that nothing slow is imported here before a value is checked.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, Self, TypeVar, Union, get_args, get_origin, get_type_hints

from carom.errors import InputError
from carom.version import __version__

LARGEST_FILE = 64 * 1024
"""Largest size of a file [bytes]; one is about a page, and reading a larger one would only cost time."""

SECTIONS = ("scene", "run", "study", "transport", "shear", "plan", "pack", "code", "trade")
"""Sections of a scene file: what there is, and what each command does with it. Each reads its own."""

GONE = {
    "output": 'its keys stand in [run]: write = ["h5md"], event_log and pictures',
    "eos": "carom eos reads [study]",
    "measure": "carom measure has options alone",
    "model": 'a potential stands in [scene]: interaction = { type = "square-well", range = 1.5 }',
}
"""Sections that are none, and what to write instead."""

Check = Callable[[Any, str], Any]


@dataclass(frozen=True)
class Opt:
    """How a field is set.

    Attributes
    ----------
    help : str
        What it is, in a file, on the command line and in the docstring of the function.
    panel : str
        Heading of the option in the help of the command.
    flags : tuple of str or None
        Names of the option, by default that of the field; None if only files and arguments set it.
    read : callable or None
        Returns the value from the text of the option; from all its texts, if it may be repeated.
    many : bool
        Whether it may be repeated.
    """

    help: str
    panel: str = ""
    flags: tuple[str, ...] | None = ()
    read: Callable[[Any], Any] | None = None
    many: bool = False


@dataclass(frozen=True)
class Spec:
    """Base of specifications: frozen dataclasses whose fields have checks.

    Raises
    ------
    InputError
        If a value is refused by its check; a field that is None is not checked.
    """

    study: ClassVar[str] = ""
    """What the folder of a study says that it holds."""
    about: ClassVar[str] = ""
    """Help of the command."""
    argument: ClassVar[str] = "Study file (TOML)."
    """Help of the argument of the command."""
    argument_name: ClassVar[str] = "[STUDY]"
    """The argument in the usage line; without brackets it must be given."""
    or_file: ClassVar[str] = "scene"
    """Field that stands where a file may stand, among the arguments of a function."""
    section: ClassVar[str] = "study"
    """Section of the file for all fields but ``tables``, which have sections of their own."""
    tables: ClassVar[tuple[str, ...]] = ()
    serial: ClassVar[bool] = False
    """Whether tasks run one after the other, because they measure CPU time."""
    within: ClassVar[str] = ""
    """What stands before the name of a field in an error."""
    gone: ClassVar[Mapping[str, str]] = {}
    """Words that are no fields, and what to write instead."""
    grid: ClassVar[tuple[str, ...]] = ()
    """Fields that say which tasks there are; the others are settings that all tasks share."""
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Groups of fields of which one that is given takes the place of the others."""
    resets: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Fields whose new value makes others meaningless."""

    def __post_init__(self) -> None:
        for name, field in fields_of(type(self)).items():
            value = getattr(self, name)
            if value is None and field.default is not dataclasses.MISSING:  # as if it were left out
                self._put(name, value := field.default)
            if value is not None:
                self._put(name, checked(type(self), name, value))
        self.complete()

    def _put(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def complete(self) -> None:
        """Check what concerns several fields, and set those whose default depends on others."""

    def tasks(self) -> list[dict[str, Any]]:
        """Return the tasks: plain values, each of which determines every bit of its result."""
        raise NotImplementedError

    def words(self) -> dict[str, Any]:
        """Return the fields as JSON values, without those that are None."""
        values = {name: getattr(self, name) for name in fields_of(type(self))}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()
            if value is not None
        }

    def settings(self) -> dict[str, Any]:
        """Return what all tasks share: it must be the same for all studies in one folder."""
        shared = {name: value for name, value in self.words().items() if name not in self.grid}
        return {"study": self.study, "version": __version__, **shared}

    def replaced(self, **given: Any) -> Self:
        """Return the specification with some fields replaced; None stands for those not given."""
        given = {name: value for name, value in given.items() if value is not None}
        kept = {name: getattr(self, name) for name in fields_of(type(self))}
        for group in self.rivals:
            if given.keys() & {*group}:
                kept = {name: value for name, value in kept.items() if name not in group}
        for name, others in self.resets.items():
            if given.get(name, kept.get(name)) != kept.get(name):
                kept = {other: value for other, value in kept.items() if other not in others}
        return type(self)(**{**kept, **given})

    @classmethod
    def of_words(cls, words: Mapping[str, Any]) -> Self:
        """Return the specification with JSON values.

        Raises
        ------
        InputError
            If a key is unknown or missing, or a value cannot be used.
        """
        known = fields_of(cls)
        for name in words:
            if name not in known:
                raise InputError(f"it has no key {name!r}")
        return cls(**words)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a TOML file.

        Raises
        ------
        FileError
            If it is missing, unreadable, too large or not text in UTF-8.
        InputError
            If it is no TOML, or a value cannot be used; the text begins with the name of the file.
        """
        content = read(path)
        try:
            return cls.from_toml(content)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def of(cls, source: Any, given: Mapping[str, Any]) -> Self:
        """Return what a command, or the function of the same name, is asked for.

        Parameters
        ----------
        source : path, or the field ``or_file``; optional
            A file, or the folder of results that holds one.
        given : mapping
            Fields, which replace those of the file; None stands for those not given.
        """
        if isinstance(source, str | PathLike):
            return cls.of_argument(file_of(Path(source))).replaced(**given)
        return cls(**given) if source is None else cls(**{**given, cls.or_file: source})

    @classmethod
    def of_argument(cls, path: str | Path) -> Self:
        """Return what the argument of the command names: a file, by default."""
        return cls.load(path)

    @classmethod
    def from_toml(cls, content: str) -> Self:
        """Read a TOML text; missing keys have their defaults, and sections of other commands are skipped.

        Raises
        ------
        InputError
            If it is no TOML, a section or key is unknown, or a value cannot be used. If it has sections, and
            none of them is for this.
        """
        found = sections(content, cls.section, *cls.tables)
        words = found.pop(cls.section, {})
        cls.check_words(words)
        words = cls.of_sections(words, found)
        for name, field in fields_of(cls).items():
            if field.needed and name not in words:
                raise InputError(f"[{cls.section}] must have {name}; found none.")
        return cls(**words)

    @classmethod
    def of_sections(cls, words: dict[str, Any], others: dict[str, Any]) -> dict[str, Any]:
        """Return the fields from the keys of their section and from other sections, ``tables``."""
        return {**words, **others}

    @classmethod
    def check_words(cls, words: Iterable[str]) -> None:
        """Raise InputError for a key that the section does not have."""
        from carom import meant

        known = [name for name in fields_of(cls) if name not in cls.tables]
        for name in words:
            if name not in known:
                hint = f"; {cls.gone[name]}" if name in cls.gone else meant.suggestion(name, known)
                raise InputError(f"[{cls.section}] {shown(name)} is no known key{hint}.")

    def to_toml(self) -> str:
        """Return the specification as TOML, from which :meth:`from_toml` makes an equal one."""
        from carom.io.records import toml_lines

        words = self.words()
        own = {name: words.pop(name) for name in self.tables if name in words}
        lines = [f"[{self.section}]", *toml_lines(words)]
        for name, table in own.items():
            if table:
                lines += ["", f"[{name}]", *toml_lines(table)]
        return "\n".join(lines) + "\n"


S = TypeVar("S", bound=Spec)


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


def described(kind: type[S]) -> type[S]:
    """Add the fields to the docstring of a class of specifications, as its parameters."""
    lines = ["Parameters", "----------"]
    for field in fields_of(kind).values():
        assert field.opt is not None
        lines += [f"{field.name} : {_words(field.kind)}", f"    {field.opt.help}"]
    head, mark, rest = inspect.cleandoc(kind.__doc__ or "").partition("Raises\n")
    kind.__doc__ = "\n".join([head + lines[0], *lines[1:], "", mark + rest])
    return kind


def _words(hint: Any) -> str:
    """Return a type as docstrings have it."""
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    names = ["tuple" if get_origin(kind) is tuple else getattr(kind, "__name__", "value") for kind in kinds]
    words = ["value" if name == "Any" else name for name in names if name != "NoneType"]
    return " or ".join(words) + (", optional" if "NoneType" in names or hint is Any else "")


def checked(kind: type[Spec], name: str, value: Any) -> Any:
    """Return a value as a field of a specification has it."""
    check = fields_of(kind)[name].check
    return value if check is None else check(value, kind.within + name)


def of_options(kind: type[Spec], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the fields that options set, of all that are ``given``."""
    fields = fields_of(kind)
    return {k: fields[k].of_option(v) for k, v in given.items() if k in fields and v not in (None, [])}


_FIELDS: dict[type, dict[str, SpecField]] = {}


def fields_of(kind: type) -> dict[str, SpecField]:
    """Return the fields of a class of specifications by name."""
    if kind in _FIELDS:
        return _FIELDS[kind]
    hints = get_type_hints(kind, include_extras=True)
    found = {}
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        marks = getattr(hint, "__metadata__", ())
        check = next((mark for mark in marks if callable(mark)), None)
        opt = next((mark for mark in marks if isinstance(mark, Opt)), None)
        default = field.default
        if field.default_factory is not dataclasses.MISSING:
            default = field.default_factory()
        found[field.name] = SpecField(field.name, get_args(hint)[0] if marks else hint, default, check, opt)
    _FIELDS[kind] = found
    return found


def file_of(path: Path) -> Path:
    """Return the study file or scene file in the folder of a study or a run; any other path as it is."""
    if not path.is_dir():
        return path
    study = path / "study.toml"
    return study if study.is_file() else path / "scene.toml"


def read(path: str | Path) -> str:
    """Return the text of a scene file."""
    from carom.io.records import read_text

    return read_text(
        Path(path), "a scene file (TOML) of about a page, as `carom init` writes it", LARGEST_FILE
    )


def sections(content: str, *own: str) -> dict[str, dict[str, Any]]:
    """Return the tables of some sections of a TOML text; sections of other commands are skipped."""
    from carom import checks, meant
    from carom.io.records import toml_tables

    if len(content) > LARGEST_FILE:
        raise InputError(f"A scene file has at most {LARGEST_FILE} characters, found {len(content)}.")
    found = toml_tables(content)
    known = dict.fromkeys((*SECTIONS, *own))
    for name, table in found.items():
        if name in known and not isinstance(table, dict):
            raise InputError(f"[{name}] must be a section, found {checks.describe(table)}.")
        if name not in known and not isinstance(table, dict):
            raise InputError(
                f"{shown(name)} stands outside of any section; write it below one, such as [{own[0]}]."
            )
        if name not in known:
            hint = f"; {GONE[name]}" if name in GONE else meant.suggestion(name, known)
            raise InputError(f"[{shown(name)}] is no known section{hint}.")
    if found and not {*own} & {*found}:
        wanted = " or ".join(f"[{name}]" for name in own)
        raise InputError(f"[{next(iter(found))}] is for another command; this one reads {wanted}.")
    return {name: found[name] for name in own if name in found}


def shown(name: str) -> str:
    """Return a name for a message: short and printable."""
    short = name if len(name) <= 40 else name[:37] + "..."
    return short if short.isprintable() and short else repr(short)


def said(check: Check, **schema: Any) -> Check:
    """Return a check that says, in the words of JSON schemas, which values it accepts."""
    check.schema = schema  # type: ignore[attr-defined]
    return check


def schema_of(check: Check | None) -> dict[str, Any]:
    """Return what a check says about the values that it accepts; nothing where it says nothing."""
    return dict(getattr(check, "schema", {}))


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


def word(*known: str) -> Check:
    """Return the check of a word that is one of those known."""

    def test(value: Any, name: str) -> str:
        from carom import checks, meant

        if isinstance(value, str) and value in known:
            return value
        hint = meant.suggestion(value, known, listed=True) if isinstance(value, str) else ""
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

    return said(test, anyOf=[schema_of(one), {"type": "array", "items": schema_of(one), "minItems": 1}])


MOST_POINTS = 10_000
"""Largest number of values from first to last."""


def numbers_of(flag: str) -> Callable[[str], list[float]]:
    """Return what reads the text of an option: numbers with commas, or first:last:count."""

    def read(text: str) -> list[float]:
        try:
            if ":" not in text:
                return [float(part) for part in text.split(",")]
            low, high, count = text.split(":")
            points, first, last = int(count), float(low), float(high)
            if points < 2:
                raise ValueError
        except ValueError:
            raise InputError(
                f"{flag} {text!r} must be numbers with commas (0.1,0.2), or first:last:count (0.1:0.4:7)."
            ) from None
        if points > MOST_POINTS:
            raise InputError(f"The count of {flag} must be at most {MOST_POINTS}, found {points}.")
        # Rounded, so that 0.1:0.4:7 and 0.1,0.15,... are the same study.
        return [float(f"{first + (last - first) * k / (points - 1):.12g}") for k in range(points)]

    return read


def edges_in(text: str) -> list[float]:
    """Return the edges of a box from the text of the option --box: numbers with commas."""
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(f"--box takes edges such as 10,10,10, found {text!r}.") from None


def integers_of(flag: str) -> Callable[[str], list[int]]:
    """Return what reads the text of an option: integers with commas."""

    def read(text: str) -> list[int]:
        try:
            return [int(part) for part in text.split(",")]
        except ValueError:
            raise InputError(f"{flag} {text!r} must be integers with commas, e.g. 500,1000.") from None

    return read


def tables_of(flag: str, *forms: str) -> Callable[[Iterable[str]], list[dict[str, float]]]:
    """Return what reads an option that may be repeated: numbers with colons, in forms such as COUNT:DIAMETER.

    Each is a table whose keys are the words of its form.
    """
    words = {form.count(":"): form.lower().split(":") for form in forms}

    def read(texts: Iterable[str]) -> list[dict[str, float]]:
        try:
            found = []
            for text in texts:
                numbers = [float(part) for part in text.split(":")]
                whole = [int(x) if x.is_integer() else x for x in numbers]
                found.append(dict(zip(words[len(numbers) - 1], whole, strict=True)))
            return found
        except (ValueError, KeyError):
            raise InputError(f"{flag} takes {' or '.join(forms)}, numbers, found '{text}'.") from None

    return read
