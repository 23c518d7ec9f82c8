"""A search for a spherical code as a TOML file: ``[code]`` with the options of ``carom code``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.io.records import toml_tables
from carom.spec import read

WORDS = ("n", "dimension", "seed", "tries", "rate", "hops", "starts", "digits")
"""Keys of ``[code]``."""


def load(path: str | Path) -> dict[str, Any]:
    """Read the keys and values of a search from a TOML file.

    Raises
    ------
    FileError
        If it is missing, unreadable, too large or not text in UTF-8.
    InputError
        If it is no TOML, a section or key is unknown, or n is missing.
    """
    content = read(path)
    try:
        return parse(content)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def parse(content: str) -> dict[str, Any]:
    """Read the keys and values of a search from TOML: see :func:`load`."""
    tables = toml_tables(content)
    for name, table in tables.items():
        if name != "code":
            raise InputError(f"[{name}] is no section of a search for a code; that is [code].")
        if not isinstance(table, dict):
            raise InputError(f"[code] must be a section, found {checks.describe(table)}.")
    words = tables.get("code", {})
    for name in words:
        if name not in WORDS:
            raise InputError(f"[code] {name} is no known key{checks.suggestion(name, WORDS)}.")
    if "n" not in words:
        raise InputError("[code] must have n, the number of points; found none.")
    return words
