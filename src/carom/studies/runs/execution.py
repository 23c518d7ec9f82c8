"""What ``carom run`` does: equilibrate, measure, sample and write a folder, from which a killed run goes on.

The measured stretch is cut into segments of equal time, a whole number of them to a frame, so that one loop
serves the pressure, which needs the sums over each segment, and the trajectory, which needs the frames
between them.

Times are chosen so that a resumed run sees the same bits: the length of a segment has 12 binary digits,
segments begin at its multiples, and are run in parts of 1/1024. All of these times are exact in a double, so
it does not matter where a run was cut.
"""

from __future__ import annotations

import contextlib
import json
import math
import time as clock
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from carom import io
from carom.block import Block
from carom.errors import CaromWarning, FileError, InputError
from carom.io import checkpoint
from carom.io.trajectory import Writer
from carom.notebook import by_stage, table, watchable
from carom.observables.momentum_balance import weighted_momenta
from carom.observables.precision import FLOOR, Goal, Prediction, block_collisions
from carom.observables.statistics import Estimate
from carom.plan.plan import Plan
from carom.scene.scene import Scene
from carom.simulation.equipartition import Thermometer
from carom.simulation.simulation import Simulation
from carom.studies.runs.edited import check_unedited
from carom.studies.runs.folder import RunFolder, existing_run
from carom.studies.runs.storage import amount
from carom.studies.runs.written import Written
from carom.studies.signals import Interrupted, Stop, stoppable

SEGMENTS = 1024
"""Segments of a run, at least: ten times what an error bar needs, so that correlations are seen."""

PILOT = FLOOR
"""Segments of the pilot that finds out how long a run to a relative error takes."""

LONGEST = 1e9
"""Pilots that a run to a relative error may last."""

PARTS = 1024
"""Parts of a segment: 1024 segments of 1024 parts leave none that takes long in a run of days."""

DIGITS = 12
"""Binary digits of a segment's length."""

QUICK, SLOW = 0.02, 0.06
"""Seconds that the engine runs between two looks at Ctrl-C: longer than a look takes, too short to notice."""

LARGEST_EXTENDED = 3
"""Dimensions that formats other than H5MD can hold."""

KEPT = (
    "seconds", "engine_seconds", "equilibrated", "first", "step", "marks", "temperatures", "part", "segments",
    "pilot", "frames", "per_frame",
)  # fmt: skip
"""What a checkpoint keeps of a run under way, by the names of its attributes."""

Progress = Callable[[str, float], object]
"""Called with what is being done and the fraction of it that is done."""

Predicted = Callable[[Prediction], object]
"""Called when a run to a relative error knows how long it will take."""


@dataclass(frozen=True)
class RunResult:
    """A finished run.

    Attributes
    ----------
    folder : Path
        Where its files are.
    summary : dict
        What ``summary.json`` holds.
    new : bool
        Whether anything was left to do.
    """

    folder: Path
    summary: dict[str, Any]
    new: bool

    def _repr_html_(self) -> str:
        names = ("compressibility_factor", "reduced_pressure", "contact_value", "collision_rate")
        values = {name: self.summary[name] for name in names if self.summary[name]["mean"] is not None}
        shown = [(name.replace("_", " "), _with_error(value)) for name, value in values.items()]
        return table(f"Run of {self.summary['n']} particles in {self.folder}", shown)


def _with_error(value: dict[str, Any]) -> str:
    """Return a mean and its error as they stand in a summary."""
    error = math.inf if value["error"] is None else value["error"]
    return Estimate(value["mean"], error, 0.0, 0.0, 0).value_text.replace("+-", "±")


@watchable("Running", by_stage)
def run(
    plan: Plan | None = None,
    out: str | PathLike[str] = "carom-run",
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    workers: int | str = 1,
) -> RunResult:
    """Run a plan and write its results to a folder.

    Parameters
    ----------
    plan : Plan, optional
        By default 2048 hard spheres at packing fraction 0.45.
    out : path
        The folder; made if needed.
    overwrite : bool
        Whether a run that the folder holds may be replaced.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; changes no bit of the run. True shows a bar.
    predicted : callable, optional
        Called with a :class:`carom.observables.Prediction` when the plan asks for a relative error.
    workers : int or "auto"
        Threads, as in :class:`carom.Simulation`; they change no bit of the run.

    Returns
    -------
    RunResult

    Raises
    ------
    InputError
        If the plan cannot be carried out; nothing was touched then.
    FileError
        If the folder holds a run, or cannot be written; after a full disk, :func:`resume` goes on.
    Interrupted
        After Ctrl-C or SIGTERM, with everything kept that :func:`resume` needs. A KeyboardInterrupt.

    Notes
    -----
    The folder then holds ``scene.toml``, ``trajectory.*``, ``rdf.csv``, ``summary.json``, three pictures,
    ``checkpoint.h5`` and, if asked for, ``events.h5``.
    """
    plan = Plan() if plan is None else plan
    folder = RunFolder(Path(out))
    folder.check_free(overwrite)
    with stoppable() as stop:
        return _Run(plan, folder, stop, progress, predicted, workers).from_the_start()


@watchable("Running", by_stage)
def resume(
    out: str | PathLike[str],
    *,
    progress: Progress | None = None,
    predicted: Predicted | None = None,
    workers: int | str = 1,
) -> RunResult:
    """Go on with the run in a folder; its results are those of the uninterrupted run, bit for bit.

    Parameters
    ----------
    out : path
        The folder of the run.
    progress, predicted : callable, optional
        As in :func:`run`.
    workers : int or "auto"
        Threads; as many as the run had before, or any other number.

    Returns
    -------
    RunResult
        With ``new=False`` if the run was finished already.

    Raises
    ------
    FileError
        If the folder holds no run, another process is running in it, or its checkpoint is damaged or of
        another version of Carom; if its scene file was edited; if a file that the run wrote is damaged and
        cannot be made anew. Nothing in the folder was changed then.
    Interrupted
        As in :func:`run`.

    Warns
    -----
    CaromWarning
        If a trajectory is damaged or missing, and was made anew from another.

    Notes
    -----
    Before a byte is changed, everything is verified: the checkpoint, and by the checksums that it keeps the
    frames and events that had been written when it was.
    """
    folder = existing_run(Path(out))
    if folder.summary.is_file():
        _check_finished(folder)
        return RunResult(folder.path, _read_summary(folder.summary), new=False)
    with stoppable() as stop:
        if not folder.checkpoint.is_file():
            begun = Plan.load(folder.scene)
            return _Run(begun, folder, stop, progress, predicted, workers).from_the_start()
        plan, notes = _noted(folder.checkpoint)
        return _Run(plan, folder, stop, progress, predicted, workers).from_checkpoint(notes)


def _noted(path: Path) -> tuple[Plan, dict[str, Any]]:
    """Return the plan and the notes that the checkpoint of a run keeps."""
    _, attributes = checkpoint.load(path)
    try:
        notes = json.loads(attributes["extra"])
        if missing := {*KEPT, "written"} - {*notes}:
            raise ValueError(f"it has no {min(missing)}")
        return Plan.from_toml(notes["plan"]), notes
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} is not the checkpoint of a run: {error}.") from None


def _check_finished(folder: RunFolder) -> None:
    """Refuse a scene file that is not that of the summary beside it, as far as the checkpoint can tell."""
    try:
        plan, _ = _noted(folder.checkpoint)
    except FileError:
        return  # A finished run needs no checkpoint.
    check_unedited(folder.scene, plan)


def _read_summary(path: Path) -> dict[str, Any]:
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(summary, dict):
            raise ValueError("it holds no table")
    except (OSError, ValueError) as error:
        raise FileError(f"{path} is not the summary of a run ({error}); remove it to make it anew.") from None
    return summary


class _Run:
    """A run under way: the simulation, its files, and what has been counted.

    Attributes
    ----------
    seconds : float
        Seconds spent, in all sessions; `engine_seconds` those in the engine since the equilibration.
    equilibrated : tuple of int and float, or None
        Collisions and time of the equilibration, once it is over.
    first, step : int, float
        The measured stretch begins at the time ``first * step``; a segment lasts `step`.
    marks : list of (int, float, ...)
        Collisions and virial so far at the beginning of every segment reached; with walls or obstacles also
        what each took up so far, and the weighted momentum that belongs to each then.
    temperatures : list of tuple of float
        Temperatures of species at the end of every segment, if their masses differ.
    part : int
        Parts done of the present segment.
    segments, per_frame, frames : int
        Segments to measure, as far as is known yet; segments to a frame; frames of a run whose length is
        given.
    workers : int or "auto"
        Threads that run the simulation.
    formats : tuple of str
        Of the trajectories.
    pilot : bool
        Whether the segments are those of the pilot, which has no frames.
    """

    def __init__(
        self,
        plan: Plan,
        folder: RunFolder,
        stop: Stop,
        progress: Progress | None,
        predicted: Predicted | None,
        workers: int | str,
    ):
        self.plan, self.folder, self.stop = plan, folder, stop
        self.workers = workers
        self._progress, self._predicted = progress, predicted
        error = plan.run.relative_error
        self.goal = None if error is None else Goal(error)
        self.pilot = False
        self.sim: Simulation
        self.writers: list[Writer] = []
        self.seconds = self.engine_seconds = 0.0
        self.equilibrated: tuple[int, float] | None = None
        self.first, self.step = 0, 0.0
        self.marks: list[tuple[Any, ...]] = []
        self.temperatures: list[tuple[float, ...]] = []
        self.part = 0
        self._began = self._due = clock.perf_counter()

    # Beginning.

    def from_the_start(self) -> RunResult:
        """Run from the initial state, in place of what the folder holds."""
        self._report("Preparing", 0.0)
        plan = self.plan
        scene = plan.build_scene()
        self._keep(scene)
        self.written = Written(self.folder, self.formats)
        kT = plan.scene.kT if scene.velocities is None else None
        settings: dict[str, Any] = {
            "kT": kT,
            "seed": plan.run.seed,
            "neighbors": plan.run.neighbors,
            "workers": self.workers,
        }
        # Made before anything is written, because it refuses what cannot be simulated.
        self.sim = Simulation(scene, **settings)
        self.folder.make()
        with self.folder.owned():
            self.folder.sweep()
            self.folder.begin(plan)
            if plan.output.event_log:
                self.sim = Simulation(scene, **settings, event_log=self.folder.events)
            return self._run(lambda form: io.open(self.folder.trajectory(form), "w", scene))

    def from_checkpoint(self, notes: dict[str, Any]) -> RunResult:
        """Run on from a checkpoint."""
        self._report("Preparing", 0.0)
        with self.folder.owned():
            # First all that can fail, then all that changes a file.
            check_unedited(self.folder.scene, self.plan)
            for name in KEPT:
                setattr(self, name, notes[name])
            self.formats = tuple(notes["written"])
            self.written = Written(self.folder, self.formats, notes["written"])
            sources = self.written.sources(self._frames(), lambda part: self._report("Verifying", part))
            log = self.folder.events if self.plan.output.event_log else None
            self.sim = Simulation.load(self.folder.checkpoint, event_log=log, workers=self.workers)
            self.folder.sweep()
            self.folder.restore_scene(self.plan)
            self._make_anew(sources)
            return self._run(self._continued)

    def _keep(self, scene: Scene) -> None:
        """Find out which trajectories and how many frames are written, and how many segments that makes."""
        formats, self.frames = amount(self.plan, scene)
        self.formats = _formats(formats, scene.dimension)
        self.per_frame = math.ceil(SEGMENTS / self.frames)
        self.segments = self.per_frame * self.frames

    def _make_anew(self, sources: dict[str, str]) -> None:
        """Make damaged trajectories anew from others."""
        for form, source in sources.items():
            path, other = self.folder.trajectory(form), self.folder.trajectory(source)
            warnings.warn(
                f"{path} was damaged or missing, and is made anew from {other.name}.",
                CaromWarning,
                stacklevel=2,
            )
            io.rebuild(other, path, self._frames())

    def _continued(self, form: str) -> Any:
        """Open a trajectory after the frames of the checkpoint."""
        path, scene, keep = self.folder.trajectory(form), self.sim.scene, self._frames()
        return io.open(path, "a", scene, keep=keep) if keep else io.open(path, "w", scene)

    # The three phases.

    def _run(self, opened: Callable[[str], Any]) -> RunResult:
        with contextlib.ExitStack() as files:
            files.enter_context(self.sim)
            # Compiles, which takes some seconds the first time and cannot be deferred.
            self._report("Compiling", 0.0)
            self.sim.run(time=0.0)
            self.sim.frame()
            files.callback(setattr, self.stop, "deferred", False)
            self.stop.deferred = True
            self.thermometer = Thermometer(self.sim.machine)
            self.thermometer.series = self.temperatures
            self.writers = [files.enter_context(opened(form)) for form in self.formats]
            self._save()
            if self.equilibrated is None:
                self._equilibrate()
            self._measure()
            while self._goes_on():
                self._measure()
            self._save()
        return self._finish()

    def _equilibrate(self) -> None:
        sim, target = self.sim, round(self.plan.run.equilibration * self.sim.scene.n / 2)

        def look(_: float) -> None:
            self._report("Equilibrating", sim.collisions / target)
            self._look()

        look(0.0) if target else self._look()
        if sim.collisions < target:
            sim.run(collisions=target - sim.collisions, progress=look)
        self.equilibrated = (sim.collisions, sim.time)
        wanted = self.plan.run.collisions_per_particle
        if wanted is None:
            self.pilot = True
            self._begin(PILOT, self._duration(PILOT * block_collisions(sim.scene.n) * 2.0 / sim.scene.n))
        else:
            self._begin(self.segments, self._duration(wanted))

    def _begin(self, segments: int, duration: float) -> None:
        """Begin a stretch; its segments depend on nothing but the state so far."""
        sim = self.sim
        self.segments, self.step = segments, _rounded(duration / segments)
        # Two segments further lies ahead, whatever the rounding of the present time.
        self.first = math.floor(sim.time / self.step) + 2
        for _ in sim.sample(times=[self.first * self.step]):
            self.marks = [self._mark()]
            self.thermometer.series.clear()
        self._save()

    def _duration(self, wanted: float) -> float:
        """Return the time in which about as many collisions per particle happen as are asked for."""
        sim = self.sim
        if sim.scene.n > 1 and sim.kT > 0.0:
            return sim.time_for(wanted * sim.scene.n / 2)
        # Nobody will ever collide: let each go as far as it could between so many collisions.
        speed = math.sqrt(sim.kT / sim.scene.mass)
        return wanted * max(sim.scene.box) / (speed or 1.0)

    def _goes_on(self) -> bool:
        """Tell whether the error bar asked for needs more, and say how much."""
        if self.goal is None or (not self.pilot and self._late()):
            return False
        found = self._error_bar()
        if not self.pilot and (found is None or self.goal.reached(found)):
            return False
        so_far = len(self.marks) - 1
        factor = 1.0 if found is None else min(self.goal.remaining(found), LONGEST)
        if self._predicted is not None and found is not None:
            more = factor - (0.0 if self.pilot else 1.0)
            collisions = self.marks[-1][0] - self.marks[0][0]
            self._predicted(Prediction(found.relative_error, more * collisions, more * self.engine_seconds))
        if self.pilot:
            limit = self.plan.run.max_walltime
            if limit is not None:
                # A segment must not outlast what is allowed: its length follows from the stretch expected.
                factor = max(min(factor, limit / self.engine_seconds), 1.0)
            self.pilot, self.engine_seconds = False, 0.0
            self._begin(self.per_frame * self.frames, factor * so_far * self.step)
        elif found is not None:
            look = self.goal.next_look(so_far, found)
            self.segments = math.ceil(look / self.per_frame) * self.per_frame
        return True

    def _mark(self) -> tuple[Any, ...]:
        # Sums since the start: differences of them do not depend on where a segment was cut.
        tally = self.sim.tally
        scene = self.sim.scene
        sums = int(tally.collisions), float(tally.virial), tally.kT_time
        if not (scene.walls or scene.obstacles):
            return sums
        taken_up = (impacts.impulse for impacts in self.sim.obstacles)
        return *sums, *taken_up, *weighted_momenta(self.sim.frame(), scene)

    def _frames(self) -> int:
        """Return the number of frames that belong to the marks."""
        return 0 if self.pilot else max(len(self.marks) - 1, 0) // self.per_frame

    def _blocks(self) -> list[Block]:
        """Return what each segment added up to."""
        blocks = []
        for before, after in zip(self.marks, self.marks[1:], strict=False):
            walls = [b - a for a, b in zip(before[3:], after[3:], strict=True)]
            half = len(walls) // 2
            blocks.append(
                Block(
                    self.step,
                    int(after[0] - before[0]),
                    after[1] - before[1],
                    tuple(walls[:half]),
                    tuple(walls[half:]),
                    None if after[2] is None else after[2] - before[2],
                )
            )
        return blocks

    def _error_bar(self) -> Estimate | None:
        """Return Z so far, or None where it never gets an error bar."""
        from carom.studies.runs import report

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # of short runs: this one goes on
            pressure = report.pressure_of(self.sim, self._blocks())
        return None if pressure is None else pressure.primary

    def _late(self) -> bool:
        """Tell whether the wall time is over; one frame is always waited for."""
        limit = self.plan.run.max_walltime
        spent = self.seconds + clock.perf_counter() - self._began
        return limit is not None and spent >= limit and self._frames() > 0

    def _measure(self) -> None:
        parts = 1
        stage = "Pilot" if self.pilot else "Measuring"
        while (segment := len(self.marks) - 1) < self.segments and not self._late():
            self._report(stage, (segment + self.part / PARTS) / self.segments)
            self._look()
            count, seconds = min(parts, PARTS - self.part), self.sim.seconds
            self.sim.run(time=count * (self.step / PARTS))
            taken = self.sim.seconds - seconds
            self.engine_seconds += taken
            if taken < QUICK:
                parts = min(2 * parts, PARTS)
            elif taken > SLOW:
                parts = max(parts // 2, 1)
            self.part += count
            if self.part == PARTS:
                self.part = 0
                self.marks.append(self._mark())
                self.thermometer.look()
                if not self.pilot and (segment + 1) % self.per_frame == 0:
                    self._write()
        self._look()
        self._report(stage, 1.0)

    def _write(self) -> None:
        frame = self.sim.frame()
        for writer in self.writers:
            writer.write(frame)
        self.written.add(frame)

    def _finish(self) -> RunResult:
        from carom.studies.runs import report

        blocks = self._blocks()
        assert self.equilibrated is not None
        facts = report.Facts(
            plan=self.plan,
            sim=self.sim,
            blocks=blocks,
            equilibration=(self.equilibrated[0], self.equilibrated[1]),
            frames=self._frames(),
            trajectories=[self.folder.trajectory(form) for form in self.formats],
            rate=sum(block.collisions for block in blocks) / self.engine_seconds,
            began=self._began - self.seconds,
            doubts=tuple(self.thermometer.doubts()),
        )
        try:
            summary = report.write(self.folder, facts, self._report)
        except KeyboardInterrupt:
            raise self._interrupted() from None
        return RunResult(self.folder.path, summary, new=True)

    # Between the steps.

    def _interrupted(self) -> Interrupted:
        return Interrupted(f"Stopped; `carom resume {self.folder.path}` goes on.")

    def _report(self, stage: str, fraction: float) -> None:
        if self._progress is not None:
            self._progress(stage, min(max(fraction, 0.0), 1.0))

    def _look(self) -> None:
        """Stop if somebody asked to, and keep the state from time to time."""
        if self.stop.asked:
            self._save()
            raise self._interrupted()
        if clock.perf_counter() >= self._due:
            self._save()

    def _save(self) -> None:
        now = clock.perf_counter()
        self.sim.save(
            self.folder.checkpoint,
            plan=self.plan.to_toml(),
            collisions=self.sim.collisions,
            written=self.written.notes(),
            **{
                **{name: getattr(self, name) for name in KEPT},
                "seconds": self.seconds + now - self._began,
            },
        )
        # A large state takes long to write; at most half of the time goes there.
        after = clock.perf_counter()
        self._due = after + max(self.plan.run.checkpoint_every, after - now)


def _formats(asked: tuple[str, ...], dimension: int) -> tuple[str, ...]:
    """Return the formats of the trajectories: those that can hold so many dimensions.

    Raises
    ------
    InputError
        If none of the formats asked for can, or GSD is asked for and not installed.
    """
    held = tuple(form for form in asked if form == "h5md" or dimension <= LARGEST_EXTENDED)
    if asked and not held:
        raise InputError(
            f"[output] trajectory {', '.join(asked)} holds at most {LARGEST_EXTENDED} dimensions, and the "
            f'scene has {dimension}; use ["h5md"].'
        )
    for form in sorted({*asked} - {*held}):
        warnings.warn(
            f"{form} holds at most {LARGEST_EXTENDED} dimensions, and the scene has {dimension}: "
            f"trajectory.{form} is left out.",
            CaromWarning,
            stacklevel=4,
        )
    if "gsd" in held:
        from importlib.util import find_spec

        if find_spec("gsd") is None:
            raise InputError(
                '[output] trajectory "gsd" needs the package gsd; pip install "carom[gsd]", or leave it out.'
            )
    return held


def _rounded(duration: float) -> float:
    """Return the nearest number of few binary digits."""
    mantissa, exponent = math.frexp(duration)
    return math.ldexp(round(math.ldexp(mantissa, DIGITS)), exponent - DIGITS)
