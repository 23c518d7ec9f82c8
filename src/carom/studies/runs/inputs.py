"""What a run is asked for: a scene, a scene file or a folder, and the arguments that replace its values."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.io.formats import foreign_format_of
from carom.models.obstacles import Wall
from carom.paths import existing
from carom.scene.conversion import to_frame
from carom.scene.fields import is_elastic, is_usual
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.studies.runs.folder import RunFolder

MODELS = ("interaction", "motion", "impact")
"""Keywords of a scene that its scene file names in the same words, and that may follow from others."""


def plan_of(asked: Any) -> SceneFile:
    """Return the scene file that a file, a folder of a run or a value describes; without one the default.

    A file with frames, also of another program, is the start of a scene that says nothing else.
    """
    if asked is None:
        return SceneFile()
    if isinstance(asked, SceneFile):
        return asked.beside(Path())
    if isinstance(asked, str | PathLike):
        path = Path(asked)
        if path.suffix.lower() != ".toml" and not path.is_dir() and foreign_format_of(path) is not None:
            return SceneFile(SceneSpec(file=str(existing(path)))).beside(Path())
        return SceneFile.load(path / RunFolder(path).scene.name if path.is_dir() else path)
    raise InputError(
        "run() takes a Scene, a scene file (TOML), a file with frames or the folder of a run, found "
        f"{checks.describe(asked)}."
    )


def plan_of_scene(scene: Scene, kT: float | None, folder: RunFolder) -> tuple[SceneFile, Frame]:
    """Return a plan that starts from a scene, and the frame that is to be written to the folder of its run.

    Velocities are drawn at ``kT`` if it is given, and at 1 if the scene has none.
    """
    if scene.velocities is None and kT is None:
        kT = 1.0
    words: dict[str, Any] = {name: getattr(scene, name) for name in MODELS if not is_usual(scene, name)}
    if is_usual(scene, "impact") and not is_elastic(scene):
        words["impact"] = scene.impact
    if any(wall != Wall() for wall in scene.walls.values()):  # a frame says only that there are walls
        words["walls"] = scene.walls
    if scene.obstacles:
        words["obstacles"] = scene.obstacles
    if scene.drive is not None:
        words["drive"] = scene.drive
    if scene.pinned is not None:
        words["pinned"] = tuple(np.flatnonzero(scene.pinned).tolist())
    if scene.contact is not None:
        words["contact"] = tuple(map(tuple, scene.contact.tolist()))
    plan = SceneFile(SceneSpec(file=str(folder.start.absolute()), **words), RunSpec(kT=kT))
    plan.to_toml()  # which refuses what no file can hold, before anything is compiled
    return plan, to_frame(scene)
