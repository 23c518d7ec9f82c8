"""A run under way: equilibrate, measure, sample, and write a folder from which a killed run can continue."""

from __future__ import annotations

import contextlib
import math
import time as clock
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from carom import io
from carom.compiling import entry
from carom.errors import InputError, warn
from carom.geometry.overlaps import Overlap
from carom.io.checkpoint import LARGE
from carom.io.formats import Writer
from carom.observables.analysis.layers import Layers
from carom.observables.analysis.precision import Goal, Prediction, block_collisions, lengthen
from carom.observables.statistics import Estimate, unwarned
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile
from carom.simulation.files import checkpoint
from carom.simulation.files.checkpoint import size, size_of_file
from carom.simulation.measuring import stretches
from carom.simulation.measuring.depths import deepest, present
from carom.simulation.measuring.equilibration import Equilibration, exchanges
from carom.simulation.measuring.equipartition import Thermometer
from carom.simulation.simulation import Simulation
from carom.simulation.system_of_scene import driven_speed_of
from carom.simulation.tuning import Tuning
from carom.studies.runs import report
from carom.studies.runs.constant_pressure import volume_of
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.storage import amount, holdable, without_trajectory
from carom.studies.runs.stretch import PARTS, PILOT, Stretch
from carom.studies.runs.written import Written
from carom.studies.signals import Interrupted, Stop
from carom.texts import typed

LONGEST = 1e9
"""Largest length of a run to a relative error [lengths of its pilot]."""

QUICK, SLOW = 0.02, 0.06
"""Seconds of the engine between two checks for Ctrl-C: longer than a check takes, too short to notice."""

KEPT = tuple(each.name for each in fields(Stretch))
"""Names of the fields of :class:`Stretch` that a checkpoint keeps."""

Progress = Callable[[float, str], object]
"""Called with the name of the stage and its finished fraction."""

Predicted = Callable[[Prediction], object]
"""Called with the prediction of a run to a relative error."""


class Run:
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
        self.plan, self.folder, self.stop = plan, folder, stop
        self.cores = cores
        self._progress, self._predicted = progress, predicted
        error = plan.run.relative_error
        self.goal = None if error is None else Goal(error)
        self.sim: Simulation
        self.stretch: Stretch
        self.writers: list[Writer] = []
        self._before = 0.0  # seconds spent in earlier sessions
        self._began, self._due = entry.running(), clock.perf_counter()

    # Beginning.

    def from_the_start(self) -> dict[str, Any]:
        """Run from the initial state, replace an older run in the folder, and return the summary."""
        self._report(0.0, "Preparing")
        plan = self.plan
        scene = plan.build_scene()
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
        self.sim = Simulation(scene, **settings)
        if size(self.sim._state) > LARGE:
            # The size of the packed lists is known only when they are filled.
            self._compile()
        checkpoint = size_of_file(self.sim._state)
        formats, frames = amount(plan, scene, checkpoint)
        self.formats = holdable(formats, scene.dimension)
        if reason := without_trajectory(plan, scene, self.formats, checkpoint):
            warn(reason)
        self.stretch = Stretch.of(frames)
        self.written = Written(self.folder, self.formats)
        with self.folder.owned():
            self.folder.begin(plan)
            if plan.run.event_log:
                self.sim = Simulation(scene, **settings, event_log=self.folder.events)
            return self._run(lambda form: io.open(self.folder.trajectory(form), "w", scene))

    def from_checkpoint(self, notes: dict[str, Any]) -> dict[str, Any]:
        """Continue from a checkpoint; return the summary."""
        self._report(0.0, "Preparing")
        with self.folder.owned():
            # All verification comes before any change of a file of the run.
            self.folder.check_unedited(self.plan)
            self.stretch = Stretch(**{name: notes[name] for name in KEPT})
            self._before = self.stretch.seconds
            self.formats = tuple(notes["written"])
            self.written = Written(self.folder, self.formats, notes["written"])
            keep = self.stretch.written
            sources = self.written.sources(keep, lambda part: self._report(part, "Verifying"))
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
            io.rebuild(other, path, self.stretch.written)

    def _continued(self, form: str) -> Any:
        """Open a trajectory after the frames of the checkpoint."""
        path, scene, keep = self.folder.trajectory(form), self.sim.scene, self.stretch.written
        return io.open(path, "a", scene, keep=keep) if keep else io.open(path, "w", scene)

    def _compile(self) -> None:
        """Predict the first events; this compiles, for some seconds in which Ctrl-C cannot be deferred."""
        self._report(0.0, "Compiling")
        self.sim.run(time=0.0)
        self.sim.frame()

    # The three phases.

    def _run(self, opened: Callable[[str], Any]) -> dict[str, Any]:
        with contextlib.ExitStack() as files:
            files.enter_context(self.sim)
            self._compile()
            files.callback(setattr, self.stop, "deferred", False)
            self.stop.deferred = True
            self.thermometer = Thermometer(self.sim._state)
            self.thermometer.series = self.stretch.temperatures
            self.layers = Layers(self.sim.scene, self.stretch.layers)
            self.writers = [files.enter_context(opened(form)) for form in self.formats]
            self._save()
            if self.stretch.equilibrated is None:
                self._equilibrate()
            if self.stretch.pilot:
                self._size_up()
            if self.goal is None:
                self._extend(self.stretch.segments)
            else:
                lengthen(self.goal, self.stretch.segments, self._extend, self._error_bar, self._expect)
            self._save()
        return self._finish()

    def _equilibrate(self) -> None:
        sim, target = self.sim, round(self.plan.run.equilibration * self.sim.scene.n / 2)

        def look(_: float) -> None:
            self._report(sim.collisions / target, "Equilibrating")
            self._look()

        look(0.0) if target else self._look()
        if self._brings_to_temperature():
            assert self.plan.run.kT is not None
            rounds = Equilibration(sim, self.plan.run.kT, target, self.stretch.rounds)
            self.stretch.rounds = rounds.begun
            rounds.run(look)
        elif sim.collisions < target:
            sim.run(collisions=target - sim.collisions, progress=look)
        self.stretch.equilibrated = (sim.collisions, sim.time)
        asked = self.plan.run
        if asked.time is not None:
            self._begin(self.stretch.segments, asked.time)
        elif asked.collisions_per_particle is None:
            self.stretch.pilot = True
            self._begin(PILOT, self._duration(PILOT * block_collisions(sim.scene.n) * 2.0 / sim.scene.n))
        else:
            self._begin(self.stretch.segments, self._duration(asked.collisions_per_particle))

    def _brings_to_temperature(self) -> bool:
        """Tell whether pairs exchange energy, and a temperature was asked for that lasts.

        An event log holds no scaled velocities.
        """
        sim = self.sim
        asked = sim.scene.velocities is None and not self.plan.run.event_log
        return asked and exchanges(sim)

    def _begin(self, segments: int, duration: float) -> None:
        """Begin a stretch, and save its beginning."""
        self.stretch.begin(self.sim, segments, duration)
        self._save()

    def _duration(self, wanted: float) -> float:
        """Return the time of about the ``wanted`` number of collisions per particle."""
        sim = self.sim
        if sim.scene.n > 1 and sim.kT > 0.0:
            return stretches.time_for(sim, wanted * sim.scene.n / 2)
        # Without collisions, a particle crosses the box in place of every collision.
        speed = math.sqrt(sim.kT / sim.scene.mass)
        return wanted * max(sim.scene.box) / (speed or 1.0)

    def _size_up(self) -> None:
        """Measure in a pilot how long the run must be, and begin it."""
        stretch = self.stretch
        self._measure()
        found = self._error_bar()
        factor = 1.0
        if found is not None and self.goal is not None:
            factor = min(self.goal.remaining(found), LONGEST)
            self._predict(found, factor)
        limit = self.plan.run.walltime
        if limit is not None:
            # The length of a segment follows from the expected stretch, which must not exceed the wall time.
            factor = max(min(factor, limit / stretch.engine_seconds), 1.0)
        stretch.pilot, stretch.engine_seconds = False, 0.0
        self._begin(stretch.per_frame * stretch.frames, factor * stretch.measured * stretch.step)

    def _extend(self, length: int) -> int | None:
        """Measure up to a number of segments that fills frames, and return it; None if the time is over."""
        per_frame = self.stretch.per_frame
        self.stretch.segments = math.ceil(length / per_frame) * per_frame
        self._measure()
        return None if self._late() else self.stretch.segments

    def _expect(self, length: int, found: Estimate) -> None:
        """Report how much is still to come."""
        assert self.goal is not None
        self._predict(found, min(self.goal.remaining(found), LONGEST) - 1.0)

    def _predict(self, found: Estimate, more: float) -> None:
        """Report how much is still to come, in lengths of the stretch so far."""
        stretch = self.stretch
        if self._predicted is not None:
            collisions = stretch.marks[-1][0] - stretch.marks[0][0]
            seconds = more * stretch.engine_seconds
            self._predicted(Prediction(found.relative_error, more * collisions, seconds))

    def _error_bar(self) -> Estimate | None:
        """Return Z so far, or the volume under a barostat; None where it never gets an error bar."""
        with unwarned():  # short runs warn, but this one goes on
            blocks = self.stretch.blocks(self.sim)
            found = volume_of(self.sim, blocks) or report.pressure_of(self.sim, blocks)
        return None if found is None else found.primary

    def _late(self) -> bool:
        """Return whether the wall time is over; a run has at least one frame."""
        limit = self.plan.run.walltime
        return limit is not None and self._spent() >= limit and self.stretch.written > 0

    def _spent(self) -> float:
        """Return the seconds spent, in all sessions, without those of compiling."""
        return self._before + entry.running() - self._began

    def _measure(self) -> None:
        """Run the remaining segments of the stretch, part by part, and write frames."""
        parts = 1
        stretch = self.stretch
        stage = "Pilot" if stretch.pilot else "Measuring"
        while stretch.measured < stretch.segments and not self._late():
            self._report((stretch.measured + stretch.part / PARTS) / stretch.segments, stage)
            self._look()
            count, seconds = min(parts, PARTS - stretch.part), self.sim._state.seconds
            self.sim.run(time=count * (stretch.step / PARTS))
            taken = self.sim._state.seconds - seconds
            stretch.engine_seconds += taken
            if taken < QUICK:
                parts = min(2 * parts, PARTS)
            elif taken > SLOW:
                parts = max(parts // 2, 1)
            stretch.part += count
            if stretch.part == PARTS:
                stretch.mark(self.sim)
                self.thermometer.look()
                if self.layers.weight is not None:
                    self.layers.look(self.sim.frame(), self.sim.kT)
                if not stretch.pilot and stretch.measured % stretch.per_frame == 0:
                    self._write()
        self._look()
        self._report(1.0, stage)

    def _write(self) -> None:
        frame = self.sim.frame()
        if self.plan.run.check:
            found = deepest(self.sim._state, present(self.sim._state))
            self.stretch.overlaps += [] if found is None else [(frame.time, *found)]
        for writer in self.writers:
            writer.write(frame)
        self.written.add(frame)

    def _finish(self) -> dict[str, Any]:
        stretch = self.stretch
        blocks = stretch.blocks(self.sim)
        assert stretch.equilibrated is not None
        facts = report.Facts(
            plan=self.plan,
            sim=self.sim,
            blocks=blocks,
            equilibration=(stretch.equilibrated[0], stretch.equilibrated[1]),
            frames=stretch.written,
            overlaps=[(time, Overlap(*found)) for time, *found in stretch.overlaps],
            trajectories=[self.folder.trajectory(form) for form in self.formats],
            rate=sum(block.collisions for block in blocks) / stretch.engine_seconds,
            began=self._began - self._before,
            thermometer=self.thermometer,
            layers=self.layers,
            energy_drift=stretch.energy_drift(self.sim) if stretch.rounds else None,
            without=without_trajectory(
                self.plan, self.sim.scene, self.formats, size_of_file(self.sim._state)
            ),
        )
        try:
            return report.write(self.folder, facts, self._report)
        except KeyboardInterrupt:
            raise self._interrupted() from None

    # Between the parts.

    def _interrupted(self) -> Interrupted:
        return Interrupted(f"Stopped; `{typed('carom resume', self.folder.path)}` goes on.")

    def _report(self, fraction: float, text: str) -> None:
        if self._progress is not None:
            self._progress(min(max(fraction, 0.0), 1.0), text)

    def _look(self) -> None:
        """Stop after a signal, and save the state from time to time."""
        if self.stop.asked:
            self._save()
            raise self._interrupted()
        if clock.perf_counter() >= self._due:
            self._save()

    def _save(self) -> None:
        now = clock.perf_counter()
        self.stretch.seconds = self._spent()
        notes = {
            "plan": self.plan.to_toml(),
            "collisions": self.sim.collisions,
            "written": self.written.notes(),
            **vars(self.stretch),
        }
        checkpoint.save(self.folder.checkpoint, self.sim._state, notes)
        # A large state takes long to write; at most a tenth of the time is spent on that.
        after = clock.perf_counter()
        self._due = after + max(self.plan.run.checkpoint_every, 9.0 * (after - now))


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
