"""The folder of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.studies.kind import Info, Kind
from carom.studies.runs.execution import resume
from carom.studies.runs.folder import RunFolder, existing_run
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.texts import typed


class OfRun(Kind):
    """A run."""

    name = "a run"
    scene = "scene.toml"

    def load(self, folder: Path) -> RunResult:
        """Return the result of a run."""
        summary = RunFolder(folder).summary
        if not summary.is_file():
            raise FileError(
                f"{folder} holds a run that is not finished; `{typed('carom resume', folder)}` goes on."
            )
        return RunResult(folder, read_summary(summary))

    def resume(self, folder: Path, *, cores: int | str | None = None, **how: Any) -> RunResult:
        """Continue a run; ``cores`` are threads."""
        return resume(folder, cores=1 if cores is None else cores, **how)

    def info(self, folder: Path) -> Info:
        """Return the system and the result, or how far the run is."""
        files = existing_run(folder)
        if files.summary.is_file():
            result = self.load(folder)
            s = result.summary
            found = Info(folder, self.name, "finished", next=typed("carom view", folder))
            found.next += " --trust-code" if result._rules_logged else ""
            found.system(s["n"], s["dimension"], s.get("system"), s["packing_fraction"])
            found.trajectory(folder)
            _, rows = result._rows()
            text = ", ".join(f"{name} = {value}" for name, value in rows)
            words = {k: v for k, v in result._words().items() if k not in found.values}
            found.add("result", text or s["note"], **words)
            return found
        found = Info(folder, self.name, "not finished", next=typed("carom resume", folder))
        if files.checkpoint.is_file():
            found.kept(files.checkpoint)
            found.trajectory(folder, torn=True)
        else:
            found.state = "not begun"
            found.scene(files.scene, run=True)
        return found
