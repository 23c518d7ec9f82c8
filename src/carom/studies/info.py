"""What lies at a path: kind, size, result, how far it is, and what to type next. ``carom info``."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom.arithmetic import power
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io import checkpoint, events, records
from carom.io.formats import FOREIGN, SUFFIXES, Reader, foreign_format_of
from carom.io.records import toml_tables
from carom.io.trajectory import FRAMES, STATES, open_reader
from carom.models.interactions.rule_files import RuleFile
from carom.observables.statistics import value_with_error
from carom.scene.description import particles
from carom.scene_file.scene_file import SceneFile
from carom.spec import read
from carom.studies.folder import RESULTS, SETTINGS, Folder
from carom.studies.packings.packing import Packing
from carom.studies.places import kind_of
from carom.studies.planner.outcome import NAME as OUTCOME
from carom.studies.runs.folder import existing_run
from carom.studies.runs.result import RunResult
from carom.studies.runs.summary import read_summary
from carom.studies.saved import STUDIES, load
from carom.studies.study import Study
from carom.texts import axis_name
from carom.theory import ball_volume

EXPECTED = (
    "a scene file or study file (.toml), the folder of a run, packing, study or plan, a trajectory "
    f"({', '.join(FOREIGN)}), a checkpoint, an event log, or a saved result (.json, .npz)"
)

MOST_LINES = 3
"""Lines of the text of a result that are shown."""


@dataclass
class Info:
    """What lies at a path."""

    path: Path
    kind: str  # "a run", "a trajectory (h5md)", ...
    state: str = ""  # whether it is finished, or how far it is; empty for what never runs
    values: dict[str, Any] = field(default_factory=dict)  # numbers and texts by name, as JSON has them
    lines: list[tuple[str, str]] = field(default_factory=list)  # what is shown of them: a name and a text
    next: str = ""  # a command to type next, or a line of Python

    def add(self, name: str, text: str, **values: Any) -> None:
        """Add a line, and the values in it; by default the text is the value."""
        self.lines.append((name, text))
        self.values |= values or {name: text}

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        return {"path": str(self.path), "kind": self.kind, "state": self.state, **self.values,
                "next": self.next}  # fmt: skip

    def __str__(self) -> str:
        head = f"{self.path}: {self.kind}" + (f", {self.state}" if self.state else "")
        lines = [(name, text) for name, text in [*self.lines, ("next", self.next)] if text]
        width = max(len(name) for name, _ in lines)
        shown = [f"{name:<{width}}  {text}" for name, text in lines]
        return "\n".join([head, *shown])


def info(path: str | PathLike[str]) -> Info:
    """Return what lies at a path."""
    where = Path(path)
    if where.is_dir():
        return _folder(where)
    if not where.is_file():
        raise FileError(f"{path} does not exist; expected {EXPECTED}.")
    suffix = where.suffix.lower()
    if suffix == ".toml":
        return _toml(where)
    if where.name in _OF_FOLDER:
        return _folder(where.parent)
    if suffix in (".json", ".npz"):
        return _saved(where)
    if suffix in (".h5", ".h5md") and checkpoint.is_one(where):
        return _checkpoint(where)
    if events.is_log(where):
        return _log(where)
    if foreign_format_of(where) is None:
        raise FileError(f"{path} is nothing that Carom reads; expected {EXPECTED}.")
    with open_reader(where) as reader:
        return of_trajectory(reader)


def of_trajectory(reader: Reader) -> Info:
    """Return what a trajectory holds that is open."""
    where = reader.path
    name = foreign_format_of(where) if reader.foreign else SUFFIXES[where.suffix.lower()]
    found = Info(where, f"a trajectory ({name})", next=_typed("carom measure", where))
    _frames(found, reader)
    return found


_REACHED = records.table(
    {
        "quantity": records.text,
        "value": records.number(),
        "reached": records.table({"error": records.number(low=0.0)}),
    }
)

_OF_FOLDER = ("summary.json", "study.json", "plan.json", "outcome.json")


def _typed(command: str, path: Path) -> str:
    return f"{command} {shlex.quote(str(path))}"


def _folder(folder: Path) -> Info:
    kind = kind_of(folder)
    known: dict[str, Callable[[Path], Info]] = {
        "a packing": _packing, "a plan": _plan, "a study": _study, "a run": _run,
    }  # fmt: skip
    if kind is not None:
        return known[kind](folder)
    if any((folder / name).is_file() for name in ("summary.json", "scene.toml")):
        return _run(folder)
    raise FileError(f"{folder} is a folder without results of Carom; expected {EXPECTED}.")


def _run(path: Path) -> Info:
    folder = existing_run(path)
    if folder.summary.is_file():
        result = RunResult(path, read_summary(folder.summary))
        s = result.summary
        found = Info(path, "a run", "finished", next=_typed("carom view", path))
        found.next += " --trust-code" if result._rules_logged else ""
        _system(found, s["n"], s["dimension"], s.get("system"), s["packing_fraction"])
        _trajectory(found, path)
        _, rows = result._rows()
        text = ", ".join(f"{name} = {value}" for name, value in rows)
        found.add(
            "result", text or s["note"], **{k: v for k, v in result._words().items() if k not in found.values}
        )
        return found
    found = Info(path, "a run", "not finished", next=_typed("carom resume", path))
    if not folder.checkpoint.is_file():
        found.state = "not begun"
        _scene(found, folder.scene, run=True)
        return found
    _state(found, folder.checkpoint)
    _trajectory(found, path, torn=True)
    return found


def _packing(path: Path) -> Info:
    if (path / "summary.json").is_file():
        packing: Packing = load(path)
        found = Info(path, "a packing", "finished", next=_typed("carom view", path))
        _frame(found, packing.frame)
        words = packing.to_dict()
        jammed = words.get("jamming_fraction")
        text = f"packing fraction {packing.packing_fraction:.6g}, {packing.note}"
        found.add("result", text, packing_fraction=packing.packing_fraction, Z=words["Z"], note=packing.note,
                  jamming_fraction=jammed)  # fmt: skip
        return found
    found = Info(path, "a packing", "not finished", next=_typed("carom resume", path))
    if (path / "compression.h5").is_file():
        _state(found, path / "compression.h5")
    return found


def _study(path: Path) -> Info:
    held = Folder(path).read()
    if held is not None and held["settings"].get("study") not in STUDIES:
        return _own_study(path, held)
    study: Study[Any] = load(path)
    state = "finished" if study.complete else f"not finished: {study.progress} are done"
    command = "carom view" if study.complete else "carom resume"
    found = Info(path, "a study", state, next=_typed(command, path))
    return _results(found, study)


def _own_study(path: Path, held: dict[str, Any]) -> Info:
    """Return what a folder of a study of one's own tells; the rest is known to its program."""
    done = len(list((path / RESULTS).glob("*.json")))
    found = Info(path, "a study", f"{done} run{'s' if done != 1 else ''} done")
    found.add("study", f"{held['settings'].get('study')}, of a program of its own", done=done,
              study=str(held["settings"].get("study")))  # fmt: skip
    found.values |= held["grid"]
    found.next = "the program of the study goes on with it"
    return found


def _results(found: Info, study: Study[Any]) -> Info:
    flagged = sum(map(study.table.flagged, study.table)) if study.records else 0
    if flagged:
        found.state += f", {flagged} point{'s' if flagged > 1 else ''} flagged"
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


def _plan(path: Path) -> Info:
    plan = load(path)
    ready = (path / OUTCOME).is_file()
    state = "finished" if ready else "not run"
    found = Info(path, "a plan", state, next=_typed("carom view" if ready else "carom resume", path))
    for name, text in zip(("target", "promise", "cost"), plan._lines(), strict=False):
        found.add(name, text.removeprefix("promised "))
    found.values |= {"n": plan.design.n, "replicas": plan.design.replicas}
    if (path / SETTINGS).is_file() and not ready:
        done = len(list((path / RESULTS).glob("*.json")))
        found.state = f"not finished: {done} of {plan.design.replicas} runs are done"
    if ready:
        words = records.read_json(path / OUTCOME, _REACHED, "the outcome of a plan", "run the plan again")
        value, error = words["value"], words["reached"]["error"]
        text = f"{words['quantity']} = {value_with_error(value, error)} for infinitely many, bias included"
        found.add("result", text, value=value, error=error)
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
        return _results(Info(path, "a study file", next=_typed(study.command, path)), study)
    found = Info(path, "a scene file", next=_typed(f"carom {named}", path))
    _scene(found, path, run=named == "run")
    return found


def _scene(found: Info, path: Path, *, run: bool) -> None:
    """Add what a scene file says."""
    plan = SceneFile.load(path)
    spec = plan.scene
    n, d, eta = spec.n, spec.dimension, spec.packing_fraction
    if n is None or (d is None and spec.box is None) or spec.lattice or spec.file:
        try:
            scene = plan.build_scene()
            n, d, eta = scene.n, scene.dimension, scene.packing_fraction
        except InputError:
            if not isinstance(spec.interaction, RuleFile):  # whose code does not run here
                raise
    elif d is None:
        d = len(spec.box or ()) or None
    if n is not None and d is not None:
        _system(found, n, d, None, eta)
    if spec.density is not None:
        found.add("density", f"{spec.density:g}", density=spec.density)
    if not run:
        return
    asked = plan.run
    if asked.relative_error is not None:
        length = f"relative error {asked.relative_error:g}"
    elif asked.time is not None:
        length = f"time {asked.time:g}"
    else:
        length = f"{asked.collisions_per_particle:g} collisions per particle"
    names = ("seed", "collisions_per_particle", "time", "relative_error")
    found.add("run", f"{length}, seed {asked.seed}", **{name: getattr(asked, name) for name in names})


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
    _state(found, path)
    beside = path.name in STATES
    found.next = _typed("carom resume", path.parent) if beside else f"carom.load({str(path)!r})   (in Python)"
    return found


def _state(found: Info, path: Path) -> None:
    """Add the system of a checkpoint."""
    arrays, attributes = checkpoint.load(path)
    try:
        n, d = arrays["scene.positions"].shape
        scene = json.loads(attributes["scene"])
        box = [float(edge) for edge in scene["box"]]
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} is not the checkpoint of a simulation: {error!r}.") from None
    _system(found, n, d, None, None)
    _box(found, box, None)


def _log(path: Path) -> Info:
    found = Info(path, "an event log", next=_typed("carom view", path))
    initial = events.read_initial(path)
    count = events.count_events(path)
    if (x := initial.get("positions")) is not None and x.ndim == 2:
        _system(found, x.shape[0], x.shape[1], None, None)
    if (box := initial.get("box")) is not None:
        _box(found, [float(edge) for edge in box], None)
    found.add("events", str(count), events=count)
    return found


def _trajectory(found: Info, folder: Path, *, torn: bool = False) -> None:
    """Add box and frames of the trajectory in a folder, if it has one."""
    if not any((folder / name).is_file() for name in FRAMES):
        found.add("frames", "none", frames=0)
        return
    with open_reader(folder, torn=torn) as reader:
        _frames(found, reader)


def _frames(found: Info, reader: Reader) -> None:
    """Add the system of the first frame, if it is not known yet, and how many frames there are and when."""
    count = len(reader)
    if not count:
        found.add("frames", "none", frames=0)
        return
    first, last = reader[0], reader[-1]
    _frame(found, first)
    text = f"{count}" if first.time == last.time else f"{count}, times {first.time:.6g} to {last.time:.6g}"
    found.add("frames", text, frames=count, times=[first.time, last.time])


def _frame(found: Info, frame: Frame) -> None:
    if "n" not in found.values:
        d = frame.dimension
        filled = ball_volume(d) * float(np.sum(power(frame.diameters, d)))
        _system(found, frame.n, d, None, filled / math.prod(frame.box))
    _box(found, list(frame.box), frame.periodic, frame.tilt)


def _system(found: Info, n: int, dimension: int, system: str | None, eta: float | None) -> None:
    """Add particles, dimension and packing fraction."""
    what = system or particles(dimension, n)
    text = f"{n} {what} in {dimension} dimension{'s' if dimension > 1 else ''}"
    values: dict[str, Any] = {"n": n, "dimension": dimension}
    if eta is not None and math.isfinite(eta):
        text += f", packing fraction {eta:.6g}"
        values["packing_fraction"] = eta
    found.add("particles", text, **values)


def _box(found: Info, box: list[float], periodic: tuple[bool, ...] | None, tilt: float | None = None) -> None:
    """Add the edges of the box, its tilt, and which axes have walls."""
    found.lines = [line for line in found.lines if line[0] != "box"]  # frames know more than a checkpoint
    text = " x ".join(f"{edge:.6g}" for edge in box)
    values: dict[str, Any] = {"box": box}
    if periodic is not None:
        walls = [axis_name(k) for k, wraps in enumerate(periodic) if not wraps]
        text += f", walls along {', '.join(walls)}" if walls else ", periodic"
        values["periodic"] = [bool(each) for each in periodic]
    if tilt is not None:
        text += f", tilt {tilt:.6g}"
        values["tilt"] = tilt
    found.add("box", text, **values)
