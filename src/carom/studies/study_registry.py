"""The folder of a study, and the studies by what their folders say that they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.errors import FileError
from carom.studies.eos.study import EquationOfState
from carom.studies.folder import Folder
from carom.studies.info import Info
from carom.studies.packings.study import Packings
from carom.studies.shear.study import ShearFlow
from carom.studies.spherical_codes.study import Codes
from carom.studies.study import REGISTERED, Study
from carom.studies.trade.study import Trade
from carom.studies.transport.study import Transport
from carom.texts import counted

STUDIES: dict[str, type[Study[Any]]] = {
    kind.Spec.study: kind for kind in (EquationOfState, Transport, ShearFlow, Codes, Packings, Trade)
}
"""The studies of Carom; of those that are REGISTERED some may be of one's own."""


def load(folder: Path) -> Study[Any]:
    """Return a study with what is known so far."""
    name = Folder(folder).study()
    if name not in REGISTERED:
        raise FileError(f"{folder} holds a study of another program ({name!r}); load it there.")
    return REGISTERED[name].load(folder)


def resume(folder: Path, *, cores: Any, progress: Any, **_: Any) -> Study[Any]:
    """Run what is missing."""
    return load(folder).run(out=folder, cores=cores, progress=progress)


def tell(found: Info, folder: Path) -> None:
    """Add what is asked for, the result, and how far the study is."""
    files = Folder(folder)
    if (name := files.study()) not in REGISTERED:  # the rest is known to its program
        found.state = f"{counted(done := files.done(), 'run')} done"
        found.add("study", f"{name}, of a program of its own", done=done, study=name)
        found.values |= files.held()["grid"]
        found.next = "the program of the study goes on with it"
        return
    study = load(folder)
    if not study.complete:
        found.state = f"not finished: {study.progress} are done"
    results(found, study)


def results(found: Info, study: Study[Any]) -> None:
    """Add what a study asks for and what is known of it."""
    flagged = sum(map(study.table.flagged, study.table)) if study.records else 0
    if flagged:
        found.state += f", {counted(flagged, 'point')} flagged"
    found.add("study", study.title, study=study.spec.study, done=len(study.records), tasks=len(study.tasks))
    for name in study.spec.grid:
        if (value := getattr(study.spec, name)) is not None:
            several = [*value] if isinstance(value, tuple | list) else [value]
            texts = [f"{each:.6g}" if isinstance(each, float) else str(each) for each in several]
            found.add(name.replace("_", " "), ", ".join(texts), **{name: several})
    found.result(str(study).splitlines()[1:] if study.records else [])
    found.values = {**study.spec.words(), **found.values}
