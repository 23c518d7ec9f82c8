"""What is at a path, asked in one place: it is told, loaded by one word, and continued by another."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import carom.observables  # noqa: F401 (names its kinds of results)
from carom import checks
from carom.errors import FileError, InputError
from carom.io import checkpoint, events, records
from carom.io.formats import FOREIGN, foreign_format_of, nameless
from carom.io.trajectory import open_reader
from carom.layout import RESULTS, STATES, Kind, kind_at
from carom.results import KINDS as RESULT_KINDS, loaded
from carom.scene_file.scene_file import SceneFile
from carom.simulation.simulation import Simulation
from carom.spec import read
from carom.studies import study_registry
from carom.studies.info import Info, of_trajectory
from carom.studies.packings import kind as packing_kind
from carom.studies.planner import kind as plan_kind
from carom.studies.runs import kind as run_kind
from carom.studies.study import Study
from carom.texts import typed

HOMES: dict[str, Any] = {
    "a run": run_kind, "a packing": packing_kind, "a plan": plan_kind, "a study": study_registry,
}  # fmt: skip
"""The module that can ``load``, ``resume`` and ``tell`` what is in a folder, by the name of its kind."""

KNOWN = (
    "a scene file (.toml), a checkpoint (.h5), the folder of a run, packing, study or plan, or a result that "
    "was saved as .json"
)
"""What :func:`load` reads."""

EXPECTED = (
    "a scene file or study file (.toml), the folder of a run, packing, study or plan, a trajectory "
    f"({', '.join(FOREIGN)}), a checkpoint, an event log, or a saved result (.json, .npz)"
)
"""What :func:`info` knows."""


def _kind(path: str | PathLike[str], expected: str) -> Kind | None:
    """Return the kind of the folder at a path, None for a file; what is neither is an error."""
    where = Path(path)
    if where.is_file():
        return None
    if not where.is_dir():
        raise FileError(f"{path} does not exist; expected {expected}.")
    if (kind := kind_at(where)) is None:
        raise FileError(f"{where} is a folder without results of Carom; expected {expected}.")
    return kind


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
    if kind := _kind(path, KNOWN):
        return HOMES[kind.name].load(where)
    suffix = where.suffix.lower()
    if suffix == ".toml":
        plan = SceneFile.load(where)
        return (plan.trusted() if trust_code else plan).build_scene()
    if suffix == ".json":
        found = records.read_json(
            where, records.mapping(records.anything), "a file of Carom", "name another file"
        )
        if where.name in RESULTS:
            return load(where.parent)
        if not isinstance(found.get("kind"), str) or found["kind"] not in RESULT_KINDS:
            raise InputError(f"{where} is a JSON file of none of these: {KNOWN}.")
    if suffix in (".json", ".npz"):
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
    if all((where / name).is_file() for name in STATES):
        raise FileError(
            "{} holds a run ({}) and a packing ({}), so it cannot be resumed; move the files of one of them "
            "to another folder.".format(where, *STATES)
        )
    kind = kind_at(where)
    return HOMES["a run" if kind is None else kind.name].resume(
        where, cores=cores, trust_code=trust_code, progress=progress, predicted=predicted
    )


def info(path: str | PathLike[str]) -> Info:
    """Return what ``carom info`` says of a path."""
    where = Path(path)
    if where.is_file() and where.name in RESULTS:
        where = where.parent
    if kind := _kind(where, EXPECTED):
        found = Info(where, kind.name, "finished")
        HOMES[kind.name].tell(found, where)
        after = "carom view" if found.state.startswith("finished") else "carom resume"
        found.next = found.next or typed(after, where)
        return found
    suffix = where.suffix.lower()
    if suffix == ".toml":
        return _toml(where)
    if suffix in (".json", ".npz"):
        result = load(where)
        found = Info(where, f"a saved result ({type(result).__name__})")
        found.next = f"carom.load({str(where)!r}).plot()   (in Python)"
        found.result(str(result).splitlines())
        if isinstance(result, Study):
            found.values |= {"done": len(result.records), "tasks": len(result.tasks)}
    elif suffix in (".h5", ".h5md") and checkpoint.is_one(where):
        found = Info(where, "a checkpoint", next=f"carom.load({str(where)!r})   (in Python)")
        if where.name in STATES:
            found.next = typed("carom resume", where.parent)
        found.checkpoint(where)
    elif events.is_log(where):
        found = Info(where, "an event log", next=typed("carom view", where))
        found.log(where)
    elif foreign_format_of(where) is None:
        raise FileError(
            f"{path} is nothing that Carom reads; expected {EXPECTED}; if it holds frames, {nameless(where)}."
        )
    else:
        with open_reader(where) as reader:
            return of_trajectory(reader)
    return found


def _toml(path: Path) -> Info:
    try:
        held = records.toml_tables(read(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    studies = {kind.Spec.section: kind for kind in study_registry.STUDIES.values()}
    named = next((name for name in ("run", *studies, "plan") if name in held), "run")
    kind = studies.get(named)
    if kind is not None and (named != "pack" or "scene" not in held):
        study = kind(kind.Spec.load(path))
        found = Info(path, "a study file", next=typed(study.command, path))
        study_registry.results(found, study)
    else:
        found = Info(path, "a scene file", next=typed(f"carom {named}", path))
        found.scene(path, run=named == "run")
    return found
