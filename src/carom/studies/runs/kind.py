"""The folder of a run."""

from __future__ import annotations

from pathlib import Path

from carom.studies.info import Info
from carom.studies.runs.execution import resume as resume
from carom.studies.runs.folder import RunFolder, existing_run
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.texts import typed


def load(folder: Path) -> RunResult:
    """Return the result of a run."""
    return RunResult(folder, read_summary(RunFolder(folder).finished()))


def tell(found: Info, folder: Path) -> None:
    """Add the system and the result, or how far the run is."""
    files = existing_run(folder)
    if files.summary.is_file():
        result = load(folder)
        s = result._found
        found.next = typed("carom view", folder) + (" --trust-code" if result._rules_logged else "")
        found.system(s.n, s.dimension, s.packing_fraction, s.system)
        found.trajectory(folder)
        _, rows = result._rows()
        text = ", ".join(f"{name} = {value}" for name, value in rows)
        words = {k: v for k, v in result._words().items() if k not in found.values}
        found.add("result", text or s.note or "", **words)
    elif files.checkpoint.is_file():
        found.state = "not finished"
        found.checkpoint(files.checkpoint)
        found.trajectory(folder, torn=True)
    else:
        found.state = "not begun"
        found.scene(files.scene, run=True)
