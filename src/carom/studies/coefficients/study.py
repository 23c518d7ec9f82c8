"""Running a transport study: missing tasks run on the chosen engine, and every result is kept."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from carom.notebook import watchable
from carom.studies.arguments import refuse_unknown
from carom.studies.coefficients.result import Transport
from carom.studies.coefficients.simulate import simulate
from carom.studies.coefficients.spec import TransportSpec
from carom.studies.outcome import Progress, carry_out, held


def _by_runs(shown: Callable[..., None]) -> Callable[[Progress[Transport]], object]:
    """Return a function that shows the number of finished runs."""
    return lambda present: shown(present.fraction, f"{present.done} of {present.total} runs")


@watchable("Transport", _by_runs)
def transport(
    packing_fraction: Iterable[float] | float | None = None,
    *,
    n: int | Iterable[int] | None = None,
    replicas: int | None = None,
    dimension: int | None = None,
    relative_error: float | None = None,
    collisions_per_particle: float | None = None,
    equilibration: float | None = None,
    seed: int | None = None,
    blocks: int | None = None,
    scene: Mapping[str, Any] | None = None,
    executor: Any = None,
    cores: int | str | None = None,
    out: str | PathLike[str] | None = None,
    progress: Callable[[Progress[Transport]], object] | None = None,
    **settings: Any,
) -> Transport:
    """Measure self-diffusion, shear and bulk viscosity and thermal conductivity of fluids.

    For mixtures, mutual and thermal diffusion are measured, too.

    Parameters
    ----------
    packing_fraction : float or iterable of float
        Packing fractions; six of the fluid if left out.
    n : int or iterable of int
        Numbers of particles; 500 if left out.
    replicas : int
        Independent runs of each point; 4 if left out.
    dimension : int
        d; 3 if left out. In two dimensions the coefficients diverge with the size of the system.
    relative_error : float
        Relative error of shear viscosity and thermal conductivity at each point; 0.01 if no length is given.
    collisions_per_particle : float
        Alternatively, the length of each run.
    equilibration : float
        Collisions per particle before the measurement; 300 if left out.
    seed : int
        Seed; 1 if left out. Each task has its own random stream.
    blocks : int
        Blocks per run; 16 if left out.
    scene : mapping
        Further keys of a scene, as in the section ``[scene]`` of a file: diameter, mass, kT, species.
    executor : optional
        Where the runs take place: "processes" (default), "threads", "serial", "mpi", the address of a Dask
        scheduler, a Dask Client, or any Executor; see :func:`carom.studies.executors.engine`.
    cores : int or "auto", optional
        Processes or threads; as many as there are cores if left out.
    out : path, optional
        Folder with a result file for each task. If the same study left results there, only missing tasks run.
    progress : callable, optional
        Called with a :class:`Progress` at the start and after every task; True shows a bar.
    **settings
        Further fields of a study: initial, neighbors. Any other is an error that names the right one.

    Returns
    -------
    Transport
        The coefficients at every point.

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
        If tasks failed, or results could not be written.

    Notes
    -----
    Helfand's moments are exact between collisions, so that no result depends on a time step. The rule for the
    times of the slopes is in ``carom.studies.coefficients.windows``.

    Examples
    --------
    >>> import carom
    >>> study = carom.transport(
    ...     0.1, n=108, replicas=1, collisions_per_particle=400, equilibration=20, executor="serial"
    ... )
    >>> print(str(study).splitlines()[0])
    Transport coefficients in 3D: N = 108 at packing fraction 0.1, 1 run
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
        "blocks": blocks,
        "scene": scene,
        **settings,
    }
    known = tuple(f.name for f in dataclasses.fields(TransportSpec))
    refuse_unknown("transport()", settings, (*known, "executor", "cores", "out", "progress"))
    spec = TransportSpec(**{name: value for name, value in given.items() if value is not None})
    return run(spec, executor=executor, cores=cores, out=out, progress=progress)


@watchable("Transport", _by_runs)
def run(
    spec: TransportSpec,
    *,
    executor: Any = None,
    cores: int | str | None = None,
    out: str | PathLike[str] | None = None,
    progress: Callable[[Progress[Transport]], object] | None = None,
) -> Transport:
    """Run a study that is given as a value; parameters as for :func:`transport`."""
    nothing_yet = Transport(spec, folder=None if out is None else Path(out))
    return carry_out(nothing_yet, simulate, executor=executor, cores=cores, progress=progress)


def load(out: str | PathLike[str]) -> Transport:
    """Return the finished part of the study in a folder, without running anything.

    Raises
    ------
    FileError
        If the folder holds no study of this version of Carom.
    """
    spec, records, folder = held(out, TransportSpec)
    return Transport(spec, records, folder=folder)
