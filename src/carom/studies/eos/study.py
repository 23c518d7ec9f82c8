"""Running a study: what is missing is computed, wherever it is asked to, and everything is kept."""

from __future__ import annotations

import dataclasses
import functools
import time as clock
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from carom.errors import CaromWarning, FileError, InputError
from carom.notebook import watchable
from carom.studies import executors as engines
from carom.studies.eos.result import EquationOfState, Failure
from carom.studies.eos.simulate import simulate
from carom.studies.eos.spec import GRID, StudySpec, cost
from carom.studies.runs.folder import owned
from carom.studies.signals import Interrupted, stoppable
from carom.studies.tasks import SETTINGS, Record, Task, TaskFolder, key
from carom.theory import Equation


@dataclass(frozen=True)
class Progress:
    """How far a study is.

    Attributes
    ----------
    done, total : int
        Tasks.
    fraction : float
        Of the work, in collisions.
    so_far : EquationOfState
        The results so far.
    """

    done: int
    total: int
    fraction: float
    so_far: EquationOfState


def _by_runs(shown: Callable[..., None]) -> Callable[[Progress], object]:
    """Return what shows the runs done."""
    return lambda present: shown(present.fraction, f"{present.done} of {present.total} runs")


@watchable("Study", _by_runs)
def equation_of_state(
    packing_fractions: Iterable[float] | float | None = None,
    *,
    n: int | Iterable[int] | None = None,
    replicas: int | None = None,
    dimension: int | None = None,
    relative_error: float | None = None,
    collisions_per_particle: float | None = None,
    equilibration: float | None = None,
    seed: int | None = None,
    initial: str | None = None,
    scene: Mapping[str, Any] | None = None,
    executor: Any = None,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
    equation: Equation | None = None,
    progress: Callable[[Progress], object] | None = None,
    **settings: Any,
) -> EquationOfState:
    """Measure Z over packing fractions, numbers of particles and replicas.

    Parameters
    ----------
    packing_fractions : float or iterable of float
        Twelve of the fluid if left out.
    n : int or iterable of int
        Numbers of particles; 4000 if left out.
    replicas : int
        Independent runs of each point; 2 if left out.
    dimension : int
        3 if left out.
    relative_error : float
        Of Z at each point; 7e-5 if no length is given.
    collisions_per_particle : float
        Or: length of each run.
    equilibration : float
        Collisions per particle before the measurement; 1000 if left out.
    seed : int
        1 if left out. Each task has a stream of its own, which neither the rest of the study nor the engine
        changes.
    initial : str
        "auto", "random", or the name of a lattice; see :class:`StudySpec`.
    scene : mapping
        Further keys of a scene, as in the section ``[scene]`` of a file.
    executor : optional
        "processes" (default), "threads", "serial", "mpi", the address of a Dask scheduler, a Dask Client, or
        any Executor; see :func:`carom.studies.executors.engine`.
    workers : int, optional
        Processes or threads; as many as cores if left out.
    out : path, optional
        Folder with a result file for each task. If the same study left some there, only what is missing is
        run. The grid may have grown or shrunk, all else must be the same.
    equation : callable, optional
        Equation of state to compare with, and to correct for the finite size by.
    progress : callable, optional
        Called with a :class:`Progress` at the start and after every task; True shows a bar.
    **settings
        Further fields of :class:`StudySpec`: blocks, frames, neighbors.

    Returns
    -------
    EquationOfState

    Raises
    ------
    InputError
        If the study cannot be run as it is; FileError if `out` holds another study, is in use, or cannot be
        written to at the start.
    Interrupted
        After Ctrl-C or SIGTERM; with `out`, what is done is kept.

    Warns
    -----
    CaromWarning
        If tasks failed, or results could not be written. The rest went on; run again to do what is missing.

    Examples
    --------
    >>> from carom.studies import equation_of_state
    >>> study = equation_of_state(
    ...     [0.1, 0.2], n=108, replicas=1, collisions_per_particle=200, equilibration=50, executor="serial"
    ... )
    >>> [row.equilibrated for row in study.table]
    [True, True]
    """
    given = {
        "packing_fractions": packing_fractions,
        "n": n,
        "replicas": replicas,
        "dimension": dimension,
        "relative_error": relative_error,
        "collisions_per_particle": collisions_per_particle,
        "equilibration": equilibration,
        "seed": seed,
        "initial": initial,
        "scene": scene,
        **settings,
    }
    known = {f.name for f in dataclasses.fields(StudySpec)}
    if unknown := given.keys() - known:
        raise InputError(
            f"equation_of_state() takes no {sorted(unknown)[0]}; its fields are {sorted(known)}."
        )
    spec = StudySpec(**{name: value for name, value in given.items() if value is not None})
    return run(spec, executor=executor, workers=workers, out=out, equation=equation, progress=progress)


@watchable("Study", _by_runs)
def run(
    spec: StudySpec,
    *,
    executor: Any = None,
    workers: int | None = None,
    out: str | PathLike[str] | None = None,
    equation: Equation | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> EquationOfState:
    """Run a study that is given as a value; parameters as for :func:`equation_of_state`."""
    began = clock.perf_counter()
    tasks = spec.tasks()
    if out is None:
        session = _Session(spec, tasks, None, equation, progress)
        return session.run(executor, workers, began)
    folder = TaskFolder(Path(out))
    # Before anything is made: the engine may be none, and what stands there another study's.
    engines.check(executor, workers)
    folder.check(spec.settings())
    folder.make()
    with owned(folder.path):
        folder.begin(spec.settings(), {name: spec.words()[name] for name in GRID})
        session = _Session(spec, tasks, folder, equation, progress)
        return session.run(executor, workers, began)


def load(out: str | PathLike[str], equation: Equation | None = None) -> EquationOfState:
    """Return what is done of the study in a folder, without running anything.

    Raises
    ------
    FileError
        If the folder holds no study of this version of Carom.
    """
    folder = TaskFolder(Path(out))
    held = folder.read()
    if held is None:
        raise FileError(f"{folder.path} holds no study ({SETTINGS} is missing); name another folder.")
    words = {k: v for k, v in held["settings"].items() if k not in ("study", "version")}
    try:
        spec = StudySpec(**{**words, **held["grid"]})
    except TypeError as error:
        raise FileError(f"{folder.settings} does not describe a study: {error}.") from None
    folder.check(spec.settings())
    records = [record for task in spec.tasks() if (record := folder.load(task)) is not None]
    return EquationOfState(spec, records, folder=folder.path, equation=equation)


class _Session:
    """One go at a study."""

    def __init__(
        self,
        spec: StudySpec,
        tasks: list[Task],
        folder: TaskFolder | None,
        equation: Equation | None,
        progress: Callable[[Progress], object] | None,
    ):
        self.spec, self.tasks, self.folder = spec, tasks, folder
        self.equation, self.progress = equation, progress
        stored = [None if folder is None else folder.load(task) for task in tasks]
        self.records: dict[str, Record] = {
            key(task): record for task, record in zip(tasks, stored, strict=True) if record is not None
        }
        self.missing = [task for task in tasks if key(task) not in self.records]
        self.failures: list[Failure] = []
        self.unwritten: list[Record] = []
        self.problem = ""

    def run(self, executor: Any, workers: int | None, began: float) -> EquationOfState:
        """Run what is missing."""
        name = ""
        with stoppable() as stop:
            self._report()
            ended = True
            if self.missing:
                stop.deferred = True
                with engines.engine(executor, workers) as where:
                    name = where.name
                    function = simulate
                    if where.local:
                        function = functools.partial(simulate, stop=lambda: stop.asked)
                    ended = engines.run(
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
        result = self._so_far()
        result = dataclasses.replace(result, engine=name, seconds=clock.perf_counter() - began)
        self._warn()
        return result

    def _done(self, index: int, record: Record) -> None:
        task = self.missing[index]
        self.records[key(task)] = record
        if self.folder is not None:
            try:
                self.folder.store(record)
            except FileError as error:
                # A full disk may have room again before the end; the result is kept in memory until then.
                self.unwritten.append(record)
                self.problem = str(error)
        self._report()

    def _failed(self, index: int, error: BaseException) -> None:
        self.failures.append(Failure(self.missing[index], engines.reason(error)))

    def _write_again(self) -> None:
        assert self.folder is not None or not self.unwritten
        for record in [*self.unwritten]:
            try:
                self.folder.store(record)  # type: ignore[union-attr]
            except FileError as error:
                self.problem = str(error)
            else:
                self.unwritten.remove(record)

    def _so_far(self) -> EquationOfState:
        records = [self.records[key(task)] for task in self.tasks if key(task) in self.records]
        folder = None if self.folder is None else self.folder.path
        return EquationOfState(self.spec, records, [*self.failures], folder, equation=self.equation)

    def _report(self) -> None:
        if self.progress is None:
            return
        total = sum(map(cost, self.tasks)) or 1.0
        done = sum(cost(task) for task in self.tasks if key(task) in self.records)
        self.progress(Progress(len(self.records), len(self.tasks), done / total, self._so_far()))

    def _farewell(self) -> str:
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
                stacklevel=4,
            )
        if self.unwritten:
            warnings.warn(
                f"{len(self.unwritten)} results could not be kept: {self.problem} "
                "They are in the table now; run the study again to have them on the disk.",
                CaromWarning,
                stacklevel=4,
            )
