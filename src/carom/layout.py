"""What a folder of results is: one table of their kinds, for all that reads, writes and continues them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Kind:
    """A kind of folders of results."""

    name: str  # in words
    marks: tuple[str, ...]  # files by which it is known; `carom resume` goes on from the first
    scene: str = ""  # the file that says what its frames are of
    report: bool = False  # whether `carom view` shows its page of tables and pictures, and no frames
    grows: bool = False  # whether diameters differ from frame to frame, so that only the last is measured


KINDS = {
    kind.name: kind
    for kind in (
        Kind(
            "a run",
            ("checkpoint.h5", "trajectory.h5md", "trajectory.extxyz", "trajectory.gsd", "events.h5"),
            scene="scene.toml",
        ),
        Kind("a packing", ("compression.h5", "packing.h5md", "packing.extxyz"), grows=True),
        Kind("a plan", ("plan.json", "outcome.json")),  # and the study of its runs, if it was run
        Kind("a study", ("study.json",), report=True),
    )
}
"""By their names, in the order in which a folder is asked."""

_MARKS = [name for kind in KINDS.values() for name in kind.marks]

FRAMES = tuple(name for name in _MARKS if name.startswith(("trajectory.", "packing.")))
"""Trajectories in the folder of a run or of a packing; the first that exists is read."""

STATES = tuple(kind.marks[0] for kind in KINDS.values() if kind.marks[0].endswith(".h5"))
"""Checkpoints in the folder of a run and of a packing, which `carom resume` continues."""

SUMMARY = "summary.json"
"""File of the results of a run or a packing."""

RESULTS = {SUMMARY, *(name for name in _MARKS if name.endswith(".json"))}
"""Files of results, which stand for their folder."""


def scene_at(path: Path) -> Path | None:
    """Return the file that says what the frames at a path are of, a folder or a file in it; None without."""
    folder = path if path.is_dir() else path.parent
    kind = kind_at(folder)
    file = folder / kind.scene if kind is not None and kind.scene else None
    return file if file is not None and file.is_file() else None


def marks_in(folder: Path, kind: Kind) -> list[str]:
    """Return the files in a folder by which it is of a kind."""
    return [name for name in kind.marks if os.path.lexists(folder / name)]


def kind_at(folder: Path) -> Kind | None:
    """Return the kind of a folder; None if nothing of Carom is there, or if it is none.

    A run that has only a summary or a scene file is one, too.
    """
    found = next((kind for kind in KINDS.values() if marks_in(folder, kind)), None)
    run = KINDS["a run"]
    return run if not found and any((folder / name).is_file() for name in (SUMMARY, run.scene)) else found
