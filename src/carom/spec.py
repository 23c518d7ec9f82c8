"""What is asked for: a declared value that is also a section of a file, options and arguments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, Self

from carom.declared import Declared, fields_of
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


@dataclass(frozen=True)
class Spec(Declared):
    """Base of specifications: declared values that are sections of a file, options and arguments."""

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
    gone: ClassVar[Mapping[str, str]] = {}
    """Words that are no fields, and what to write instead."""
    grid: ClassVar[tuple[str, ...]] = ()
    """Fields that say which tasks there are; the others are settings that all tasks share."""
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = ()
    """Groups of fields of which one that is given takes the place of the others."""
    resets: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Fields whose new value makes others meaningless."""

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
        from carom import suggestions

        known = [name for name in fields_of(cls) if name not in cls.tables]
        for name in words:
            if name not in known:
                hint = suggestions.suggestion(name, known, gone=cls.gone)
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
    from carom import checks, suggestions
    from carom.io.records import toml_tables

    if len(content) > LARGEST_FILE:
        raise InputError(f"A scene file has at most {LARGEST_FILE} characters, found {len(content)}.")
    try:
        found = toml_tables(content)
    except InputError as problem:
        expected = "expected a scene file (see `carom init`), or frames with the suffix of a format"
        raise InputError(f"{str(problem).rstrip('.')}; {expected}.") from None
    known = dict.fromkeys((*SECTIONS, *own))
    for name, table in found.items():
        if name in known and not isinstance(table, dict):
            raise InputError(f"[{name}] must be a section, found {checks.describe(table)}.")
        if name not in known and not isinstance(table, dict):
            raise InputError(
                f"{shown(name)} stands outside of any section; write it below one, such as [{own[0]}]."
            )
        if name not in known:
            hint = f"; {GONE[name]}" if name in GONE else suggestions.suggestion(name, known)
            raise InputError(f"[{shown(name)}] is no known section{hint}.")
    if found and not {*own} & {*found}:
        wanted = " or ".join(f"[{name}]" for name in own)
        raise InputError(f"[{next(iter(found))}] is for another command; this one reads {wanted}.")
    return {name: found[name] for name in own if name in found}


def shown(name: str) -> str:
    """Return a name for a message: short and printable."""
    short = name if len(name) <= 40 else name[:37] + "..."
    return short if short.isprintable() and short else repr(short)


MOST_POINTS = 10_000  # largest number of values from first to last


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
    """Return what reads a repeatable option such as COUNT:DIAMETER: a table by the words of its form."""
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
