"""A run under way: equilibrate, measure, sample, and write a folder from which a killed run can continue."""

from __future__ import annotations

import contextlib
import functools
import math
import tempfile
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from carom import io
from carom.block import Block
from carom.compiling import entry
from carom.errors import FileError, InputError, warn
from carom.frame import Frame
from carom.io.checkpoint import LARGE
from carom.io.formats import Writer
from carom.observables.analysis.layers import Layers
from carom.observables.analysis.precision import FLOOR, Goal, Prediction, block_collisions
from carom.observables.statistics import Estimate, unwarned
from carom.scene.scene import Scene
from carom.scene_file.build import of_frame
from carom.scene_file.scene_file import SceneFile
from carom.simulation.files.checkpoint import size, size_of_file
from carom.simulation.measuring import stretches
from carom.simulation.measuring.depths import deepest, present
from carom.simulation.simulation import Simulation
from carom.simulation.system_of_scene import driven_speed_of
from carom.simulation.tuning import Tuning
from carom.studies.fluid import Fluid
from carom.studies.job import OTHERS, Look, Stopped
from carom.studies.runs import report
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.storage import amount, holdable, without_trajectory
from carom.studies.runs.trajectory_checksums import Written
from carom.studies.signals import Interrupted, Stop
from carom.texts import typed

LONGEST = 1e9
"""Largest length of a run to a relative error [lengths of its pilot]."""

SEGMENTS = 1024
"""Least number of segments of a run: ten times as many as an error bar needs, to resolve correlations."""

PILOT = FLOOR
"""Segments of the pilot that predicts the length of a run to a relative error."""

DIGITS = 12
"""Binary digits of a segment's length: segments begin at its multiples, which are exact in a double."""

Progress = Callable[[float, str], object]
"""Called with the name of the stage and its finished fraction."""

Predicted = Callable[[Prediction], object]
"""Called with the prediction of a run to a relative error."""


@dataclass
class Measured(Fluid):
    """What a checkpoint keeps of a run in addition to the simulation; its blocks are called segments.

    A whole number of segments lies between two frames: one loop serves the pressure, with sums over each
    segment, and the trajectory.
    """

    frames: int = 1  # of a run of given length
    per_frame: int = 1  # segments per frame
    pilot: bool = False  # whether the segments are those of the pilot, which has no frames
    layers: list[Any] = field(default_factory=list)
    """Sums over layers along a field (``carom.observables.layers``), at the ends of segments."""
    overlaps: list[Any] = field(default_factory=list)
    """Time of a frame, and its deepest overlap, of all that were looked at and have one."""
    seconds: float = 0.0  # spent, in all sessions
    engine_began: float = 0.0  # seconds of the engine at the first mark

    @property
    def written(self) -> int:
        """Number of frames written up to the last mark."""
        return 0 if self.pilot else max(self.done, 0) // self.per_frame

    @property
    def engine_seconds(self) -> float:
        """Seconds of the engine in the stretch."""
        return float(self.sim._state.seconds) - self.engine_began

    @property
    def stage(self) -> str:
        """What is done now."""
        return "Pilot" if self.pilot else super().stage

    @property
    def energy_drift(self) -> float:
        """Change of the energy from the first mark to the last, over the kinetic one."""
        half = 0.5 * self.sim.degrees_of_freedom
        first, last = self.marks[0].energy, self.marks[-1].energy
        assert first is not None
        assert last is not None
        change = last.potential + half * last.kT - first.potential - half * first.kT
        return abs(change) / (half * first.kT)

    def begin_segments(self, count: int, duration: float) -> None:
        """Run on to the beginning of a stretch; its segments depend only on the present state."""
        self.wanted, step = count, _rounded(duration / count)
        # Two segments further is later than the present, whatever its rounding.
        stretches.run_to(self.sim, Fraction((math.floor(self.sim.time / step) + 2) * step))
        self.temperatures.clear()
        self.layers.clear()
        self.cut(step)
        self.engine_began = self.sim._state.seconds

    def mark(self) -> Block:
        """Return the sums so far, with what walls and obstacles gave."""
        works = tuple(each.work for each in self.sim.obstacles)
        return super().mark()._replace(surface_changes=(), works=works, momentum_flux=None)


KEPT = tuple(each.name for each in fields(Measured) if each.name not in OTHERS)
"""Names of the fields that a checkpoint keeps."""


class Run(Measured):
    """The simulation, its files, and the sums so far."""

    def __init__(
        self,
        plan: SceneFile,
        folder: RunFolder,
        stop: Stop,
        progress: Progress | None,
        predicted: Predicted | None,
        cores: int | str,
    ):
        super().__init__({})
        self.plan, self.folder, self._stop = plan, folder, stop
        self.cores = cores
        self._progress, self._predicted = progress, predicted
        error = plan.run.relative_error
        self.goal = None if error is None else Goal(error)
        self.writers: list[Writer] = []
        self._before = 0.0  # seconds spent in earlier sessions
        self._began, self._opened = entry.running(), clock.perf_counter()

    # Beginning.

    def from_the_start(self, start: Frame | None = None) -> dict[str, Any]:
        """Run from the initial state, replace an older run in the folder, and return the summary.

        ``start`` is the frame that is not yet written to the file in which the scene has it.
        """
        self.tell(0.0, "Preparing")
        plan = self.plan
        how = plan.run
        scene = plan.build_scene() if start is None else of_frame(plan.scene, start, how.seed, how.kT)
        kT = plan.run.kT if scene.velocities is None else None
        settings: dict[str, Any] = {
            "kT": kT,
            "seed": plan.run.seed,
            "swaps": plan.run.swaps,
            "barostat": plan.run.barostat,
            "tuning": Tuning(neighbors=plan.run.neighbors),
            "cores": self.cores,
        }
        if self.goal is not None:
            _check_pressure(scene, kT)
        with unwarned():  # given below, where the formats are final
            holdable(tuple(plan.run.write or ()), scene.dimension)  # before anything is compiled
        # Before anything is written, because this raises the errors of a scene that cannot be simulated.
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as elsewhere:
            log = Path(elsewhere, self.folder.events.name) if plan.run.event_log else None
            self.sim = Simulation(scene, **settings, event_log=log)
            if size(self.sim._state) > LARGE:
                # The size of the packed lists is known only when they are filled.
                self._compile()
            checkpoint = size_of_file(self.sim._state)
            formats, frames = amount(plan, scene, checkpoint)
            self.formats = holdable(formats, scene.dimension)
            self._compile()
            if log is not None:
                self.sim.close()
        if reason := without_trajectory(plan, scene, self.formats, checkpoint):
            warn(reason)
        self.frames, self.per_frame = frames, math.ceil(SEGMENTS / frames)
        self.wanted = self.per_frame * frames
        self.sums = Written(self.folder, self.formats)
        with self.folder.owned():
            self.folder.begin(plan, start)
            if plan.run.event_log:
                self.sim = Simulation(scene, **settings, event_log=self.folder.events)
            return self._run(lambda form: io.open(self.folder.trajectory(form), "w", scene))

    def from_checkpoint(self, notes: dict[str, Any]) -> dict[str, Any]:
        """Continue from a checkpoint; return the summary."""
        self.tell(0.0, "Preparing")
        with self.folder.owned():
            # All verification comes before any change of a file of the run.
            self.folder.check_unedited(self.plan)
            for name in KEPT:
                setattr(self, name, notes[name])
            self.__post_init__()
            self._before = self.seconds
            self.formats = tuple(notes["written"])
            self.sums = Written(self.folder, self.formats, notes["written"])
            sources = self.sums.sources(self.written, lambda part: self.tell(part, "Verifying"))
            log = self.folder.events if self.plan.run.event_log else None
            own = self.plan.scene.own()
            self.sim = Simulation.load(self.folder.checkpoint, event_log=log, cores=self.cores, **own)
            self.folder.restore_scene(self.plan)
            self._make_anew(sources)
            return self._run(self._continued)

    def _make_anew(self, sources: dict[str, str]) -> None:
        """Restore damaged trajectories from others."""
        for form, source in sources.items():
            path, other = self.folder.trajectory(form), self.folder.trajectory(source)
            warn(f"{path} was damaged or missing, and is made anew from {other.name}.")
            io.rebuild(other, path, self.written)

    def _continued(self, form: str) -> Any:
        """Open a trajectory after the frames of the checkpoint."""
        path, scene, keep = self.folder.trajectory(form), self.sim.scene, self.written
        return io.open(path, "a", scene, keep=keep) if keep else io.open(path, "w", scene)

    def _compile(self) -> None:
        """Predict the first events; this compiles, for some seconds in which Ctrl-C cannot be deferred."""
        self.tell(0.0, "Compiling")
        self.sim.run(time=0.0)
        self.sim.frame()

    # The phases.

    def _run(self, opened: Callable[[str], Any]) -> dict[str, Any]:
        with contextlib.ExitStack() as files:
            files.enter_context(self.sim)
            self._compile()
            files.callback(setattr, self._stop, "deferred", False)
            self._stop.deferred = True
            self.bed = Layers(self.sim.scene, self.layers)
            look = Look(
                lambda: self._stop.asked, self.folder.checkpoint, self, self.tell,
                self.plan.run.checkpoint_every, strict=True,
            )  # fmt: skip
            look.keep(True)  # first: what a kill leaves of a new trajectory is replaced then
            self.writers = [files.enter_context(opened(form)) for form in self.formats]
            try:
                self.go_on(look)
            except Stopped:
                raise self._interrupted() from None
            look.keep(True)
        return self._finish()

    @property
    def target(self) -> int:
        """Collisions of the equilibration."""
        return round(self.plan.run.equilibration * self.sim.n / 2)

    @property
    def kT(self) -> float | None:
        """The temperature to which pairs on steps are brought; an event log holds no scaled velocities."""
        return None if self.plan.run.event_log else self.plan.run.kT

    def prepare(self) -> None:
        """Begin to measure, in equilibrium."""
        asked, n = self.plan.run, self.sim.n
        if asked.time is not None:
            self.begin_segments(self.wanted, asked.time)
        elif asked.collisions_per_particle is None:
            self.pilot = True
            self.begin_segments(PILOT, self._duration(PILOT * block_collisions(n) * 2.0 / n))
        else:
            self.begin_segments(self.wanted, self._duration(asked.collisions_per_particle))

    def step(self, look: Look) -> bool:
        """Equilibrate, or measure a segment, or find out how many it takes; the wall time may be over."""
        limit = self.plan.run.walltime
        late = limit is not None and self._spent() >= limit and self.written > 0  # there is a frame at least
        return not late and super().step(look)

    def block(self, look: Look) -> None:
        """Measure a segment, and write the frame at its end."""
        super().block(look)
        if self.bed.weight is not None:
            self.bed.look(self.sim.frame(), self.sim.kT)
        if not self.pilot and self.done % self.per_frame == 0:
            self._write()

    def length(self) -> int:
        """Return how many segments it takes, which fill frames, when all that were wanted are measured."""
        if self.goal is None:
            return self.done
        with unwarned():  # short runs warn, but this one goes on
            blocks = self.blocks()
            main = report.volume_of(self.sim, blocks) or report.pressure_of(self.sim, blocks)
        found = None if main is None else main.primary  # some never get an error bar
        if self.pilot:
            return self._size_up(found)
        if found is None or self.goal.reached(found):
            return self.done
        self._predict(found, min(self.goal.remaining(found), LONGEST) - 1.0)
        return math.ceil(self.goal.next_look(self.done, found) / self.per_frame) * self.per_frame

    def _duration(self, wanted: float) -> float:
        """Return the time of about the ``wanted`` number of collisions per particle."""
        sim = self.sim
        if sim.scene.n > 1 and sim.kT > 0.0:
            return stretches.time_for(sim, wanted * sim.scene.n / 2)
        # Without collisions, a particle crosses the box in place of every collision.
        speed = math.sqrt(sim.kT / sim.scene.mass)
        return wanted * max(sim.scene.box) / (speed or 1.0)

    def _size_up(self, found: Estimate | None) -> int:
        """Return how many segments the run has that the pilot measured the length of, and begin it."""
        factor = 1.0
        if found is not None and self.goal is not None:
            factor = min(self.goal.remaining(found), LONGEST)
            self._predict(found, factor)
        limit = self.plan.run.walltime
        if limit is not None:
            # The length of a segment follows from the expected stretch, which must not exceed the wall time.
            factor = max(min(factor, limit / self.engine_seconds), 1.0)
        self.pilot = False
        self.begin_segments(self.per_frame * self.frames, factor * self.done * self.duration)
        return self.wanted

    def _predict(self, found: Estimate, more: float) -> None:
        """Report how much is still to come, in lengths of the stretch so far."""
        if self._predicted is not None:
            collisions = self.marks[-1].collisions - self.marks[0].collisions
            seconds = more * self.engine_seconds
            self._predicted(Prediction(found.relative_error, more * collisions, seconds))

    # What the report asks.

    @functools.cached_property
    def measured(self) -> list[Block]:
        """The segments, once all are measured."""
        return self.blocks()

    @property
    def trajectories(self) -> list[Path]:
        """The files with the frames."""
        return [self.folder.trajectory(form) for form in self.formats]

    @property
    def without(self) -> str | None:
        """Why there are no trajectories, if the plan left that open."""
        return without_trajectory(self.plan, self.sim.scene, self.formats, size_of_file(self.sim._state))

    @property
    def wall_seconds(self) -> float:
        """Wall time of all sessions."""
        return self._before + clock.perf_counter() - self._opened

    @functools.cached_property
    def first_places(self) -> np.ndarray | None:
        """Where the particles began, (n, d) [length], scaled to the present box if a barostat changed it.

        None, if the file from which such a run began cannot be read any more.
        """
        scene = self.sim.scene
        if self.plan.run.barostat is None:
            return scene.positions
        try:
            start = self.plan.build_scene()
        except FileError:
            return None
        return start.positions * (np.array(scene.box) / np.array(start.box))

    def _spent(self) -> float:
        """Return the seconds spent, in all sessions, without those of compiling."""
        return self._before + entry.running() - self._began

    def _write(self) -> None:
        frame = self.sim.frame()
        if self.plan.run.check:
            found = deepest(self.sim._state, present(self.sim._state))
            self.overlaps += [] if found is None else [(frame.time, *found)]
        for writer in self.writers:
            writer.write(frame)
        self.sums.add(frame)

    def _finish(self) -> dict[str, Any]:
        try:
            return report.write(self)
        except KeyboardInterrupt:
            raise self._interrupted() from None

    # Between the parts.

    def _interrupted(self) -> Interrupted:
        return Interrupted(f"Stopped; `{typed('carom resume', self.folder.path)}` goes on.")

    def tell(self, fraction: float, text: str) -> None:
        """Report how far the run is, and what it does."""
        if self._progress is not None:
            self._progress(min(max(fraction, 0.0), 1.0), text)

    def notes(self) -> dict[str, Any]:
        """Return what a checkpoint keeps beside the simulation."""
        self.seconds = self._spent()
        return {"plan": self.plan.to_toml(), "written": self.sums.notes(), **super().notes()}


def _rounded(duration: float) -> float:
    """Return the nearest number of ``DIGITS`` binary digits."""
    mantissa, exponent = math.frexp(duration)
    return math.ldexp(round(math.ldexp(mantissa, DIGITS)), exponent - DIGITS)


def _check_pressure(scene: Scene, kT: float | None) -> None:
    """Raise InputError where a run never has a pressure, to whose error it could go.

    ``kT`` is that of velocities to be drawn.
    """
    reason = report.no_pressure(scene)
    rests = kT == 0.0 if scene.velocities is None else not scene.velocities.any()
    if scene.n == 1:
        reason = "One particle has Z = 1 exactly."
    elif rests and driven_speed_of(scene) == 0.0:
        reason = "Nothing moves."
    if reason is not None:
        raise InputError(
            f"[run] relative_error needs a pressure; give collisions_per_particle or time instead. {reason}"
        )
