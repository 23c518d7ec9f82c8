"""Running a study: missing tasks run on the chosen engine, and every result is kept."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from carom.notebook import watchable
from carom.studies.arguments import refuse_unknown
from carom.studies.eos.result import EquationOfState
from carom.studies.eos.simulate import simulate
from carom.studies.eos.spec import StudySpec
from carom.studies.outcome import Progress, carry_out, held
from carom.theory import Equation


def _by_runs(shown: Callable[..., None]) -> Callable[[Progress[EquationOfState]], object]:
    """Return a function that shows the number of finished runs."""
    return lambda present: shown(present.fraction, f"{present.done} of {present.total} runs")


@watchable("Study", _by_runs)
def equation_of_state(
    packing_fraction: Iterable[float] | float | None = None,
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
    cores: int | str | None = None,
    out: str | PathLike[str] | None = None,
    equation: Equation | None = None,
    progress: Callable[[Progress[EquationOfState]], object] | None = None,
    **settings: Any,
) -> EquationOfState:
    """Measure Z over packing fractions, numbers of particles and replicas.

    Parameters
    ----------
    packing_fraction : float or iterable of float
        Packing fractions; twelve of the fluid if left out.
    n : int or iterable of int
        Numbers of particles; 4000 if left out.
    replicas : int
        Independent runs of each point; 2 if left out.
    dimension : int
        d; 3 if left out.
    relative_error : float
        Relative error of Z at each point; 7e-5 if no length is given.
    collisions_per_particle : float
        Alternatively, the length of each run.
    equilibration : float
        Collisions per particle before the measurement; 1000 if left out.
    seed : int
        Seed; 1 if left out. Each task has its own random stream, independent of the other tasks and of the
        executor.
    initial : str
        "auto", "random", or the name of a lattice.
    scene : mapping
        Further keys of a scene, as in the section ``[scene]`` of a file.
    executor : optional
        Where the runs take place: "processes" (default), "threads", "serial", "mpi", the address of a Dask
        scheduler, a Dask Client, or any Executor; see :func:`carom.studies.executors.engine`.
    cores : int or "auto", optional
        Processes or threads; as many as there are cores if left out.
    out : path, optional
        Folder with a result file for each task. If the same study left results there, only missing tasks run.
        The grid may differ; all other settings must be the same.
    equation : callable, optional
        Equation of state for the comparison and for the finite-size correction.
    progress : callable, optional
        Called with a :class:`Progress` at the start and after every task; True shows a bar.
    **settings
        Further fields of a study: blocks, frames, neighbors. Any other is an error that names the right one.

    Returns
    -------
    EquationOfState
        Z at every point, and derived results.

    Raises
    ------
    InputError
        If the study cannot be run as it is.
    FileError
        If `out` holds another study, is in use, or cannot be written to at the start.
    Interrupted
        After Ctrl-C or SIGTERM; with `out`, finished tasks are kept.

    Warns
    -----
    CaromWarning
        If tasks failed, or results could not be written. The other tasks were run; run again to complete the
        missing ones.

    Examples
    --------
    >>> import carom
    >>> study = carom.equation_of_state(
    ...     [0.1, 0.2], n=108, replicas=1, collisions_per_particle=200, equilibration=50, executor="serial"
    ... )
    >>> [row.equilibrated for row in study.table]
    [True, True]
    """
    given = {
        "packing_fraction": packing_fraction,
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
    known = tuple(f.name for f in dataclasses.fields(StudySpec))
    refuse_unknown(
        "equation_of_state()", settings, (*known, "executor", "cores", "out", "equation", "progress")
    )
    spec = StudySpec(**{name: value for name, value in given.items() if value is not None})
    return run(spec, executor=executor, cores=cores, out=out, equation=equation, progress=progress)


@watchable("Study", _by_runs)
def run(
    spec: StudySpec,
    *,
    executor: Any = None,
    cores: int | str | None = None,
    out: str | PathLike[str] | None = None,
    equation: Equation | None = None,
    progress: Callable[[Progress[EquationOfState]], object] | None = None,
) -> EquationOfState:
    """Run a study that is given as a value; parameters as for :func:`equation_of_state`."""
    folder = None if out is None else Path(out)
    nothing_yet = EquationOfState(spec, folder=folder, equation=equation)
    return carry_out(nothing_yet, simulate, executor=executor, cores=cores, progress=progress)


def load(out: str | PathLike[str], equation: Equation | None = None) -> EquationOfState:
    """Return the finished part of the study in a folder, without running anything.

    Raises
    ------
    FileError
        If the folder holds no study of this version of Carom.
    """
    spec, records, folder = held(out, StudySpec)
    return EquationOfState(spec, records, folder=folder, equation=equation)
