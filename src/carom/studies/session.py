"""One session of a study: missing tasks run on the chosen engine, and every result is kept."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Generic, TypeVar

from carom.errors import CaromWarning, FileError
from carom.studies import executors
from carom.studies.runs.folder import owned
from carom.studies.signals import Interrupted, stoppable
from carom.studies.tasks import Record, Task, TaskFolder, key

R = TypeVar("R")


@dataclass(frozen=True)
class Failure:
    """A task that failed.

    Attributes
    ----------
    task : dict
    reason : str
        The reason, in one clause.
    """

    task: dict[str, Any]
    reason: str


def cost(task: Task) -> float:
    """Return the work of a task [collisions]."""
    length = task["equilibration"] + task["collisions_per_particle"]
    return 0.5 * float(length) * int(task["scene"]["n"])


class Job(Generic[R]):
    """The tasks of a study, and the function that summarises their records.

    Parameters
    ----------
    tasks : list of dict
        See :mod:`carom.studies.tasks`; each with ``scene``, ``equilibration`` and
        ``collisions_per_particle``.
    simulate : callable
        Returns the record of a task. It is a function of a module, which workers can import, with an optional
        argument ``stop``.
    summary : callable
        Returns the result of the study for finished records and failures.
    report : callable, optional
        Called at the start and after every finished task with the number of finished tasks, of all tasks, the
        finished fraction of the work, and the result so far.
    """

    def __init__(
        self,
        tasks: list[Task],
        simulate: Callable[..., Record],
        summary: Callable[[list[Record], list[Failure]], R],
        report: Callable[[int, int, float, R], object] | None = None,
    ):
        self.tasks, self.simulate, self.summary, self.report = tasks, simulate, summary, report
        self.folder: TaskFolder | None = None
        self.records: dict[str, Record] = {}
        self.missing: list[Task] = tasks
        self.failures: list[Failure] = []
        self.unwritten: list[Record] = []
        self.problem = ""

    def run(
        self,
        executor: Any,
        workers: int | None,
        out: str | PathLike[str] | None,
        settings: dict[str, Any],
        grid: dict[str, Any],
    ) -> tuple[R, str]:
        """Run the missing tasks, and return the result and the name of the engine.

        Parameters
        ----------
        executor, workers
            As for :func:`carom.studies.executors.engine`.
        out : path or None
            Folder of the results.
        settings, grid : dict
            Settings that all tasks share, and parameters that differ between tasks.
        """
        if out is None:
            return self._run(executor, workers)
        folder = TaskFolder(Path(out))
        # These checks come before any file is made.
        executors.check(executor, workers)
        folder.check(settings)
        folder.make()
        with owned(folder.path):
            folder.begin(settings, grid)
            self.folder = folder
            stored = [folder.load(task) for task in self.tasks]
            self.records = {
                key(task): record
                for task, record in zip(self.tasks, stored, strict=True)
                if record is not None
            }
            self.missing = [task for task in self.tasks if key(task) not in self.records]
            return self._run(executor, workers)

    def _run(self, executor: Any, workers: int | None) -> tuple[R, str]:
        name = ""
        with stoppable() as stop:
            self._report()
            ended = True
            if self.missing:
                stop.deferred = True
                with executors.engine(executor, workers) as where:
                    name = where.name
                    function = self.simulate
                    if where.local:
                        function = functools.partial(self.simulate, stop=lambda: stop.asked)
                    ended = executors.run(
                        function,
                        self.missing,
                        where,
                        done=self._done,
                        failed=self._failed,
                        stop=lambda: stop.asked,
                    )
                    if not ended:
                        where.close(now=True)
                stop.deferred = False
            self._write_again()
            if not ended:
                raise Interrupted(self._farewell())
        self._warn()
        return self._so_far(), name

    def _done(self, index: int, record: Record) -> None:
        self.records[key(self.missing[index])] = record
        if self.folder is not None:
            try:
                self.folder.store(record)
            except FileError as error:
                # The result stays in memory; at the end a full disk may have room again.
                self.unwritten.append(record)
                self.problem = str(error)
        self._report()

    def _failed(self, index: int, error: BaseException) -> None:
        self.failures.append(Failure(self.missing[index], executors.reason(error)))

    def _write_again(self) -> None:
        """Try again to write the results that could not be written."""
        assert self.folder is not None or not self.unwritten
        for record in [*self.unwritten]:
            try:
                self.folder.store(record)  # type: ignore[union-attr]
            except FileError as error:
                self.problem = str(error)
            else:
                self.unwritten.remove(record)

    def _so_far(self) -> R:
        records = [self.records[key(task)] for task in self.tasks if key(task) in self.records]
        return self.summary(records, [*self.failures])

    def _report(self) -> None:
        if self.report is None:
            return
        total = sum(map(cost, self.tasks)) or 1.0
        done = sum(cost(task) for task in self.tasks if key(task) in self.records)
        self.report(len(self.records), len(self.tasks), done / total, self._so_far())

    def _farewell(self) -> str:
        """Return the message of an interrupted study."""
        count = f"{len(self.records)} of {len(self.tasks)} runs are done"
        if self.folder is None:
            return f"Stopped; {count}, and lost, because no folder was given to keep them."
        return f"Stopped; {count}, and the same command goes on with the study in {self.folder.path}."

    def _warn(self) -> None:
        if self.failures:
            first = self.failures[0]
            eta, n = first.task["scene"]["packing_fraction"], first.task["scene"]["n"]
            warnings.warn(
                f"{len(self.failures)} of {len(self.tasks)} runs failed, the first one at packing fraction "
                f"{eta:g} with n = {n}: {first.reason}. The rest is done; run the study again to try these.",
                CaromWarning,
                stacklevel=6,
            )
        if self.unwritten:
            warnings.warn(
                f"{len(self.unwritten)} results could not be kept: {self.problem} "
                "They are in the table now; run the study again to have them on the disk.",
                CaromWarning,
                stacklevel=6,
            )
