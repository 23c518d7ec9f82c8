"""The common part of studies with many tasks: their progress and their results."""

from __future__ import annotations

import dataclasses
import os
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from carom.errors import FileError, InputError
from carom.io.records import listed
from carom.studies.arguments import processes
from carom.studies.eos.spec import GRID
from carom.studies.results import Result, plain
from carom.studies.session import Failure, Job
from carom.studies.tasks import SETTINGS, Record, TaskFolder, sealed, unsealed

R = TypeVar("R", bound="Outcome")


@dataclass(frozen=True)
class Progress(Generic[R]):
    """How far a study is.

    Attributes
    ----------
    done, total : int
        Tasks.
    fraction : float
        Finished fraction of the work, in collisions.
    so_far : EquationOfState or Transport
        The results so far.
    """

    done: int
    total: int
    fraction: float
    so_far: R


@dataclass(frozen=True, repr=False)
class Outcome(Result):
    """The results of a study.

    Attributes
    ----------
    spec : value
        The requested study.
    records : list of dict
        Results of the finished runs.
    failures : list of Failure
        Tasks that failed in this session; they run again when the study does.
    folder : Path or None
        Where the results are kept.
    engine : str
        Where this session ran.
    seconds : float
        Wall time of this session.
    """

    spec: Any
    records: list[Record] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    folder: Path | None = None
    engine: str = ""
    seconds: float = 0.0

    @property
    def complete(self) -> bool:
        """Whether every task is done."""
        return len(self.records) == len(self.spec.tasks())

    def to_dict(self) -> dict[str, Any]:
        """Return the study, its table and how much of it is done, as JSON values."""
        return {
            "study": self.spec.words(),
            "table": [plain(row) for row in self.rows()],
            "runs": len(self.records),
            "runs_asked_for": len(self.spec.tasks()),
            "failures": [{"task": each.task, "reason": each.reason} for each in self.failures],
        }

    def _saved(self) -> dict[str, Any]:
        """Return what :func:`of_saved` needs beside the dictionary."""
        return {"records": [sealed(record) for record in self.records]}

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a page (HTML)."""
        raise NotImplementedError

    def _writers(self) -> dict[str, Callable[..., object]]:
        """Return the function that writes a file, by its suffix."""
        return {**super()._writers(), ".html": self.report}

    def _done(self) -> str:
        """Return how much of the study is done, in words."""
        done, tasks = len(self.records), len(self.spec.tasks())
        if done == tasks:
            return f"{done} run{'' if done == 1 else 's'}"
        return f"{done} of {tasks} runs done"


def carry_out(
    nothing_yet: R,
    simulate: Callable[..., Record],
    *,
    executor: Any,
    cores: int | str | None,
    progress: Callable[[Progress[R]], object] | None,
) -> R:
    """Run the tasks of a study that are missing in its folder.

    Parameters
    ----------
    nothing_yet : Outcome
        The study without its results.
    simulate, executor
        As for :class:`carom.studies.session.Job`.
    cores : int, "auto" or None
        Processes or threads.
    progress : callable or None
        Called with a :class:`Progress` at the start and after every task.
    """
    began = clock.perf_counter()
    spec = nothing_yet.spec

    def summary(records: list[Record], failures: list[Failure]) -> R:
        return dataclasses.replace(nothing_yet, records=records, failures=failures)

    def report(done: int, total: int, fraction: float, so_far: R) -> None:
        if progress is not None:
            progress(Progress(done, total, fraction, so_far))

    job = Job(spec.tasks(), simulate, summary, None if progress is None else report)
    grid = {name: spec.words()[name] for name in GRID}
    result, name = job.run(executor, processes(cores), nothing_yet.folder, spec.settings(), grid)
    return dataclasses.replace(result, engine=name, seconds=clock.perf_counter() - began)


def of_saved(words: Mapping[str, Any], kind: Callable[..., Any], result: Callable[..., R]) -> R:
    """Return the results of the class ``result`` that were saved as JSON, of a study of the class ``kind``.

    Raises
    ------
    InputError
        If the words are not those of such a study.
    """
    try:
        return result(kind(**words["study"]), listed(unsealed)(words["records"], "records"))
    except (KeyError, TypeError) as error:
        raise InputError(f"it does not describe a study: {error}") from None


def held(out: str | os.PathLike[str], kind: Callable[..., Any]) -> tuple[Any, list[Record], Path]:
    """Return the study in a folder, the results of its finished runs, and the folder; nothing is run.

    Parameters
    ----------
    out : path
        The folder.
    kind : class
        That of the study: :class:`StudySpec`, or one like it.

    Raises
    ------
    FileError
        If the folder holds no study of this version of Carom.
    """
    folder = TaskFolder(Path(out))
    found = folder.read()
    if found is None:
        raise FileError(f"{folder.path} holds no study ({SETTINGS} is missing); name another folder.")
    words = {k: v for k, v in found["settings"].items() if k not in ("study", "version")}
    try:
        spec = kind(**{**words, **found["grid"]})
    except TypeError as error:
        raise FileError(f"{folder.settings} does not describe a study: {error}.") from None
    folder.check(spec.settings())
    records = [record for task in spec.tasks() if (record := folder.load(task)) is not None]
    return spec, records, folder.path
