"""The folder of a study, and the studies by what their folders say that they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.studies.accuracy.study import Trade
from carom.studies.codes.study import Codes
from carom.studies.coefficients.study import Transport
from carom.studies.eos.study import EquationOfState
from carom.studies.flow.study import ShearFlow
from carom.studies.folder import RESULTS, SETTINGS, Folder
from carom.studies.kind import MOST_LINES, Info, Kind
from carom.studies.packings.study import Packings
from carom.studies.study import REGISTERED, Study
from carom.texts import counted, typed

STUDIES: dict[str, type[Study[Any]]] = {
    kind.Spec.study: kind for kind in (EquationOfState, Transport, ShearFlow, Codes, Packings, Trade)
}
"""The studies of Carom; of those that are REGISTERED some may be of one's own."""


class OfStudy(Kind):
    """A study."""

    name = "a study"
    results = (SETTINGS,)
    report = True

    def load(self, folder: Path) -> Study[Any]:
        """Return a study with what is known so far."""
        name = str(Folder(folder).held()["settings"].get("study"))
        if name not in REGISTERED:
            raise FileError(f"{folder} holds a study of another program ({name!r}); load it there.")
        return REGISTERED[name].load(folder)

    def resume(self, folder: Path, *, cores: Any = None, progress: Any = None, **_: Any) -> Study[Any]:
        """Run what is missing."""
        return self.load(folder).run(out=folder, cores=cores, progress=progress)

    def info(self, folder: Path) -> Info:
        """Return what is asked for, the result, and how far the study is."""
        held = Folder(folder).held()
        name = str(held["settings"].get("study"))
        if name not in REGISTERED:  # the rest is known to its program
            done = len(list((folder / RESULTS).glob("*.json")))
            found = Info(folder, self.name, f"{counted(done, 'run')} done")
            found.add("study", f"{name}, of a program of its own", done=done, study=name)
            found.values |= held["grid"]
            found.next = "the program of the study goes on with it"
            return found
        study = self.load(folder)
        state = "finished" if study.complete else f"not finished: {study.progress} are done"
        command = "carom view" if study.complete else "carom resume"
        return results(Info(folder, self.name, state, next=typed(command, folder)), study)


def results(found: Info, study: Study[Any]) -> Info:
    """Add what a study asks for and what is known of it, and return all."""
    flagged = sum(map(study.table.flagged, study.table)) if study.records else 0
    if flagged:
        found.state += f", {counted(flagged, 'point')} flagged"
    lines = str(study).splitlines()[1:] if study.records else []
    found.add("study", study.title, study=study.spec.study, done=len(study.records), tasks=len(study.tasks))
    for name in study.spec.grid:
        if (value := getattr(study.spec, name)) is not None:
            several = [*value] if isinstance(value, tuple | list) else [value]
            texts = [f"{each:.6g}" if isinstance(each, float) else str(each) for each in several]
            found.add(name.replace("_", " "), ", ".join(texts), **{name: several})
    if lines:
        found.add("result", "; ".join(lines[:MOST_LINES]))
    found.values = {**study.spec.words(), **found.values}
    return found
