"""Frames at a path: of a trajectory file, or of the folder of a run."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.io.formats import Reader
from carom.io.trajectory import open_reader

FORMATS = ("h5md", "gsd", "extxyz")
"""Of the trajectory in the folder of a run, the fastest to read first."""


def open_frames(path: str | os.PathLike[str], **given: Any) -> Reader:
    """Open the trajectory at a ``path``, or that of a run whose folder it is; see :func:`carom.open`.

    Raises
    ------
    FileError
        If there is none.
    """
    path = Path(path)
    if not path.is_dir():
        return open_reader(path, **given)
    for form in FORMATS:
        if (path / f"trajectory.{form}").exists():
            return open_reader(path / f"trajectory.{form}")
    raise FileError(f"{path} holds no trajectory; write frames with the run, or name another folder.")
