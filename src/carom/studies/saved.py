"""What was saved, read by one word, and what was stopped, continued by another."""

from __future__ import annotations

import csv
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io import checkpoint, records
from carom.io.trajectory import open_reader
from carom.io.validation import flaw
from carom.models.files.tables import obstacle_from_table
from carom.results import KINDS, loaded
from carom.scene_file.scene_file import SceneFile
from carom.simulation.simulation import Simulation
from carom.studies.codes.code import FORMAT as A_CODE
from carom.studies.codes.code import load as load_code
from carom.studies.coefficients.result import Transport
from carom.studies.coefficients.spec import TransportSpec
from carom.studies.coefficients.study import load as load_transport
from carom.studies.coefficients.study import run as run_transport
from carom.studies.eos.result import EquationOfState
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.study import load as load_eos
from carom.studies.eos.study import run as run_eos
from carom.studies.outcome import of_saved
from carom.studies.packings.compression import PackingFolder, holds_packing, resume_packing
from carom.studies.packings.packing import ARRAYS, HISTORY, Packing
from carom.studies.places import kind_of
from carom.studies.planner.plan import NAME as PLAN
from carom.studies.planner.plan import load as load_plan
from carom.studies.planner.plan import of_words as plan_of_words
from carom.studies.runs.execution import resume as resume_run
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import SUMMARY, read_summary
from carom.studies.tasks import SETTINGS, TaskFolder

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
    Scene, Simulation, RunResult, Packing, EquationOfState, Transport, RunPlan or SphericalCode
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
    RunResult, Packing, EquationOfState, Transport or Outcome
        What an uninterrupted run would have returned, bit for bit.

    Raises
    ------
    FileError
        If the folder holds nothing that can be continued, or another process is at work there.
    InputError
        If the scene has a range rule from a file that may not run.
    Interrupted
        After Ctrl-C or SIGTERM.
    """
    where = Path(folder)
    if holds_packing(where):
        return resume_packing(where, progress=progress)
    kind = kind_of(where) if where.is_dir() else None
    if kind == "a plan":
        return load_plan(where).run(out=where, cores=cores, progress=progress)
    if kind == "a study":
        transport = _study(where) == "transport"
        spec = (load_transport if transport else load_eos)(where).spec
        run: Callable[..., Any] = run_transport if transport else run_eos
        return run(spec, out=where, cores=cores, progress=progress)
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
        return load_transport(folder) if _study(folder) == "transport" else load_eos(folder)
    run = RunFolder(folder)
    if kind == "a run" or run.summary.is_file():
        if not run.summary.is_file():
            raise FileError(f"{folder} holds a run that is not finished; `carom resume {folder}` goes on.")
        return RunResult(folder, read_summary(run.summary))
    raise FileError(f"{folder} is a folder without results of Carom; expected {KNOWN}.")


def _study(folder: Path) -> str:
    """Return which study a folder holds."""
    found = TaskFolder(folder).read()
    if found is None:
        raise FileError(f"{folder} holds no study ({SETTINGS} is missing); name another folder.")
    return str(found["settings"].get("study"))


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
    if path.name == PLAN and "carom" in found:
        return load_plan(path.parent)
    if path.name in ("summary.json", SETTINGS):
        return _of_folder(path.parent)
    kind = str(found.get("kind"))
    if kind in _READ:
        try:
            return _READ[kind](found)
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise FileError(f"{path} is no {kind} that was saved ({error}); name another file.") from None
    if kind in KINDS:
        return loaded(path)
    raise InputError(f"{path} is a JSON file of none of these: {KNOWN}.")


def _packing_of(words: dict[str, Any]) -> Packing:
    """Return the packing in the words of ``Packing.to_json``."""
    held = words["frame"]
    arrays: dict[str, Any] = {name: np.array(held[name], float) for name in ARRAYS[:-2]}
    arrays |= {name: None if held[name] is None else np.array(held[name]) for name in ARRAYS[-2:]}
    names, periodic = tuple(held["species_names"]), tuple(held["periodic"])
    frame = Frame(held["time"], held["step"], **arrays, species_names=names, periodic=periodic)
    if wrong := flaw(frame):
        raise InputError(f"its {wrong}")
    outside = np.abs(frame.positions - 0.5 * frame.box) > frame.box
    if outside.any() or frame.diameters.max() > 2.0 * frame.box.min():
        raise InputError("its particles do not fit into its box")
    history = np.array([tuple(row) for row in words["history"]], HISTORY)
    obstacles = tuple(obstacle_from_table(table) for table in words["obstacles"])
    return Packing(frame, history, words["note"], words["seed"], words["shrunk"], obstacles)


_READ: dict[str, Callable[[dict[str, Any]], Any]] = {
    "EquationOfState": lambda words: of_saved(words, StudySpec, EquationOfState),
    "Transport": lambda words: of_saved(words, TransportSpec, Transport),
    "Packing": _packing_of,
    "RunResult": lambda words: RunResult(Path(words["folder"]), SUMMARY(words["summary"], "its summary")),
    "RunPlan": lambda words: plan_of_words(words, "its content"),
}
"""How a result is made from the JSON that its ``save`` wrote, by its kind."""
