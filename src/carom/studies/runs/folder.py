"""The folder of a run: the names of its files, and its lock against other processes."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from carom.declared import fields_of
from carom.errors import CaromError, FileError, InputError
from carom.io.events import read_events
from carom.io.trajectory import open_reader
from carom.paths import reason, write_text, writing
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import FORMATS
from carom.studies.lock import owned
from carom.studies.places import (
    TABLES,
    differences,
    is_table,
    kind_of,
    of_the_user,
    refuse_others,
    title,
)
from carom.texts import typed

PICTURES = ("pressure.png", "rdf.png", "snapshot.png")


class RunFolder:
    """The folder of one run, which need not exist yet, and the names of its files."""

    kind = "a run"

    def __init__(self, path: Path):
        self.path = path
        self.scene = path / "scene.toml"  # the plan of the run
        self.checkpoint = path / "checkpoint.h5"  # the state to continue from
        self.summary = path / "summary.json"  # the result, written last
        self.timing = path / "timing.json"  # its wall times
        self.events = path / "events.h5"  # the event log
        self.rdf = path / "rdf.csv"
        self.start = path / "start.h5md"  # the scene from which a run began that was given as one

    def trajectory(self, form: str) -> Path:
        """Return the trajectory of a format."""
        return self.path / f"trajectory.{form}"

    def _files(self) -> list[Path]:
        """Return all files of a run, in the order in which an old run is removed."""
        # Without a summary the run is not finished; without a checkpoint it is not under way.
        trajectories = [self.trajectory(form) for form in FORMATS]
        pictures = [self.path / name for name in PICTURES]
        others = [self.timing, self.events, self.rdf, self.start, *pictures]
        return [self.summary, self.checkpoint, self.scene, *trajectories, *others]

    def check_free(self, overwrite: bool) -> None:
        """Refuse a folder in which :meth:`begin` would fail; no file is changed."""
        there = next((path for path in (self.path, *self.path.absolute().parents) if path.exists()), None)
        with writing(self.path):
            if there is not None and not there.is_dir():
                raise FileError(f"{self.path} cannot be a folder, because {there} is a file; choose another.")
            if there is not None and not os.access(there, os.W_OK | os.X_OK):
                raise FileError(
                    f"{self.path} cannot be written: {there} is not writable; choose another folder."
                )
            found = [path.name for path in self._files() if os.path.lexists(path)]
        refuse_others(self.path, self.kind)
        # A scene file of the user may lie in the folder in which the run is to be.
        if (overwrite or found == [self.scene.name]) and self.scene.name in found and of_the_user(self.scene):
            raise FileError(
                f"{self.scene} was written or annotated by somebody, and a run there would replace it; "
                "choose another folder with --out, or move the file."
            )
        if found and not overwrite:
            raise FileError(
                f"{self.path} holds {self.kind} already ({found[0]}); go on with "
                f"`{typed('carom resume', self.path)}`, choose another folder with --out, or replace "
                "it with --overwrite."
            )

    def make(self) -> None:
        """Make the folder, unless it is there."""
        with writing(self.path):
            self.path.mkdir(parents=True, exist_ok=True)

    def begin(self, plan: SceneFile) -> None:
        """Remove an older run from the folder and write the plan.

        After an interruption the folder starts as the old run, as the new one, or :meth:`check_empty` refuses
        it.
        """
        text = _text(plan)
        with writing(self.path):
            for path in (self.summary, self.checkpoint):
                path.unlink(missing_ok=True)
        write_text(self.scene, text)
        with writing(self.path):
            for path in self._files():
                if path != self.scene and str(path.absolute()) != plan.scene.file:
                    path.unlink(missing_ok=True)
            for name in TABLES:
                if is_table(self.path, name):  # which was measured from the frames of the old run
                    (self.path / f"{name}.csv").unlink()
                    (self.path / f"{name}.png").unlink(missing_ok=True)

    def check_empty(self) -> None:
        """Refuse frames and events, which a run without a checkpoint would replace; no file is changed."""
        found = [path for form in FORMATS if _holds(path := self.trajectory(form), _frames)]
        found += [self.events] if _holds(self.events, _events) else []
        if found:
            raise FileError(
                f"{self.path} has frames or events ({', '.join(path.name for path in found)}), but no "
                "checkpoint to go on from; put checkpoint.h5 back, or begin anew with "
                f"`{typed('carom run', self.scene)} {typed('--out', self.path)} --overwrite`, which "
                "replaces them."
            )

    def check_unedited(self, plan: SceneFile) -> None:
        """Refuse a scene file that was edited since its run, of a plan, began; a missing one is no edit."""
        if not self.scene.exists():
            return
        remedy = f"undo the edit, or remove the file, and `{typed('carom resume', self.path)}` writes it anew"
        try:
            found = SceneFile.load(self.scene)
        except (FileError, InputError) as error:
            raise FileError(f"{str(error).rstrip('.')}; {remedy}.") from None
        if edits := differences(words_of(plan), words_of(found)):
            raise FileError(
                f"{self.scene} was edited since its run began: {edits}. A run goes on as it "
                f"began: {remedy}; `{typed('carom run', self.scene)} --out` with another folder runs "
                "what the file asks for now."
            )

    def restore_scene(self, plan: SceneFile) -> None:
        """Write the plan again if its file is missing."""
        if not self.scene.exists():
            write_text(self.scene, _text(plan))

    def owned(self) -> contextlib.AbstractContextManager[None]:
        """Make the folder, keep other processes out, and remove what a killed one left incomplete."""
        return owned(self.path, {path.name for path in self._files()}.__contains__)


def words_of(plan: SceneFile) -> dict[str, Any]:
    """Return the values of a plan by section and key."""
    parts = {"scene": plan.scene, "run": plan.run}
    return {f"[{name}] {k}": getattr(part, k) for name, part in parts.items() for k in fields_of(type(part))}


def _text(plan: SceneFile) -> str:
    """Return the scene file of a plan."""
    return f"{title('carom run')}\n\n{plan.to_toml()}"


def _holds(path: Path, count: Callable[[Path], int]) -> bool:
    """Return whether a file holds anything by ``count``; a damaged one does, unless it is empty."""
    try:
        return path.is_file() and path.stat().st_size > 0 and count(path) > 0
    except (CaromError, OSError):
        return True


def _frames(path: Path) -> int:
    with open_reader(path, torn=True) as reader:
        return len(reader)


def _events(path: Path) -> int:
    return len(read_events(path, stop=1).i)


def existing_run(path: Path) -> RunFolder:
    """Return the folder of a run that has begun."""
    folder = RunFolder(path)
    try:
        if not path.is_dir():
            expected = "the folder of a run, as `carom run --out` makes it"
            if path.exists() and kind_of(path.parent) is not None:
                expected = f"its folder: `{typed('carom resume', path.parent)}`"
            missing = "is a file" if path.exists() else "does not exist"
            raise FileError(f"{path} {missing}; expected {expected}.")
        if not any(file.is_file() for file in (folder.checkpoint, folder.summary, folder.scene)):
            raise FileError(f"{path} holds nothing of Carom yet; type the command that began there again.")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {reason(error)}.") from error
    return folder
