"""The work of ``carom run`` and ``carom resume``: a plan is run, its results are written to a folder."""

from __future__ import annotations

import dataclasses
import json
from os import PathLike
from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.io import checkpoint
from carom.notebook import watchable
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import RunSpec
from carom.simulation.moves.barostat import Barostat
from carom.simulation.moves.swaps import Swaps
from carom.studies.result_folders import check_same, of_the_user
from carom.studies.runs.driver import KEPT, Predicted, Progress, Run
from carom.studies.runs.folder import RunFolder, existing_run, words_of
from carom.studies.runs.inputs import plan_of, plan_of_scene
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.studies.signals import stoppable
from carom.studies.signatures import documented


@documented(RunSpec)
@watchable("Running")
def run(
    scene: Scene | SceneFile | str | PathLike[str] | None = None,
    out: str | PathLike[str] = "carom-run",
    *,
    swaps: Swaps | None = None,
    barostat: Barostat | None = None,
    cores: int | str = 1,
    trust_code: bool = False,
    overwrite: bool = False,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    **given: Any,
) -> RunResult:
    """Run a scene, and write a trajectory, pressure, g(r) and pictures to a folder, as ``carom run`` does.

    Parameters
    ----------
    scene : Scene, SceneFile or path, optional
        The scene; or a scene file (TOML), or the folder of a run, which also say how to run it; or a file
        with frames, also of another program, to start from. By default 2048 hard spheres at packing fraction
        0.45.
    out : path
        The folder; made if needed.
    @
    swaps : Swaps, optional
        Exchanges of diameters; see ``docs/driven``.
    barostat : Barostat, optional
        Constant pressure; see ``docs/measuring``.
    cores : int or "auto"
        Threads that run this one system together; they do not affect the results.
    trust_code : bool
        Whether the Python file of a range rule may run.
    overwrite : bool
        Whether a run that the folder holds may be replaced.
    progress : callable, optional
        Called as ``progress(fraction, stage)``; does not affect the results. True shows a bar.
    predicted : callable, optional
        Called with a prediction of the time that is left, if there is a relative error to reach.

    Returns
    -------
    RunResult
        The folder and its results.

    Raises
    ------
    InputError
        If an argument is unknown, or the run cannot be carried out; no file was changed then.
    OverlapError
        If ``check`` is given, and frames have overlaps; all results are written before.
    FileError
        If the folder holds a run, or cannot be written; after a full disk, :func:`carom.resume` goes on.
    Interrupted
        After Ctrl-C or SIGTERM, after saving everything that :func:`carom.resume` needs.

    Notes
    -----
    The folder then holds ``scene.toml``, ``trajectory.*``, ``rdf.csv``, ``summary.json``, three pictures,
    ``checkpoint.h5`` and, if asked for, ``events.h5``. A scene that is not from a file is kept as
    ``start.h5md``.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.crystal(108, 0.3)
    >>> found = carom.run(scene, "run1", collisions_per_particle=100, frames=2, pictures=False)
    >>> found.n, len(found.frames), abs(found.Z.mean - carom.theory.carnahan_starling(0.3)) < 0.3
    (108, 2, True)
    """
    folder = RunFolder(Path(out))
    value = scene if isinstance(scene, Scene) else None
    plan = plan_of(scene) if value is None else SceneFile()
    how = plan.run.replaced(**given, swaps=swaps, barostat=barostat)
    plan = dataclasses.replace(plan, run=how)
    plan = plan.trusted() if trust_code else plan
    folder.check_free(overwrite)
    start = None
    if value is not None:
        made, start = plan_of_scene(value, given.get("kT"), folder)
        plan = SceneFile(made.scene, dataclasses.replace(how, kT=made.run.kT))
    with stoppable() as stop:
        summary = Run(plan, folder, stop, progress, predicted, cores).from_the_start(start)
    return RunResult(folder.path, summary, new=True)


@watchable("Running")
def resume(
    out: str | PathLike[str],
    *,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    cores: int | str | None = None,
    trust_code: bool = False,
) -> RunResult:
    """Continue the run in a folder; the results are bit-identical to an uninterrupted run.

    Frames and events are verified before any file is changed; a run that was finished has ``new=False``.
    ``cores`` are threads, 1 if left out.
    """
    folder = existing_run(Path(out))
    if folder.summary.is_file():
        _check_finished(folder)
        return RunResult(folder.path, read_summary(folder.summary), new=False)
    with stoppable() as stop:
        begun = folder.checkpoint.is_file()
        if not begun:
            folder.check_empty()
        plan, notes = _noted(folder.checkpoint) if begun else (SceneFile.load(folder.scene), {})
        plan = plan.trusted() if trust_code else plan
        run = Run(plan, folder, stop, progress, predicted, 1 if cores is None else cores)
        summary = run.from_checkpoint(notes) if begun else run.from_the_start()
    return RunResult(folder.path, summary, new=True)


def go_on(plan: SceneFile, out: str | PathLike[str], *, trust_code: bool = False, **how: Any) -> RunResult:
    """Continue the run in a folder if it is that of the plan, or run the plan there if there is none.

    ``trust_code``: the Python file of a range rule may run; ``how`` are arguments of :func:`run` and
    :func:`resume`.
    """
    folder = RunFolder(Path(out))
    begun = folder.checkpoint.is_file() or folder.summary.is_file()
    if not begun:
        # A process that was killed before its first checkpoint left at most a scene file of its own.
        killed = folder.scene.is_file() and not of_the_user(folder.scene)
        return run(plan, out, overwrite=killed, trust_code=trust_code, **how)
    if folder.scene.is_file():
        asked = SceneFile.from_toml(plan.to_toml())
        check_same(folder.path, folder.kind, words_of(SceneFile.load(folder.scene)), words_of(asked))
    return resume(out, trust_code=trust_code, **how)


def _noted(path: Path) -> tuple[SceneFile, dict[str, Any]]:
    """Return the plan and the notes that the checkpoint of a run keeps."""
    _, attributes = checkpoint.load(path)
    try:
        notes = json.loads(attributes["extra"])
        if missing := {*KEPT, "written"} - {*notes}:
            raise ValueError(f"it has no {min(missing)}")
        return SceneFile.from_toml(notes["plan"]), notes
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} is not the checkpoint of a run: {error}.") from None


def _check_finished(folder: RunFolder) -> None:
    """Refuse a scene file that is not that of a finished run, according to the checkpoint."""
    try:
        plan, _ = _noted(folder.checkpoint)
    except FileError:
        return  # A finished run needs no checkpoint.
    folder.check_unedited(plan)
