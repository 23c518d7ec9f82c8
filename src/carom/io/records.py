"""Files of text that Carom reads: JSON that it wrote, and TOML that people write.

They come from a disk, an editor or another program. So a file is decoded here and nowhere else, and whatever
is wrong with it is one sentence. Of JSON every field that is used has a check, made of the functions below.
"""

from __future__ import annotations

import json
import math
import numbers
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from carom import checks
from carom.declared import Check, number as number, switch as switch
from carom.errors import FileError, InputError
from carom.paths import reason

LARGEST = 2**26
"""Largest size of a JSON file [bytes]; the records of a study are the largest ones."""

DEEPEST = 40  # levels of tables and lists in a file


def read_text(path: Path, what: str, largest: int) -> str:
    """Return the text of a file up to ``largest`` [bytes]; ``what`` was expected is for the message."""
    try:
        if not path.is_file():
            missing = "is not a file" if path.exists() else "does not exist"
            raise FileError(f"{path} {missing}; expected {what}.")
        with path.open("rb") as file:
            data = file.read(largest + 1)
    except FileError:
        raise
    except (OSError, ValueError) as error:
        raise FileError(f"{path} cannot be read: {reason(error)}.") from None
    if len(data) > largest:
        raise FileError(f"{path} has more than {largest} bytes; expected {what}.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"{path} is not text in UTF-8 (byte {error.start}); expected {what}.") from None


def toml_tables(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text."""
    # Imported here, because many commands read no TOML.
    import tomllib

    try:
        found = tomllib.loads(text)
        _refuse_depth(found)
    except RecursionError:
        raise InputError("This is no valid TOML: its values are nested too deeply.") from None
    except ValueError as error:
        point = re.search(r"= *\[? *(\.\d+)", text)
        hint = f"; a number begins with a digit: 0{point[1]}" if point else ""
        raise InputError(f"This is no valid TOML: {str(error).rstrip('.')}{hint}.") from None
    return found


def toml_value(value: Any) -> str:
    """Return a value as TOML in one line; items of tables that are None are left out."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        if any("\ud800" <= c <= "\udfff" for c in value):
            raise InputError(f"No TOML file can hold {checks.describe(value)}: it is no text in Unicode.")
        # Unlike JSON, TOML has escapes of eight digits and no pairs of surrogates.
        escaped = "".join(
            "\\" + c if c in '"\\' else c if c.isprintable() else f"\\U{ord(c):08X}" for c in value
        )
        return f'"{escaped}"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(toml_lines(value)) + " }"
    return repr(int(value) if isinstance(value, numbers.Integral) else float(value))


def toml_lines(table: Mapping[str, Any]) -> list[str]:
    """Return the items of a table as lines of TOML, without those that are None."""
    return [f"{toml_key(key)} = {toml_value(value)}" for key, value in table.items() if value is not None]


def toml_key(key: str) -> str:
    """Return a key as TOML has it: in quotes where it has other characters than plain keys."""
    return key if key.isascii() and key.replace("-", "_").isidentifier() else toml_value(key)


def read_json(path: Path, check: Check, what: str, remedy: str) -> Any:
    """Return the content of a JSON file, checked; the message is ``path is not what (...); remedy.``"""
    try:
        return check(parsed(read_text(path, what, LARGEST)), "its content")
    except FileError as error:
        raise FileError(f"{str(error).rstrip('.')}; {remedy}.") from None
    except (ValueError, RecursionError) as error:
        raise FileError(f"{path} is not {what} ({reason(error)}); {remedy}.") from None


def parsed(text: str) -> Any:
    """Return the value of a JSON text; raise ValueError or RecursionError where it is none."""
    found = json.loads(text, parse_constant=_finite, parse_float=_finite)
    _refuse_depth(found)
    return found


def _finite(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"the number {word[:20]} is not finite")
    return value


def _refuse_depth(value: Any) -> None:
    """Raise ValueError for values that are nested too deeply, and for text that no file can hold."""
    level, depth = [value], 0
    while level:
        depth += 1
        if depth > DEEPEST:
            raise ValueError("its values are nested too deeply")
        below: list[Any] = []
        for each in level:
            if isinstance(each, Mapping):
                below += [*each, *each.values()]
            elif isinstance(each, list):
                below += each
            elif isinstance(each, str):
                each.encode("utf-8")
        level = below


def integer(*, low: int = 0, high: int = 2**63 - 1) -> Check:
    """Return the check of an integer."""
    return lambda value, name: checks.integer(value, name, low=low, high=high)


def text(value: Any, name: str) -> str:
    """Check a text."""
    if not isinstance(value, str):
        raise InputError(f"{name} must be text, found {checks.describe(value)}.")
    return value


def anything(value: Any, name: str) -> Any:
    """Accept any value: of a field that another part of the program checks."""
    return value


def optional(check: Check) -> Check:
    """Return the check of a value that may be null."""
    return lambda value, name: None if value is None else check(value, name)


def listed(check: Check, *, length: int | None = None) -> Check:
    """Return the check of a list, of all its items, and of its length if that is given."""

    def checked(value: Any, name: str) -> list[Any]:
        if not isinstance(value, list) or length not in (None, len(value)):
            wanted = "a list" if length is None else f"a list of {length}"
            raise InputError(f"{name} must be {wanted}, found {checks.describe(value)}.")
        return [check(each, f"{name}[{k}]") for k, each in enumerate(value)]

    return checked


def mapping(check: Check) -> Check:
    """Return the check of a table with any keys, and of all its values."""

    def checked(value: Any, name: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise InputError(f"{name} must be a table, found {checks.describe(value)}.")
        return {key: check(each, f"{name}.{key[:40]}") for key, each in value.items()}

    return checked


def table(fields: Mapping[str, Check], *, later: Mapping[str, Check] | None = None) -> Check:
    """Return the check of a table; other fields are kept, ``later`` ones may be missing in old files."""

    def checked(value: Any, name: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise InputError(f"{name} must be a table, found {checks.describe(value)}.")
        for key in fields:
            if key not in value:
                raise InputError(f"{name} has no {key}.")
        every = {**fields, **(later or {})}
        return {key: every[key](each, key) if key in every else each for key, each in value.items()}

    return checked
