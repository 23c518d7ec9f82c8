"""Check whether the scene file in the folder of a run is still that of the run."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from carom.errors import FileError, InputError
from carom.scene_file.scene_file import SceneFile


def check_unedited(path: Path, plan: SceneFile) -> None:
    """Refuse a scene file that was edited since its run began; a missing one is no edit."""
    if not path.exists():
        return
    remedy = f"undo the edit, or remove the file, and `carom resume {path.parent}` writes it anew"
    try:
        found = SceneFile.load(path)
    except (FileError, InputError) as error:
        raise FileError(f"{str(error).rstrip('.')}; {remedy}.") from None
    if edits := differences(plan, found):
        raise FileError(
            f"{path} was edited since its run began: {'; '.join(edits)}. A run goes on as it began: "
            f"{remedy}; `carom run {path} --out` with another folder runs what the file asks for now."
        )


def differences(run: SceneFile, file: SceneFile) -> list[str]:
    """Return the keys in which two plans differ, in words."""
    found = []
    for section in dataclasses.fields(SceneFile):
        one, other = getattr(run, section.name), getattr(file, section.name)
        for key in dataclasses.fields(one):
            ran, asks = getattr(one, key.name), getattr(other, key.name)
            if ran != asks:
                found.append(f"[{section.name}] {key.name} is {_shown(asks)}, and the run has {_shown(ran)}")
    return found


def _shown(value: object) -> str:
    """Return a value as text of at most 60 characters."""
    text = "left out" if value is None else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
