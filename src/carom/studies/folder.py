"""The tasks of a study, and the folder with one file for each result, complete or not there at all.

A task is a dictionary of JSON values that determines every bit of its result. Its key and its random stream
depend only on that content, so that any study finds results again, and new tasks do not change others. Only
the leading process of a study writes result files: workers need no common disk.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import SeedSequence

from carom import checks
from carom.errors import FileError, InputError
from carom.io import records
from carom.paths import sweep, write_text, writing
from carom.studies.result_folders import ResultFolder, check_same, refuse_others

Task = dict[str, Any]
"""The input of a task: strings, numbers, and lists and tables of them."""

Record = dict[str, Any]
"""The output of a task: ``task``, ``result`` (bit-identical on every machine) and ``provenance``."""

SETTINGS = "study.json"
"""File with the settings and the grid of a study."""

RESULTS = "tasks"
"""Folder of the result files."""

_RESULT = re.compile(r"[0-9a-f]{20}\.(json|h5)")


def json_of(value: Any, name: str) -> Any:
    """Return a value as a file gives it back: numbers of NumPy as those of Python, and lists for tuples.

    Raises
    ------
    InputError
        If no file can hold it; ``name`` is what to call it.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if type(value) in (int, float) and abs(value) <= sys.float_info.max:
        return value
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputError(f"{name} has the key {key!r}, and keys in a file are texts; give a text.")
        return {str(key): json_of(each, f"{name}[{key!r}]") for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_of(each, f"{name}[{k}]") for k, each in enumerate(value)]
    if value is None or isinstance(value, bool | str):
        return json.loads(canonical(value))
    raise InputError(  # also of an integer with more digits than Python reads
        f"{name} is {checks.describe(value)}, and a file holds finite numbers, texts, True, False, None, "
        "lists and dictionaries; give one of these."
    )


def canonical(value: Any) -> str:
    """Return a value as JSON text; equal values have equal texts."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=True)


def _sha256(value: Any) -> bytes:
    return hashlib.sha256(canonical(value).encode("ascii")).digest()


def key(task: Task) -> str:
    """Return the name of a task: 20 hexadecimal digits of the SHA-256 of its content."""
    return _sha256(task).hex()[:20]


def stream(seed: int, identity: Any) -> SeedSequence:
    """Return the source of randomness that belongs to a seed and an identity (any JSON value)."""
    digest = _sha256(identity)
    words = tuple(int.from_bytes(digest[k : k + 4], "little") for k in range(0, 32, 4))
    return SeedSequence(seed, spawn_key=words)


class Folder(ResultFolder):
    """The folder with the settings of a study and the results of its tasks; :meth:`begun` makes it."""

    kind = "a study"
    files = (SETTINGS, "study.toml", "report.html", "plan.json", "outcome.json")
    """Files that commands write into the folder of any study."""

    def __init__(self, path: Path):
        super().__init__(path)
        self.settings = path / SETTINGS

    def result(self, task: Task) -> Path:
        """Return the result file of a task."""
        return self.path / RESULTS / f"{key(task)}.json"

    def check(self, settings: dict[str, Any]) -> None:
        """Refuse a folder with a study of other ``settings``, which all tasks share; change nothing."""
        refuse_others(self.path, self.kind, "a plan")
        if (before := self.read()) is not None:
            check_same(self.path, self.kind, before["settings"], settings)

    def check_study(self, study: str) -> None:
        """Refuse a folder that holds other results, or a study of another kind; no file is changed."""
        refuse_others(self.path, self.kind)
        if (before := self.read()) is not None:
            check_same(self.path, self.kind, {"study": before["settings"].get("study")}, {"study": study})

    @contextlib.contextmanager
    def begun(
        self, settings: dict[str, Any], grid: dict[str, Any], files: Iterable[str] = ()
    ) -> Iterator[None]:
        """Make the folder, keep other processes out while the body runs, and note what is asked for.

        ``grid`` holds the parameters that differ between tasks, and may differ from those of an earlier
        session; ``files`` are those that this study alone writes.
        """
        self.check(settings)
        with self.owned(*files):
            self.check(settings)
            with writing(self.path):
                (self.path / RESULTS).mkdir(exist_ok=True)
                sweep(self.path / RESULTS, _RESULT.fullmatch)
            self._write(self.settings, {"settings": settings, "grid": grid})
            yield

    def read(self) -> dict[str, Any] | None:
        """Return settings and grid of the study that the folder holds; None if there is none."""
        if self.path.exists() and not self.path.is_dir():
            raise FileError(f"{self.path} is a file; expected the folder of a study, or a new one.")
        if not os.path.lexists(self.settings):
            return None
        return dict(
            records.read_json(self.settings, _SETTINGS, "the description of a study", "choose another folder")
        )

    def held(self) -> dict[str, Any]:
        """Return settings and grid of the study that the folder holds."""
        if found := self.read():
            return found
        raise FileError(f"{self.path} holds no study ({SETTINGS} is missing); name another folder.")

    def study(self) -> str:
        """Return the study that the folder holds, by what its settings say that it is."""
        return str(self.held()["settings"].get("study"))

    def done(self) -> int:
        """Return how many results there are."""
        return len(list((self.path / RESULTS).glob("[!.]*.json")))

    def load(self, task: Task) -> Record | None:
        """Return the stored result of a task; None if there is none, or its file is damaged."""
        try:
            record: Record = records.read_json(
                self.result(task), unsealed, "the result of a run", "run it again"
            )
        except FileError:
            return None
        return record if record["task"] == task else None

    def store(self, record: Record) -> None:
        """Write the result of a task, atomically."""
        path = self.result(record["task"])
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        self._write(path, sealed(record))

    def kept(self, task: Task) -> Path:
        """Return the file where a long task keeps its state until it is done."""
        return self.result(task).with_suffix(".h5")

    def forget(self, task: Task) -> None:
        """Remove the state that a long task kept on its way."""
        with writing(self.path):
            self.kept(task).unlink(missing_ok=True)

    @staticmethod
    def _write(path: Path, value: Any) -> None:
        write_text(path, json.dumps(value, indent=1, allow_nan=False) + "\n")


_TABLE = records.mapping(records.anything)
_SETTINGS = records.table({"settings": _TABLE, "grid": _TABLE})
_RECORD = records.table({"task": _TABLE, "result": _TABLE, "provenance": _TABLE, "digest": records.text})


def sealed(record: Record) -> Record:
    """Return a record as a file holds it: with its digest."""
    return {**record, "digest": _sha256(record).hex()}


def unsealed(value: Any, name: str) -> Record:
    """Return the record that a file holds, or raise InputError if it is none, or was changed."""
    record: Record = _RECORD(value, name)
    digest = record.pop("digest")
    if digest != _sha256(record).hex():
        raise InputError(f"{name} has not the content that its digest is of.")
    return record
