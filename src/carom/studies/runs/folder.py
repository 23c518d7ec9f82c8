"""The folder of a run: the names of its files, how it begins, and what was edited or lost there."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from carom.declared import fields_of
from carom.errors import CaromError, FileError, InputError
from carom.frame import Frame
from carom.io.events import read_events
from carom.io.trajectory import open_reader, open_writer
from carom.layout import kind_at
from carom.paths import reason, replacing, write_text, writing
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import FORMATS
from carom.studies.result_folders import TABLES, ResultFolder, differences, is_table, title
from carom.texts import typed


class RunFolder(ResultFolder):
    """The folder of one run."""

    kind = "a run"
    # Without a summary the run is not finished; without a checkpoint it is not under way.
    files = (
        "summary.json", "checkpoint.h5", "scene.toml", *(f"trajectory.{form}" for form in FORMATS),
        "timing.json", "events.h5", "rdf.csv", "start.h5md", "pressure.png", "rdf.png", "snapshot.png",
    )  # fmt: skip

    def __init__(self, path: Path):
        super().__init__(path)
        self.scene = path / "scene.toml"  # the plan of the run
        self.timing = path / "timing.json"  # its wall times
        self.events = path / "events.h5"  # the event log
        self.rdf = path / "rdf.csv"
        self.start = path / "start.h5md"  # the scene from which a run began that was given as one

    def trajectory(self, form: str) -> Path:
        """Return the trajectory of a format."""
        return self.path / f"trajectory.{form}"

    def begin(self, plan: SceneFile, start: Frame | None = None) -> None:
        """Remove an older run from the folder, and write the plan and the frame from which it is to start.

        After an interruption the folder starts as the old run, as the new one, or :meth:`check_empty` refuses
        it.
        """
        text, old = _text(plan), [self.summary, self.checkpoint]
        with contextlib.ExitStack() as files:
            if start is not None:
                temporary = files.enter_context(replacing(self.start))
                with open_writer(temporary) as writer:
                    writer.write(start)
                old.append(self.scene)  # which may begin from the start of an older run
            with writing(self.path):
                for path in old:
                    path.unlink(missing_ok=True)
        write_text(self.scene, text)
        self.clear(self.scene.absolute(), Path(plan.scene.file or ""))
        with writing(self.path):
            for name in TABLES:
                if is_table(self.path, name):  # which was measured from the frames of the old run
                    (self.path / f"{name}.csv").unlink()
                    (self.path / f"{name}.png").unlink(missing_ok=True)

    def check_empty(self) -> None:
        """Refuse frames and events, which a run without a checkpoint would replace; no file is changed."""
        found = [path.name for path in (*map(self.trajectory, FORMATS), self.events) if _holds(path)]
        if found:
            raise FileError(
                f"{self.path} has frames or events ({', '.join(found)}), but no "
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


def words_of(plan: SceneFile) -> dict[str, Any]:
    """Return the values of a plan by section and key."""
    parts = {"scene": plan.scene, "run": plan.run}
    return {f"[{name}] {k}": getattr(part, k) for name, part in parts.items() for k in fields_of(type(part))}


def _text(plan: SceneFile) -> str:
    """Return the scene file of a plan."""
    return f"{title('carom run')}\n\n{plan.to_toml()}"


def _holds(path: Path) -> bool:
    """Return whether a file holds frames or events; a damaged one does, unless it is empty."""
    try:
        if not path.is_file() or path.stat().st_size == 0:
            return False
        if path.suffix == ".h5":
            return len(read_events(path, stop=1).i) > 0
        with open_reader(path, torn=True) as reader:
            return len(reader) > 0
    except (CaromError, OSError):
        return True


def existing_run(path: Path) -> RunFolder:
    """Return the folder of a run that has begun."""
    folder = RunFolder(path)
    try:
        if not path.is_dir():
            expected = "the folder of a run, as `carom run --out` makes it"
            if path.exists() and kind_at(path.parent) is not None:
                expected = f"its folder: `{typed('carom resume', path.parent)}`"
            missing = "is a file" if path.exists() else "does not exist"
            raise FileError(f"{path} {missing}; expected {expected}.")
        if not any(file.is_file() for file in (folder.checkpoint, folder.summary, folder.scene)):
            raise FileError(f"{path} holds nothing of Carom yet; type the command that began there again.")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {reason(error)}.") from error
    return folder
