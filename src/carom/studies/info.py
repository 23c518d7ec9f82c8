"""What lies at a path: kind, size, result, how far it is, and what to type next. ``carom info``."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from carom.errors import FileError, InputError
from carom.io import checkpoint, events
from carom.io.formats import FOREIGN, SUFFIXES, Reader, foreign_format_of, nameless
from carom.io.records import toml_tables
from carom.io.trajectory import STATES, open_reader
from carom.spec import read
from carom.studies.kind import MOST_LINES, Info
from carom.studies.kind_of_studies import STUDIES, results
from carom.studies.kinds import RESULTS, kind_at
from carom.studies.saved import load
from carom.studies.study import Study
from carom.texts import typed

EXPECTED = (
    "a scene file or study file (.toml), the folder of a run, packing, study or plan, a trajectory "
    f"({', '.join(FOREIGN)}), a checkpoint, an event log, or a saved result (.json, .npz)"
)


def info(path: str | PathLike[str]) -> Info:
    """Return what lies at a path."""
    where = Path(path)
    if where.is_file() and where.name in RESULTS:
        where = where.parent
    if where.is_dir():
        kind = kind_at(where)
        if kind is None:
            raise FileError(f"{where} is a folder without results of Carom; expected {EXPECTED}.")
        return kind.info(where)
    if not where.is_file():
        raise FileError(f"{path} does not exist; expected {EXPECTED}.")
    suffix = where.suffix.lower()
    if suffix == ".toml":
        return _toml(where)
    if suffix in (".json", ".npz"):
        return _saved(where)
    if suffix in (".h5", ".h5md") and checkpoint.is_one(where):
        return _checkpoint(where)
    if events.is_log(where):
        return _log(where)
    if foreign_format_of(where) is None:
        raise FileError(
            f"{path} is nothing that Carom reads; expected {EXPECTED}; if it holds frames, {nameless(where)}."
        )
    with open_reader(where) as reader:
        return of_trajectory(reader)


def of_trajectory(reader: Reader) -> Info:
    """Return what a trajectory holds that is open."""
    where = reader.path
    name = foreign_format_of(where) if reader.foreign else SUFFIXES[where.suffix.lower()]
    found = Info(where, f"a trajectory ({name})", next=typed("carom measure", where))
    found.frames(reader)
    return found


def _toml(path: Path) -> Info:
    try:
        held = toml_tables(read(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    studies = {kind.Spec.section: kind for kind in STUDIES.values()}
    named = next((name for name in ("run", *studies, "plan") if name in held), "run")
    kind = studies.get(named)
    if kind is not None and (named != "pack" or "scene" not in held):
        study = kind(kind.Spec.load(path))
        return results(Info(path, "a study file", next=typed(study.command, path)), study)
    found = Info(path, "a scene file", next=typed(f"carom {named}", path))
    found.scene(path, run=named == "run")
    return found


def _saved(path: Path) -> Info:
    result = load(path)
    found = Info(path, f"a saved result ({type(result).__name__})")
    text = str(result).splitlines()
    found.add("result", "; ".join(text[:MOST_LINES]))
    if isinstance(result, Study):
        found.values |= {"done": len(result.records), "tasks": len(result.tasks)}
    found.next = f"carom.load({str(path)!r}).plot()   (in Python)"
    return found


def _checkpoint(path: Path) -> Info:
    found = Info(path, "a checkpoint")
    found.kept(path)
    beside = path.name in STATES
    found.next = typed("carom resume", path.parent) if beside else f"carom.load({str(path)!r})   (in Python)"
    return found


def _log(path: Path) -> Info:
    found = Info(path, "an event log", next=typed("carom view", path))
    initial = events.read_initial(path)
    count = events.count_events(path)
    if (x := initial.get("positions")) is not None and x.ndim == 2:
        found.system(x.shape[0], x.shape[1], None, None)
    if (box := initial.get("box")) is not None:
        found.box([float(edge) for edge in box], None)
    found.add("events", str(count), events=count)
    return found
