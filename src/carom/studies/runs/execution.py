"""The work of ``carom run`` and ``carom resume``: a plan is run, its results are written to a folder."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.io import checkpoint
from carom.notebook import by_stage, table, watchable
from carom.observables.statistics import Estimate
from carom.plan.plan import Plan
from carom.studies.runs.edited import check_unedited
from carom.studies.runs.folder import RunFolder, existing_run
from carom.studies.runs.summary import read_summary
from carom.studies.runs.underway import KEPT, Predicted, Progress, Run
from carom.studies.signals import stoppable


@dataclass(frozen=True)
class RunResult:
    """A finished run.

    Attributes
    ----------
    folder : Path
        Folder with the files of the run.
    summary : dict
        Contents of ``summary.json``.
    new : bool
        Whether the run was finished just now, and not before.
    """

    folder: Path
    summary: dict[str, Any]
    new: bool

    def _repr_html_(self) -> str:
        names = (
            "potential_energy",
            "temperature",
            "compressibility_factor",
            "reduced_pressure",
            "contact_value",
            "collision_rate",
        )
        values = {name: self.summary[name] for name in names if self.summary[name]["mean"] is not None}
        shown = [(name.replace("_", " "), _with_error(value)) for name, value in values.items()]
        return table(f"Run of {self.summary['n']} particles in {self.folder}", shown)


def _with_error(value: dict[str, Any]) -> str:
    """Return a mean and its error from a summary as text."""
    error = math.inf if value["error"] is None else value["error"]
    return Estimate(value["mean"], error, 0.0, 0.0, 0).value_text.replace("+-", "±")


@watchable("Running", by_stage)
def run(
    plan: Plan | None = None,
    out: str | PathLike[str] = "carom-run",
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    workers: int | str = 1,
) -> RunResult:
    """Run a plan and write its results to a folder.

    Parameters
    ----------
    plan : Plan, optional
        By default 2048 hard spheres at packing fraction 0.45.
    out : path
        The folder; made if needed.
    overwrite : bool
        Whether a run that the folder holds may be replaced.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; does not affect the results. True shows a bar.
    predicted : callable, optional
        Called with a :class:`carom.observables.Prediction` when the plan asks for a relative error.
    workers : int or "auto"
        Threads, as in :class:`carom.Simulation`; they do not affect the results.

    Returns
    -------
    RunResult
        The folder and the summary.

    Raises
    ------
    InputError
        If the plan cannot be carried out; no file was changed then.
    FileError
        If the folder holds a run, or cannot be written; after a full disk, :func:`resume` goes on.
    Interrupted
        After Ctrl-C or SIGTERM, after saving everything that :func:`resume` needs. It is a KeyboardInterrupt.

    Notes
    -----
    The folder then holds ``scene.toml``, ``trajectory.*``, ``rdf.csv``, ``summary.json``, three pictures,
    ``checkpoint.h5`` and, if asked for, ``events.h5``.
    """
    plan = (Plan() if plan is None else plan).beside(Path())
    folder = RunFolder(Path(out))
    folder.check_free(overwrite)
    with stoppable() as stop:
        summary = Run(plan, folder, stop, progress, predicted, workers).from_the_start()
    return RunResult(folder.path, summary, new=True)


@watchable("Running", by_stage)
def resume(
    out: str | PathLike[str],
    *,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    workers: int | str = 1,
    trust_code: bool = False,
) -> RunResult:
    """Continue the run in a folder; the results are bit-identical to an uninterrupted run.

    Parameters
    ----------
    out : path
        The folder of the run.
    progress, predicted : callable, optional
        As in :func:`run`.
    workers : int or "auto"
        Threads; their number may differ from before.
    trust_code : bool
        Whether the Python file of a range rule may run, as after ``Plan.trusted()``.

    Returns
    -------
    RunResult
        It has ``new=False`` if the run was finished already.

    Raises
    ------
    InputError
        If the scene has a range rule from a file that may not run, or that was edited.
    FileError
        If the folder holds no run, or another process is running in it. If its checkpoint is damaged or of
        another version of Carom, or its scene file was edited. If there are frames and no checkpoint. If a
        file that the run wrote is damaged and cannot be restored. Nothing in the folder was changed then.
    Interrupted
        As in :func:`run`.

    Warns
    -----
    CaromWarning
        If a trajectory is damaged or missing, and was restored from another.

    Notes
    -----
    Everything is verified before any file is changed: the checkpoint, and, by its checksums, the frames and
    events that were written before it.
    """
    folder = existing_run(Path(out))
    if folder.summary.is_file():
        _check_finished(folder)
        return RunResult(folder.path, read_summary(folder.summary), new=False)
    with stoppable() as stop:
        begun = folder.checkpoint.is_file()
        if not begun:
            folder.check_empty()
        plan, notes = _noted(folder.checkpoint) if begun else (Plan.load(folder.scene), {})
        plan = plan.trusted() if trust_code else plan
        run = Run(plan, folder, stop, progress, predicted, workers)
        summary = run.from_checkpoint(notes) if begun else run.from_the_start()
    return RunResult(folder.path, summary, new=True)


def _noted(path: Path) -> tuple[Plan, dict[str, Any]]:
    """Return the plan and the notes that the checkpoint of a run keeps."""
    _, attributes = checkpoint.load(path)
    try:
        notes = json.loads(attributes["extra"])
        if missing := {*KEPT, "written"} - {*notes}:
            raise ValueError(f"it has no {min(missing)}")
        return Plan.from_toml(notes["plan"]), notes
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} is not the checkpoint of a run: {error}.") from None


def _check_finished(folder: RunFolder) -> None:
    """Refuse a scene file that is not that of a finished run, according to the checkpoint."""
    try:
        plan, _ = _noted(folder.checkpoint)
    except FileError:
        return  # A finished run needs no checkpoint.
    check_unedited(folder.scene, plan)
