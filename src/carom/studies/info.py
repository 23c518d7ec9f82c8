"""What ``carom info`` says of a path, and how it is put together."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from carom.arithmetic import power
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.io import checkpoint, events
from carom.io.formats import SUFFIXES, Reader, foreign_format_of
from carom.io.trajectory import open_reader
from carom.layout import FRAMES
from carom.models.interactions.rule_files import RuleFile
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import LENGTHS
from carom.texts import axis_name, particles, typed
from carom.theory import ball_volume

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

    def system(self, n: int, dimension: int, eta: float | None = None, system: str | None = None) -> None:
        """Add particles, dimension and packing fraction."""
        what = system or particles(dimension, n)
        text = f"{n} {what} in {dimension} dimension{'s' if dimension > 1 else ''}"
        values: dict[str, Any] = {"n": n, "dimension": dimension}
        if eta is not None and math.isfinite(eta):
            text += f", packing fraction {eta:.6g}"
            values["packing_fraction"] = eta
        self.add("particles", text, **values)

    def box(
        self, box: list[float], periodic: tuple[bool, ...] | None = None, tilt: float | None = None
    ) -> None:
        """Add the edges of the box, its tilt, and which axes have walls."""
        self.lines = [line for line in self.lines if line[0] != "box"]  # frames know more than a checkpoint
        text = " x ".join(f"{edge:.6g}" for edge in box)
        values: dict[str, Any] = {"box": box}
        if periodic is not None:
            walls = [axis_name(k) for k, wraps in enumerate(periodic) if not wraps]
            text += f", walls along {', '.join(walls)}" if walls else ", periodic"
            values["periodic"] = [bool(each) for each in periodic]
        if tilt is not None:
            text += f", tilt {tilt:.6g}"
            values["tilt"] = tilt
        self.add("box", text, **values)

    def frame(self, frame: Frame) -> None:
        """Add the system of a frame, if it is not known yet, and the box."""
        if "n" not in self.values:
            d = frame.dimension
            filled = ball_volume(d) * float(np.sum(power(frame.diameters, d)))
            self.system(frame.n, d, filled / math.prod(frame.box))
        self.box(list(frame.box), frame.periodic, frame.tilt)

    def frames(self, reader: Reader) -> None:
        """Add the system of the first frame, if it is not known yet, and number and times of frames."""
        count = len(reader)
        if not count:
            self.add("frames", "none", frames=0)
            return
        first, last = reader[0], reader[-1]
        self.frame(first)
        text = f"{count}"
        if first.time != last.time:
            text += f", times {first.time:.6g} to {last.time:.6g}"
        self.add("frames", text, frames=count, times=[first.time, last.time])

    def trajectory(self, folder: Path, *, torn: bool = False) -> None:
        """Add box and frames of the trajectory in a folder, if it has one."""
        if not any((folder / name).is_file() for name in FRAMES):
            self.add("frames", "none", frames=0)
            return
        with open_reader(folder, torn=torn) as reader:
            self.frames(reader)

    def result(self, lines: list[str]) -> None:
        """Add the first lines of the text of a result, if there are any."""
        if lines:
            self.add("result", "; ".join(lines[:MOST_LINES]))

    def log(self, path: Path) -> None:
        """Add the system and the number of events of an event log."""
        initial, count = events.read_initial(path), events.count_events(path)
        if (x := initial.get("positions")) is not None and x.ndim == 2:
            self.system(*x.shape)
        if (box := initial.get("box")) is not None:
            self.box([float(edge) for edge in box])
        self.add("events", str(count), events=count)

    def checkpoint(self, path: Path) -> None:
        """Add the system of a checkpoint."""
        arrays, attributes = checkpoint.load(path)
        try:
            n, d = arrays["scene.positions"].shape
            scene = json.loads(attributes["scene"])
            box = [float(edge) for edge in scene["box"]]
        except (KeyError, TypeError, ValueError) as error:
            raise FileError(f"{path} is not the checkpoint of a simulation: {error!r}.") from None
        self.system(n, d)
        self.box(box)

    def scene(self, path: Path, *, run: bool) -> None:
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
            self.system(n, d, eta)
        if spec.density is not None:
            self.add("density", f"{spec.density:g}", density=spec.density)
        if not run:
            return
        asked = plan.run
        length = (
            f"relative error {asked.relative_error:g}" if asked.relative_error is not None
            else f"time {asked.time:g}" if asked.time is not None
            else f"{asked.collisions_per_particle:g} collisions per particle"
        )  # fmt: skip
        words = {name: getattr(asked, name) for name in ("seed", *LENGTHS)}
        self.add("run", f"{length}, seed {asked.seed}", **words)


def of_trajectory(reader: Reader) -> Info:
    """Return what a trajectory holds that is open."""
    where = reader.path
    name = foreign_format_of(where) if reader.foreign else SUFFIXES[where.suffix.lower()]
    found = Info(where, f"a trajectory ({name})", next=typed("carom measure", where))
    found.frames(reader)
    return found
