"""Folders of results: one holds one kind of results, and files of the user stay as they are."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.version import __version__

OWN: dict[str, tuple[str, ...]] = {
    "a run": ("checkpoint.h5", "trajectory.h5md", "trajectory.extxyz", "trajectory.gsd", "events.h5"),
    "a packing": ("compression.h5", "packing.h5md", "packing.extxyz"),
    "a plan": ("plan.json", "outcome.json"),
    "a study": ("study.json",),
}
"""Files by which a folder tells what it holds."""

TABLES = {
    "rdf": "r_lo",
    "structure": "k,S",
    "msd": "time,mean_square",
    "order": "r_lo,r_hi,correlation",
    "profile": "x_lo",
    "crystal": "time,solid",
}
"""Tables of quantities of frames, NAME.csv, and by what the first of their columns begin."""

MARK = "# Written by Carom"
"""Beginning of the first line of a TOML file that Carom wrote."""

_LONGEST_HEAD = 1 << 16
"""Bytes within which the table in a file begins."""

_TEXT = re.compile(rb'"(?:\\.|[^"\\])*"')


def is_table(folder: Path, name: str) -> bool:
    """Return whether the table of a quantity, a name in TABLES, lies in a folder, and Carom wrote it."""
    try:
        with (folder / f"{name}.csv").open("rb") as file:
            lines = file.read(_LONGEST_HEAD).splitlines()
    except OSError:
        return False
    head = next((line for line in lines if not line.startswith(b"#")), b"")
    return head.startswith(TABLES[name].encode())


def title(command: str) -> str:
    """Return the first line of a TOML file that Carom writes, for ``command``."""
    return f"{MARK} {__version__}; `{command}` with this file repeats it."


def kind_of(folder: Path) -> str | None:
    """Return what a folder holds, a name in OWN; None if none of their files is there.

    The study of a plan lies in the folder of the plan.
    """
    found = [kind for kind, names in OWN.items() if any(os.path.lexists(folder / name) for name in names)]
    return found[0] if found else None


def refuse_others(folder: Path, kind: str, *beside: str) -> None:
    """Refuse a folder that holds other results than those of a ``kind`` or ``beside``, names in OWN.

    No file is changed, and the folder need not exist.
    """
    for other, names in OWN.items():
        found = [name for name in names if os.path.lexists(folder / name)]
        if found and other not in (kind, *beside):
            raise FileError(
                f"{folder} holds {other} already ({found[0]}), and {kind} needs a folder of its own; choose "
                "another one with --out."
            )


def differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return in words what is asked for now and was not before; nothing where it is the same."""
    names = [name for name in sorted({*before, *now}) if before.get(name) != now.get(name)]
    if "study" in names:  # of which all else is different
        names = ["study"]
    return ", ".join(f"{k} was {_told(before.get(k))} and is {_told(now.get(k))} now" for k in names)


def _told(value: Any) -> str:
    """Return a value as a sentence has it, in at most 60 letters."""
    text = "left out" if value is None else json.dumps(value, sort_keys=True, skipkeys=True, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def check_same(folder: Path, kind: str, before: Mapping[str, Any], now: Mapping[str, Any]) -> None:
    """Refuse a folder whose results of a ``kind`` are of other settings than what is asked for now."""
    if found := differences(before, now):
        raise FileError(
            f"{folder} holds the results of another {kind.removeprefix('a ')}: {found}. "
            "Take the old values, or another folder."
        )


def refuse_to_replace(paths: Iterable[Path], kind: str) -> None:
    """Refuse files that are in a new folder of results already, although no results are."""
    for path in paths:
        if os.path.lexists(path):
            raise FileError(
                f"{path} exists already and is not of {kind} there; choose another folder with --out."
            )


def of_the_user(path: Path) -> bool:
    """Return whether somebody wrote or annotated a TOML file: Carom writes no comment but the first line."""
    try:
        first, *lines = path.read_bytes().splitlines() or [b""]
    except OSError:
        return os.path.lexists(path)
    return not first.startswith(MARK.encode()) or any(b"#" in _TEXT.sub(b"", line) for line in lines)
