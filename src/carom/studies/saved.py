"""What was saved, read by one word, and what was stopped, continued by another."""

from __future__ import annotations

import csv
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.errors import FileError, InputError
from carom.io import checkpoint, records
from carom.io.trajectory import open_reader
from carom.models.files.tables import obstacle_from_table
from carom.results import KINDS, loaded
from carom.scene_file.scene_file import SceneFile
from carom.simulation.simulation import Simulation
from carom.studies.accuracy.study import Trade
from carom.studies.codes.code import FORMAT as A_CODE, load as load_code
from carom.studies.codes.study import Codes
from carom.studies.coefficients.study import Transport
from carom.studies.eos.study import EquationOfState
from carom.studies.flow.study import ShearFlow
from carom.studies.folder import SETTINGS, Folder
from carom.studies.packings.compression import PackingFolder, holds_packing
from carom.studies.packings.pack import resume_packing
from carom.studies.packings.packing import HISTORY, Packing
from carom.studies.packings.study import Packings
from carom.studies.places import kind_of
from carom.studies.planner.plan import load as load_plan
from carom.studies.runs.execution import resume as resume_run
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.studies.study import Study

KNOWN = (
    "a scene file (.toml), a checkpoint (.h5), the folder of a run, packing, study or plan, or a result that "
    "was saved as .json"
)
"""What :func:`load` reads."""


def load(path: str | PathLike[str], *, trust_code: bool = False) -> Any:
    """Return what was saved in a file or a folder.

    Parameters
    ----------
    path : path
        A scene file (TOML), a checkpoint, the folder of a run, of a packing, of a study or of a plan, or a
        result that was saved as JSON.
    trust_code : bool
        Whether the Python file of a scene with range rules may run.

    Returns
    -------
    Scene, Simulation, RunResult, Packing, RunPlan, SphericalCode or a study
        A scene file gives its scene, a checkpoint the simulation.

    Raises
    ------
    FileError
        If it is missing, damaged or of another version of Carom, or a run or packing is not finished.
    InputError
        If it is nothing that can be loaded; the message lists what can.

    Examples
    --------
    >>> import carom
    >>> found = carom.run(carom.Scene.crystal(32, 0.3), "run1", collisions_per_particle=50, frames=2)
    >>> run = carom.load("run1")
    >>> run.Z.mean == found.Z.mean, len(run.frames)
    (True, 2)
    """
    if not isinstance(path, str | PathLike):
        raise InputError(f"load() takes the path of {KNOWN}; found {checks.describe(path)}.")
    where = Path(path)
    if where.is_dir():
        return _of_folder(where)
    if not where.is_file():
        raise FileError(f"{path} does not exist; expected {KNOWN}.")
    suffix = where.suffix.lower()
    if suffix == ".toml":
        plan = SceneFile.load(where)
        return (plan.trusted() if trust_code else plan).build_scene()
    if suffix == ".json":
        return _of_json(where)
    if suffix == ".npz":
        return loaded(where)
    if checkpoint.is_one(where):
        return Simulation.load(where)
    raise InputError(
        f"{path} is nothing that can be loaded: expected {KNOWN}; carom.open reads trajectories."
    )


def resume(
    folder: str | PathLike[str],
    *,
    cores: int | str | None = None,
    trust_code: bool = False,
    progress: Any = None,
    predicted: Any = None,
) -> Any:
    """Continue what was stopped in a folder: a run, a packing, a study or the runs of a plan.

    Parameters
    ----------
    folder : path
        The folder.
    cores : int or "auto", optional
        Threads of a run, 1 if left out; processes of a study, as many as there are cores if left out.
    trust_code : bool
        Whether the Python file of a range rule may run.
    progress : callable, optional
        As for the function that began it; True shows a bar for a run or a packing.
    predicted : callable, optional
        As in :func:`carom.run`.

    Returns
    -------
    RunResult, Packing, Outcome or a study
        What an uninterrupted run would have returned, bit for bit.

    Raises
    ------
    FileError
        If the folder holds nothing that can be continued, or another process is at work there.
    InputError
        If the scene has a range rule from a file that may not run.
    Interrupted
        After Ctrl-C or SIGTERM.

    Examples
    --------
    A run that is finished already comes back as it is.

    >>> import carom
    >>> found = carom.run(carom.Scene.crystal(32, 0.3), "run2", collisions_per_particle=50, frames=2)
    >>> carom.resume("run2").Z.mean == found.Z.mean
    True
    """
    where = Path(folder)
    if holds_packing(where):
        return resume_packing(where, progress=progress)
    kind = kind_of(where) if where.is_dir() else None
    if kind == "a plan":
        return load_plan(where).run(out=where, cores=cores, progress=progress)
    if kind == "a study":
        return _study(where).run(out=where, cores=cores, progress=progress)
    return resume_run(
        where,
        progress=progress,
        predicted=predicted,
        cores=1 if cores is None else cores,
        trust_code=trust_code,
    )


def _of_folder(folder: Path) -> Any:
    """Return what a folder holds."""
    kind = kind_of(folder)
    if kind == "a packing":
        return _packing(PackingFolder(folder))
    if kind == "a plan":
        return load_plan(folder)
    if kind == "a study":
        return _study(folder)
    run = RunFolder(folder)
    if kind == "a run" or run.summary.is_file():
        if not run.summary.is_file():
            raise FileError(f"{folder} holds a run that is not finished; `carom resume {folder}` goes on.")
        return RunResult(folder, read_summary(run.summary))
    raise FileError(f"{folder} is a folder without results of Carom; expected {KNOWN}.")


STUDIES: dict[str, type[Study[Any]]] = {
    kind.Spec.study: kind for kind in (EquationOfState, Transport, ShearFlow, Codes, Packings, Trade)
}
"""The studies by what their folders say that they are."""


def _study(folder: Path) -> Study[Any]:
    """Return the study in a folder."""
    found = Folder(folder).read()
    if found is None:
        raise FileError(f"{folder} holds no study ({SETTINGS} is missing); name another folder.")
    kind = STUDIES.get(str(found["settings"].get("study")))
    if kind is None:
        raise FileError(
            f"{folder} holds a study of another program ({found['settings'].get('study')!r}); load it there."
        )
    return kind.load(folder)


_SUMMARY = records.table(
    {
        "n": records.integer(low=1),
        "note": records.text,
        "seed": records.integer(),
        "shrunk": records.number(low=0.0),
        "obstacles": records.listed(records.anything),
    }
)


def _packing(folder: PackingFolder) -> Packing:
    """Return the packing in a folder."""
    if not folder.summary.is_file():
        raise FileError(
            f"{folder.path} holds a packing that is not finished; `carom resume {folder.path}` goes on."
        )
    found = records.read_json(folder.summary, _SUMMARY, "the summary of a packing", "pack again")
    with open_reader(folder.path) as reader:
        frame = reader[-1]
    try:
        obstacles = tuple(obstacle_from_table(table) for table in found["obstacles"])
    except InputError as error:
        raise FileError(f"{folder.summary}: {error}") from None
    return Packing(
        frame, _history(folder.path / "history.csv"), found["note"], found["seed"], found["shrunk"], obstacles
    )


def _history(path: Path) -> np.ndarray:
    """Return the record of a compression from its table."""
    names = HISTORY.names or ()
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [tuple(float(row[name]) for name in names) for row in csv.DictReader(file)]
        return np.array(rows, HISTORY)
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise FileError(f"{path} is not the history of a packing ({error}); pack again.") from None


def _of_json(path: Path) -> Any:
    """Return what a JSON file holds."""
    found = records.read_json(path, records.mapping(records.anything), "a file of Carom", "name another file")
    if found.get("format") == A_CODE:
        return load_code(path)
    if path.name in ("summary.json", SETTINGS):
        return _of_folder(path.parent)
    if isinstance(found.get("kind"), str) and found["kind"] in KINDS:
        return loaded(path)
    raise InputError(f"{path} is a JSON file of none of these: {KNOWN}.")
