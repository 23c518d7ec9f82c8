"""A study as a TOML file: ``[study]`` with the fields of :class:`StudySpec`, and ``[scene]`` for the rest."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from carom import checks
from carom.errors import InputError
from carom.io.records import read_text, toml_lines, toml_tables
from carom.studies.eos.spec import StudySpec

S = TypeVar("S", bound=StudySpec)

LARGEST_FILE = 64 * 1024
"""Largest size of a study file [bytes]; a study is about a page."""


def load(path: str | Path, kind: type[S] = StudySpec) -> S:  # type: ignore[assignment]
    """Read a study of the class ``kind`` from a TOML file.

    Raises
    ------
    FileError
        If it is missing, unreadable, too large or not text in UTF-8.
    InputError
        If it is no TOML, or no study; the text begins with the name of the file.
    """
    content = read(path)
    try:
        return parse(content, kind)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read(path: str | Path) -> str:
    """Return the text of a study file.

    Raises
    ------
    FileError
        If it is missing, unreadable, too large or not text in UTF-8.
    """
    return read_text(Path(path), "a study (TOML) of about a page", LARGEST_FILE)


def parse(content: str, kind: type[S] = StudySpec) -> S:  # type: ignore[assignment]
    """Read a study of the class ``kind`` from TOML; missing keys have their defaults.

    Raises
    ------
    InputError
        If it is no TOML, a section or key is unknown, or a value cannot be used.
    """
    tables = toml_tables(content)
    for name, table in tables.items():
        if name not in ("study", "scene"):
            raise InputError(f"[{name}] is no section of a study; those are [study] and [scene].")
        if not isinstance(table, dict):
            raise InputError(f"[{name}] must be a section, found {checks.describe(table)}.")
    known = [f.name for f in dataclasses.fields(kind) if f.name != "scene"]
    words = words_of(tables, "study", known)
    return kind(**words, scene=tables.get("scene", {}))


def words_of(tables: Mapping[str, Any], section: str, known: Sequence[str]) -> dict[str, Any]:
    """Return the keys and values of a section.

    Raises
    ------
    InputError
        If a key is not among the ``known`` ones.
    """
    words = dict(tables.get(section, {}))
    for name in words:
        if name not in known:
            raise InputError(f"[{section}] {name} is no known key{checks.suggestion(name, known)}.")
    return words


def text(spec: StudySpec) -> str:
    """Return a study as TOML from which :func:`parse` makes an equal one."""
    words = spec.words()
    scene = words.pop("scene")
    lines = ["[study]", *toml_lines(words)]
    if scene:
        lines += ["", "[scene]", *toml_lines(scene)]
    return "\n".join(lines) + "\n"
