"""A study as a value: what is asked for, and what is known so far. To run it is to know more.

A study is a :class:`~carom.spec.Spec`, which makes tasks; a function ``measure``, which turns a task into a
result, anywhere; and a table, figures and a page of the results. The folder, Ctrl-C and resume, progress,
files, and where tasks run, are common, and here.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import os
import platform
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

import numpy as np

from carom import checks
from carom.errors import FileError, InputError, warn
from carom.io.records import listed
from carom.notebook import watchable
from carom.observables.statistics import unwarned
from carom.paths import write_text
from carom.results import Result, plain
from carom.spec import Spec
from carom.studies import executors
from carom.studies.folder import SETTINGS, Folder, Record, Task, json_of, key, sealed, unsealed
from carom.studies.job import Look
from carom.studies.signals import Interrupted, stoppable
from carom.table import Table
from carom.texts import label
from carom.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

S = TypeVar("S", bound=Spec)

REGISTERED: dict[str, type[Study[Any]]] = {}
"""The studies that were imported, by what their folders say that they are: those of one's own as well."""


@dataclass(frozen=True)
class Failure:
    """A task that failed in this session, and the reason in one clause."""

    task: Task
    reason: str


@dataclass(frozen=True, repr=False)
class Study(Result, Generic[S]):
    """What is asked for, and what is known so far; ``EquationOfState`` says what the fields are."""

    spec: S
    records: tuple[Record, ...] = ()
    failures: tuple[Failure, ...] = ()
    folder: Path | None = None
    engine: str = ""
    seconds: float = 0.0

    _numbers_above: ClassVar[bool] = False

    # What each study says.

    Spec: ClassVar[type[Any]]
    name: ClassVar[str]
    """The command, and the stem of its files."""
    axes: ClassVar[tuple[str, ...]] = ()
    """Columns of the picture: x, y with an error in ``y_error``, and perhaps one that names the curves."""
    unit: ClassVar[str] = "runs"
    """What tasks are called on the screen."""
    anytime: ClassVar[bool] = False
    """Whether what is known after Ctrl-C is a result of its own, which the command prints and writes."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "Spec" in vars(cls):
            REGISTERED[cls.Spec.study] = cls

    @staticmethod
    def measure(task: Task, look: Look) -> dict[str, Any]:
        """Return the result of a task, as JSON values; what is not reproducible is under ``timings``.

        That of a :class:`~carom.studies.job.Job` goes on where it was.
        """
        raise NotImplementedError

    @staticmethod
    def cost(task: Task) -> float:
        """Return the work of a task, in any unit."""
        return 1.0

    @property
    def first(self) -> str:
        """What is said before the first task is done: what one is, and perhaps what it costs."""
        return f"the first {self.unit}"

    def enough(self, records: Sequence[Record]) -> int | None:
        """Return how many of the first records make all further tasks needless; None if all are needed.

        Parameters
        ----------
        records : sequence of dict
            Results of the first tasks, in their order and without a gap: what is enough must not depend on
            which of the tasks that run at the same time ends first.
        """
        return None

    def place(self, task: Task) -> str:
        """Return where a task is, in words: ``at packing fraction 0.1 with n = 108``."""
        return "at " + ", ".join(f"{name} {task[name]}" for name in self.spec.grid if name in task)

    @property
    def title(self) -> str:
        """What was studied."""
        return f"{self.spec.study[0].upper()}{self.spec.study[1:]}"

    @property
    def table(self) -> Table:
        """The results."""
        raise NotImplementedError

    def tables(self) -> list[Table]:
        """Return what is shown: the results, and perhaps other tables; nothing of a study without a table."""
        return [self.table] if type(self).table is not Study.table else []

    def printed(self) -> list[Table]:
        """Return the tables that the command prints: what is read first. The others are in the files."""
        return self.tables()

    def sentences(self) -> list[str]:
        """Return what is said below the table and at the top of the page."""
        return []

    def parts(self) -> Iterator[tuple[str, Table | Figure]]:
        """Yield headings and tables or figures of the page, after the table of the results."""
        if (figure := self.picture()) is not None:
            yield "Results", figure

    def _lines(self) -> Sequence[str]:
        """Return what is printed: the tables, and what the command says below them."""
        return [f"{self.title}: {self._done()}", *map(str, self.printed()), *self.sentences()]

    def picture(self) -> Figure | None:
        """Return y of the table against x, with error bars; None where there is nothing to draw."""
        from carom.figures import style

        if not self.axes or not self.table:
            return None
        x, y, *by = self.axes
        figure, axes = style.sheet(5.0, 3.6)
        heads = {name: column.head for name, column in self.table.columns()}
        for curve in dict.fromkeys(getattr(row, by[0]) for row in self.table) if by else (None,):
            rows = [row for row in self.table if curve is None or getattr(row, by[0]) == curve]
            bars = [getattr(row, f"{y}_error", 0.0) for row in rows]
            points = [getattr(row, x) for row in rows], [getattr(row, y) for row in rows]
            axes.errorbar(
                *points, bars, fmt="o-", ms=4, lw=0.8,
                label=None if curve is None else f"{label(heads.get(by[0], by[0]))} {label(curve)}",
            )  # fmt: skip
        axes.set_xlabel(label(heads.get(x, x)))
        axes.set_ylabel(label(heads.get(y, y)))
        if by:
            axes.legend(frameon=False)
        style.lay_out(figure, axes)
        return figure

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure:
        """Draw the results, and save the picture to ``path``.

        Raises
        ------
        InputError
            If there is nothing to draw: no result that is done, or no ``axes`` of the study.
        FileError
            If the picture cannot be saved.
        """
        from carom.figures import style

        if (figure := self.picture()) is None:
            raise InputError("There is nothing to draw yet: no result that is done, or no axes of the study.")
        return style.saved(figure, path)

    def more(self) -> dict[str, Any]:
        """Return further results by name, for files and ``--json``."""
        return {}

    def files(self) -> dict[str, Callable[[Path], object]]:
        """Return what writes the files of the folder besides the page, by name; pictures end with .png."""
        return {f"{self.name}.csv": self.save, f"{self.name}.png": self._draw}

    def _draw(self, path: Path) -> None:
        """Save the picture, if there is anything to draw."""
        from carom.figures import style

        if (figure := self.picture()) is not None:
            style.saved(figure, path)

    # What all studies can do.

    @functools.cached_property
    def tasks(self) -> list[Task]:
        """All tasks, finished or not."""
        return [json_of(task, "task") for task in self.spec.tasks()]

    @property
    def command(self) -> str:
        """The command that runs such a study."""
        if type(self).__module__.startswith("carom."):
            return f"carom {self.name}"
        return f"python {Path(sys.argv[0]).name}"

    @functools.cached_property
    def needed(self) -> int:
        """How many of the tasks are needed, from the first on; see :meth:`enough`."""
        count = 0
        for record, task in zip(self.records, self.tasks, strict=False):
            if record["task"] != task:
                break
            count += 1
        found = self.enough(self.records[:count])
        return len(self.tasks) if found is None else found

    @property
    def complete(self) -> bool:
        """Whether every task that is needed is done."""
        return len(self.records) == self.needed

    @property
    def fraction(self) -> float:
        """Finished fraction of the work."""
        total = sum(map(self.cost, self.tasks[: self.needed]))
        return sum(self.cost(record["task"]) for record in self.records) / total if total else 1.0

    @property
    def progress(self) -> str:
        """How far the study is, in words."""
        return f"{len(self.records)} of {len(self.tasks)} {self.unit}"

    @property
    def underway(self) -> str:
        """What is said while the study runs: how far it is, and perhaps the best so far."""
        return self.progress

    def _done(self) -> str:
        """Return how much of the study is done, in words."""
        done = len(self.records)
        if self.complete:
            return f"{done} {self.unit if done != 1 else self.unit.removesuffix('s')}"
        return f"{self.progress} done"

    @classmethod
    def load(cls, out: str | os.PathLike[str], **given: Any) -> Self:
        """Return the finished part of the study in a folder, without running anything.

        Raises
        ------
        FileError
            If the folder holds no such study of this version of Carom.
        """
        folder = Folder(Path(out))
        held = folder.held()
        words = {k: v for k, v in held["settings"].items() if k not in ("study", "version")}
        try:
            spec = cls.Spec.of_words({**words, **held["grid"]})
        except InputError as error:
            raise FileError(
                f"{folder.settings} does not describe a study: {str(error).rstrip('.')}."
            ) from None
        folder.check(spec.settings())
        study = cls(spec, folder=folder.path, **given)
        return study._with({key(t): r for t in study.tasks if (r := folder.load(t)) is not None}, [])

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> Self:
        return cls(cls.Spec.of_words(values["study"]), tuple(listed(unsealed)(values["records"], "records")))

    @watchable("Study")
    def run(
        self,
        *,
        executor: Any = None,
        cores: int | str | None = None,
        out: str | os.PathLike[str] | None = None,
        progress: Callable[[float, str], object] | None = None,
        look: Callable[[Self], object] | None = None,
    ) -> Self:
        """Run the missing tasks, and return the study with their results.

        Parameters
        ----------
        executor : optional
            Where the tasks run: "processes" (default), "threads", "serial", "mpi", the address of a Dask
            scheduler, a Dask Client, or any Executor; see :func:`carom.studies.executors.opened`.
        cores : int or "auto", optional
            Processes or threads; as many as there are cores if left out.
        out : path, optional
            Folder with a file for each task. If the same study left results there, only missing tasks run.
            The grid may differ; all settings must be the same.
        progress : callable, optional
            Called with the finished fraction and a text at the start and after every task; True shows a bar.
        look : callable, optional
            Called at the same times with the study so far.

        Raises
        ------
        InputError
            If the study cannot be run as it is.
        FileError
            If `out` holds another study, is in use, or cannot be written to at the start.
        Interrupted
            After Ctrl-C or SIGTERM; its ``so_far`` is what is known. With `out`, finished tasks are kept.

        Warns
        -----
        CaromWarning
            If tasks failed, or results could not be written. Run again to complete the missing ones.
        """
        began = clock.perf_counter()
        workers = executors.check(executor, cores)
        if self.spec.serial:
            if executor not in (None, "serial") or workers not in (None, 1):
                raise InputError(
                    f"The {self.unit} of this study measure CPU time and run one after the other; leave out "
                    "executor and cores."
                )
            executor = "serial"
        folder = None if out is None else Folder(Path(out))
        words = self.spec.words()
        grid = {name: words[name] for name in self.spec.grid if name in words}
        begun = folder.begun(self.spec.settings(), grid, self.files()) if folder else contextlib.nullcontext()
        with begun, stoppable() as stop:
            session = _Session(self, folder, progress, look)
            session.report()
            name, ended = "", True
            if missing := session.missing:
                stop.deferred = True
                # What still runs when the results are enough is ended, too.
                over = lambda: stop.asked or session.enough  # noqa: E731
                main = getattr(self.measure, "__self__", self.measure).__module__ == "__main__"
                with executors.opened(executor, workers, len(missing), main=main) as place:
                    name = place.name
                    asked = over if place.local else None
                    kept = folder.path.absolute() if folder else None
                    ended = executors.run(
                        functools.partial(perform, self.measure, stop=asked, kept=kept),
                        missing,
                        place,
                        done=session.done,
                        failed=session.failed,
                        stop=lambda: stop.asked,
                        enough=lambda: session.enough,
                    )
                    if not ended or session.enough:
                        place.end(True)
                stop.deferred = False
            session.write_again()
            if not ended:
                raise session.interrupted()
        session.warn()
        return dataclasses.replace(session.so_far(), engine=name, seconds=clock.perf_counter() - began)

    def _with(self, known: dict[str, Record], failures: Sequence[Failure]) -> Self:
        found = tuple(known[key(task)] for task in self.tasks if key(task) in known)
        lost = tuple(sorted(failures, key=lambda failure: self.tasks.index(failure.task)))
        study = dataclasses.replace(self, records=found, failures=lost)
        if study.needed < len(found):  # results that came too late, and depend on the number of workers
            study = dataclasses.replace(study, records=found[: study.needed])
        return dataclasses.replace(study, failures=()) if study.complete else study

    def _columns(self) -> dict[str, Any]:
        return {name: [getattr(row, name) for row in self.table] for name in self.table.names()}

    def _words(self) -> dict[str, Any]:
        """Return the study, its table and how much of it is done."""
        return {
            "study": self.spec.words(),
            "table": plain(self.table.dictionaries()),
            "runs": len(self.records),
            "runs_asked_for": len(self.tasks),
            "failures": [{"task": each.task, "reason": each.reason} for each in self.failures],
            **plain(self.more()),
        }

    def _saved(self) -> dict[str, Any]:
        return {"records": [sealed(record) for record in self.records]}

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a self-contained page (HTML) of tables, pictures and provenance to the file ``path``.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        from carom.studies.report import page

        write_text(Path(path), page(self))

    def _writers(self) -> dict[str, Callable[..., object]]:
        return {**super()._writers(), ".html": self.report}

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.progress} done>"

    def _repr_html_(self) -> str:
        from carom.texts import html

        return self.table.html() + "".join(f"<p>{html(said)}</p>" for said in self.sentences())


def perform(
    measure: Callable[[Task, Look], dict[str, Any]],
    task: Task,
    stop: Callable[[], bool] | None = None,
    kept: Path | None = None,
) -> Record:
    """Run a task of a study's ``measure``, in any process, and return its record.

    It has ``task``; ``result``, whose bits depend on the task alone; and ``provenance``: machine and times.
    """
    began, day = clock.perf_counter(), clock.time()
    if task["version"] != __version__:
        raise InputError(
            f"This worker has Carom {__version__} and the study is of {task['version']}; "
            "install the same version everywhere."
        )
    # The table reports what single runs warn of. Filters belong to the process, and to its main thread.
    main = threading.current_thread() is threading.main_thread()
    # A worker that does not see the folder keeps nothing.
    path = Folder(kept).kept(task) if kept and (kept / SETTINGS).is_file() else None
    with unwarned() if main else contextlib.nullcontext():
        found = measure(task, Look(stop, path))
    if not isinstance(found, Mapping):
        raise InputError(f"measure must return a dictionary, found {checks.describe(found)}")
    result = json_of(found, "result")
    timings = result.pop("timings", {})
    return {
        "task": task,
        "result": result,
        "provenance": {
            "began": day,
            "seconds": clock.perf_counter() - began,
            **timings,
            "host": platform.node(),
            "process": os.getpid(),
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
    }


class _Session:
    """One session of a study: what is known, what failed, and what could not be written."""

    def __init__(self, study: Any, folder: Folder | None, progress: Any, look: Any):
        self.study = dataclasses.replace(study, folder=folder.path if folder else None)
        self.folder, self.progress, self.look = folder, progress, look
        self.known: dict[str, Record] = {key(record["task"]): record for record in study.records}
        if folder is not None:
            for task in study.tasks:
                if record := folder.load(task):
                    self.known[key(task)] = record
                    folder.forget(task)  # a state that a kill left beside the result
        self.keys = [key(task) for task in study.tasks]
        self.enough = self._judged()
        self.failures: list[Failure] = []
        self.unwritten: list[Record] = []
        self.problem = ""

    @property
    def missing(self) -> list[Task]:
        if self.enough:
            return []
        return [
            task for task, name in zip(self.study.tasks, self.keys, strict=True) if name not in self.known
        ]

    def so_far(self) -> Any:
        return self.study._with(self.known, self.failures)

    def _judged(self) -> bool:
        """Return whether the results so far make all further tasks needless."""
        first = itertools.takewhile(self.known.__contains__, self.keys)
        return self.study.enough([self.known[name] for name in first]) is not None

    def done(self, task: Task, record: Record) -> None:
        self.known[key(task)] = record
        self.enough = self._judged()
        self._keep(record)
        self.report()

    def failed(self, task: Task, reason: str) -> None:
        self.failures.append(Failure(task, reason))

    def report(self) -> None:
        if self.progress is None and self.look is None:
            return
        now = self.so_far()
        if self.progress is not None:
            self.progress(now.fraction, now.underway)
        if self.look is not None:
            self.look(now)

    def _keep(self, record: Record) -> None:
        if self.folder is None:
            return
        try:
            self.folder.store(record)
            self.folder.forget(record["task"])
        except FileError as error:
            # The record stays in memory; at the end a full disk may have room again.
            self.unwritten.append(record)
            self.problem = str(error)

    def write_again(self) -> None:
        again, self.unwritten = self.unwritten, []
        for record in again:
            self._keep(record)

    def interrupted(self) -> Interrupted:
        count = f"{len(self.known)} of {len(self.study.tasks)} {self.study.unit} are done"
        if self.folder is None:
            text = f"Stopped; {count}, and lost, because no folder was given to keep them."
        else:
            text = f"Stopped; {count}, and the same command goes on with the study in {self.folder.path}."
        return Interrupted(text, self.so_far())

    def warn(self) -> None:
        if failures := self.so_far().failures:
            first = failures[0]
            warn(
                f"{len(failures)} of {len(self.study.tasks)} {self.study.unit} failed, the first one "
                f"{self.study.place(first.task)}: {first.reason}. The rest is done; run the study again to "
                "try these."
            )
        if self.unwritten:
            warn(
                f"{len(self.unwritten)} results could not be kept: {self.problem} "
                "They are in the table now; run the study again to have them on the disk."
            )
