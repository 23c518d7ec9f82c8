"""What was saved, read by one word, and what was stopped, continued by another."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import carom.observables  # noqa: F401 (names its kinds of results)
from carom import checks
from carom.errors import FileError, InputError
from carom.io import checkpoint, records
from carom.io.trajectory import STATES
from carom.results import KINDS as RESULT_KINDS, loaded
from carom.scene_file.scene_file import SceneFile
from carom.simulation.simulation import Simulation
from carom.studies.kinds import KINDS, RESULTS, kind_at

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
    if all((where / name).is_file() for name in STATES):
        raise FileError(
            "{} holds a run ({}) and a packing ({}), so it cannot be resumed; move the files of one of them "
            "to another folder.".format(where, *STATES)
        )
    kind = kind_at(where) if where.is_dir() else None
    return (kind or KINDS["a run"]).resume(
        where, cores=cores, trust_code=trust_code, progress=progress, predicted=predicted
    )


def _of_folder(folder: Path) -> Any:
    """Return what a folder holds."""
    kind = kind_at(folder)
    if kind is None:
        raise FileError(f"{folder} is a folder without results of Carom; expected {KNOWN}.")
    return kind.load(folder)


def _of_json(path: Path) -> Any:
    """Return what a JSON file holds."""
    found = records.read_json(path, records.mapping(records.anything), "a file of Carom", "name another file")
    if path.name in RESULTS:
        return _of_folder(path.parent)
    if isinstance(found.get("kind"), str) and found["kind"] in RESULT_KINDS:
        return loaded(path)
    raise InputError(f"{path} is a JSON file of none of these: {KNOWN}.")
