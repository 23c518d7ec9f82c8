"""The common part of studies with many tasks: their progress and their results."""

from __future__ import annotations

import csv
import dataclasses
import os
import time as clock
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from carom.errors import InputError
from carom.io.paths import replacing, writing
from carom.studies.eos.spec import GRID
from carom.studies.session import Failure, Job
from carom.studies.tasks import Record

R = TypeVar("R", bound="Outcome")

PICTURES = (".png", ".pdf", ".svg")


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
class Outcome:
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

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table."""
        raise NotImplementedError

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Draw the results."""
        raise NotImplementedError

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a page (HTML)."""
        raise NotImplementedError

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the table (.csv), the picture (.png, .pdf, .svg) or the report (.html).

        Raises
        ------
        InputError
            If the suffix is another one; FileError if the file cannot be written.
        """
        suffix = Path(path).suffix.lower()
        writers: dict[str, Callable[..., object]] = {
            ".csv": self.to_csv,
            ".html": self.report,
            **dict.fromkeys(PICTURES, self.plot),
        }
        if suffix not in writers:
            raise InputError(f"{path} has the suffix '{suffix}'; expected one of {', '.join(writers)}.")
        writers[suffix](path)


def carry_out(
    nothing_yet: R,
    simulate: Callable[..., Record],
    *,
    executor: Any,
    workers: int | None,
    progress: Callable[[Progress[R]], object] | None,
) -> R:
    """Run the tasks of a study that are missing in its folder.

    Parameters
    ----------
    nothing_yet : Outcome
        The study without its results.
    simulate, executor, workers
        As for :class:`carom.studies.session.Job`.
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
    result, name = job.run(executor, workers, nothing_yet.folder, spec.settings(), grid)
    return dataclasses.replace(result, engine=name, seconds=clock.perf_counter() - began)


def write_csv(path: str | os.PathLike[str], columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table with the names of the columns as its first line.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    path = Path(path)
    with (
        replacing(path) as temporary,
        writing(path),
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)
