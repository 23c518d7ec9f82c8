"""The folder of a packing."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import FileError, InputError
from carom.io import records
from carom.io.trajectory import open_reader
from carom.models.files.tables import from_table
from carom.notebook import watchable
from carom.studies.info import Info
from carom.studies.packings.compression import Compression, PackingFolder
from carom.studies.packings.pack import carried_out
from carom.studies.packings.packing import HISTORY, Packing

_SUMMARY = records.table(
    {
        "n": records.integer(low=1),
        "note": records.text,
        "seed": records.integer(),
        "shrunk": records.number(low=0.0),
        "obstacles": records.listed(records.anything),
    }
)


def load(folder: Path) -> Packing:
    """Return a packing that is finished."""
    summary = PackingFolder(folder).finished()
    found = records.read_json(summary, _SUMMARY, "the summary of a packing", "pack again")
    with open_reader(folder) as reader:
        frame = reader[-1]
    try:
        obstacles = tuple(from_table(table, "obstacle") for table in found["obstacles"])
    except InputError as error:
        raise FileError(f"{summary}: {error}") from None
    history = _history(folder / "history.csv")
    return Packing(frame, history, found["note"], found["seed"], found["shrunk"], obstacles)


@watchable("Packing")
def resume(folder: Path, *, progress: Any = None, **_: Any) -> Packing:
    """Continue a packing; the result is bit-identical to an uninterrupted one."""
    files = PackingFolder(folder)
    with files.owned():
        return carried_out(Compression.load({}, files.checkpoint), files, progress)


def tell(found: Info, folder: Path) -> None:
    """Add the packing, or how far it is."""
    files = PackingFolder(folder)
    if not files.summary.is_file():
        found.state = "not finished"
        if files.checkpoint.is_file():
            found.checkpoint(files.checkpoint)
        return
    packing = load(folder)
    found.frame(packing.frame)
    words = packing.to_dict()
    text = f"packing fraction {packing.packing_fraction:.6g}, {packing.note}"
    found.add("result", text, packing_fraction=packing.packing_fraction, Z=words["Z"],
              note=packing.note, jamming_fraction=words.get("jamming_fraction"))  # fmt: skip


def _history(path: Path) -> np.ndarray:
    """Return the record of a compression from its table."""
    names = HISTORY.names or ()
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [tuple(float(row[name]) for name in names) for row in csv.DictReader(file)]
        return np.array(rows, HISTORY)
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise FileError(f"{path} is not the history of a packing ({error}); pack again.") from None
