"""The engine of a scene with its clock, and how both are rebuilt during a run."""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import BusyError, InputError
from carom.frame import Frame
from carom.models import model_checks
from carom.models.motions.shear import Shear
from carom.scene.velocities import peculiar
from carom.simulation.autotune import Pace
from carom.simulation.call_budget import MOST_CYCLES, MOST_SCHEDULED, CallBudget
from carom.simulation.clock import Clock
from carom.simulation.measuring.depths import Depths
from carom.simulation.measuring.invariants import EnergyMomentum
from carom.simulation.moves.barostat import VolumeMoves
from carom.simulation.moves.oscillation import oscillation_of
from carom.simulation.moves.swaps import Sweeps
from carom.simulation.refusals import refuse_steep
from carom.simulation.run_guard import RunGuard
from carom.simulation.system_of_scene import losses_at, speeds_of
from carom.simulation.tuning import Requested

if TYPE_CHECKING:
    from carom.engine.build import Engine
    from carom.engine.neighbors.plan import NeighborPlan
    from carom.engine.system import System
    from carom.scene.scene import Scene
    from carom.simulation.files.recorder import Recorder
    from carom.simulation.workers.executive import Executive
    from carom.units import TimeUnit

Steps = tuple[np.ndarray, np.ndarray]  # pairs (m, 2), and on which step each is, (m,)


def frame_of(
    scene: Scene, model: Any, state: Any, clock: Clock, in_epoch: float, step: int, diameters: np.ndarray
) -> Frame:
    """Return all components at the present time, by the engine's state of an earlier one.

    ``in_epoch`` is the present since the start of the epoch of the state [engine's time], ``step`` the
    collisions so far, ``diameters`` (n,) at present.
    """
    from carom.engine.advance import project
    from carom.engine.tilted_lattice import tilt_of

    positions, velocities = np.empty((scene.n, scene.dimension)), np.empty((scene.n, scene.dimension))
    images = None if state.images is None else state.images.copy()
    project(model.motion, model.boundary, state, in_epoch, positions, velocities, images)
    tilt = tilt_of(model.motion, in_epoch)
    if tilt:
        positions[:, 0] += tilt * positions[:, 1]
    return Frame(
        time=float(clock.instant),
        step=step,
        positions=positions,
        velocities=clock.unit.to_scene(velocities, -1),
        box=scene.box,
        diameters=diameters,
        masses=scene.masses,
        images=images,
        species=scene.species,
        species_names=scene.species_names,
        periodic=scene.periodic,
        spins=spins_of(model, clock.unit),
        tilt=tilt,
    )


def spins_of(model: Any, unit: TimeUnit) -> np.ndarray | None:
    """Return the spins of rough particles now, (n, 1) or (n, 3) [1 / time]; None where they are smooth."""
    spins = getattr(model.impact, "spins", None)
    return None if spins is None else np.asarray(unit.to_scene(spins[:-1], -1))


class RunState:
    """The engine of a scene, its clock, and what they were made for.

    ``velocities`` are those at the start; ``requested`` is a neighbor scheme and reach, for which ``scheme``
    is chosen if left out. Collisions before the clock's base are ``counted``. ``start`` has energy and
    momentum at the start, ``seconds`` the wall time in the engine, ``budget`` the cycles a call, ``pace``
    whether memory is asked for ahead. ``steps`` has pairs and their steps for the next lists, or None.
    ``answered`` is False while what the engine returned is not yet done, ``scheduled`` where Ctrl-C came then
    or while components got their events. ``depths`` are states in which overlaps are looked for when asked.
    """

    def __init__(
        self,
        scene: Scene,
        velocities: np.ndarray,
        system: System,
        requested: Requested,
        scheme: NeighborPlan | None = None,
    ):
        from carom.engine.build import build

        self.scene = scene
        self.velocities = velocities.copy()
        self.system = system
        self.requested = requested
        v = self.unit.to_kernel(velocities, -1)
        self.scheme = self._choose(v, requested) if scheme is None else scheme
        self.engine: Engine = build(self.scheme, system, scene.positions, v)
        self.clock = Clock(self.unit, self.scheme.epoch)
        self.counted = 0
        self.volume_moves: VolumeMoves | None = None
        self.oscillation = oscillation_of(scene)
        self.sweeps: Sweeps | None = None  # before the start, whose frame in a field has the diameters
        self.start = EnergyMomentum.of(scene.masses, self.speeds, self.unit)
        self.seconds = 0.0
        self.log: Recorder | None = None
        self.alone = RunGuard()
        self.budget = CallBudget(MOST_CYCLES)
        self.pace = Pace(self)
        self.steps: Steps | None = None
        self.energy_of_first_steps: float | None = None  # found when it is asked for
        self.scheduled = self.answered = True
        self.executive: Executive | None = None
        self.depths = Depths()

    def _choose(self, v: np.ndarray, requested: Requested, rate: float | None = None) -> NeighborPlan:
        """Return the scheme for velocities ``v``, (n, d); they and ``rate`` are in the engine's unit."""
        from carom.engine.neighbors.plan import choose

        speed = math.sqrt(float(np.mean(np.sum(v * v, axis=1))))
        if self.system.rates is not None:
            speed += 2.0 * float(self.system.rates.max())
        if not self.system.straight or self.system.obstacles or self.system.scene.drive is not None:
            speed = max(speed, self.system.driven_speed)
        try:
            return choose(self.system, speed, *requested, rate)
        except ValueError as error:
            raise InputError(str(error)) from None

    @property
    def unit(self) -> TimeUnit:
        """The engine's unit of time."""
        return self.system.unit

    @property
    def epoch_length(self) -> float:
        """Length of an epoch [time]: a power of two."""
        return self.unit.to_scene(self.scheme.epoch, 1)

    @property
    def collisions(self) -> int:
        """Pair collisions since the start."""
        return int(self.engine.tallies.collisions[0])

    @property
    def speeds(self) -> np.ndarray:
        """Velocities in the engine's unit, (n, d) float64: in single precision squares overflow."""
        if not self.system.straight:
            return np.asarray(self.unit.to_kernel(self.frame().velocities, -1))
        return np.asarray(self.engine.state.rows["v"][: self.scene.n], np.float64)

    @property
    def diameters(self) -> np.ndarray:
        """Diameter of each component at the present time, (n,) [length]."""
        if self.system.rates is None:
            radii = self.system.radii
            return self.scene.diameters if self.sweeps is None or radii is None else 2.0 * radii
        pair = self.engine.model.pair
        return 2.0 * (pair.radii + pair.rates * self.in_epoch())[: self.scene.n]

    def observer(self, kind: type) -> Any:
        """Return the engine's observer of a type, or None where there is none."""
        from carom.engine.observers.interface import observer_of

        return observer_of(self.engine.model.observers, kind)

    def observe(self, observers: Any) -> None:
        """Let the engine go on with other observers."""
        self.engine = self.engine._replace(model=self.engine.model._replace(observers=observers))

    def let_in(self, observers: tuple) -> None:
        """Let the engine go on with other observers of the user's own."""
        from carom.engine.observers.build import owned
        from carom.engine.observers.interface import chained, listed
        from carom.engine.observers.own import Own

        self.system = dataclasses.replace(self.system, observers=observers)
        others = [each for each in listed(self.engine.model.observers) if not isinstance(each, Own)]
        origin = float(self.unit.to_kernel(self.clock.base, 1))
        self.observe(chained([*others, *owned(self.system, origin)]))

    def in_epoch(self) -> float:
        """Return the present time relative to the epoch that the kernel is in, in the kernel's unit."""
        ahead = self.clock.epoch - int(self.engine.state.clock[0].epoch)
        return self.clock.offset + float(ahead) * self.scheme.epoch

    def obstacle_numbers(self) -> list[int]:
        """Return the engine's number of each wall and obstacle, in the scene's order."""
        from carom.engine.obstacles import numbers_of

        return numbers_of(self.scene.periodic, self.system.obstacle_models)

    def frame(self) -> Frame:
        """Return all components at the present time; does not affect the trajectory."""
        engine = self.engine
        now = self.clock, self.in_epoch(), self.collisions
        return frame_of(self.scene, engine.model, engine.state, *now, self.diameters)

    def schedule(self) -> None:
        """Give every component its first event."""
        from carom.engine import cycle
        from carom.engine.build import stripped

        self.scheduled = False
        n, start, budget = self.scene.n, 0, CallBudget(MOST_SCHEDULED)
        while start < n:
            if start == 0 and self.system.stepped and not self._settle_steps():
                self.enlarge_neighbors()
                continue
            end = min(start + budget.count, n)
            with budget:
                done = cycle.schedule(*stripped(self.engine), np.int64(start), np.int64(end))
            if done:
                start = end
            else:
                start = 0
                self.enlarge_neighbors()
        self.scheduled = True
        self.steps = None

    def _settle_steps(self) -> bool:
        """Build the lists and write into them on which step each pair is; False if an array is too small."""
        from carom.engine import cycle
        from carom.engine.build import stripped
        from carom.engine.observers.currents import Currents, fill
        from carom.engine.pair_steps import write_steps
        from carom.scene.fields import first_steps

        if self.steps is None:
            self.steps = first_steps(self.scene)
        lists: Any = self.engine.neighbors
        lists.steps.ready[0] = 0
        if not cycle.schedule(*stripped(self.engine), np.int64(0), np.int64(0)):
            return False
        write_steps(lists, *self.steps)
        self.engine.model.pair.start_steps(*self.steps)
        lists.steps.ready[0] = 1
        if self.system.currents:
            fill(self.observer(Currents), *self.steps, self.speeds)
        return True

    def _keep_steps(self) -> None:
        """Take the steps of pairs out of the lists, which are about to be built anew."""
        from carom.engine.pair_steps import read_steps

        if self.system.stepped and self.scheduled:
            self.steps = read_steps(self.engine.neighbors)

    def renew_neighbors(self) -> None:
        """Build sectors or lists anew, as a lattice that tilts demands, and schedule everything."""
        self._keep_steps()
        self.schedule()

    def enlarge_neighbors(self, full_cell: bool | None = None, times: int = 1) -> None:
        """Make more room where ``full_cell`` is, or where none is left; all has to be scheduled anew."""
        from carom.engine.build import enlarge_neighbors

        self._keep_steps()
        self.scheduled = False
        if full_cell is None:
            members = getattr(self.engine.neighbors, "members", np.zeros(1))
            full_cell = self.scheme.kind == "sectors" or members.max() == self.scheme.cell_capacity
        scheme = self.scheme
        for _ in range(times):
            scheme = scheme.with_larger_neighbors(full_cell)
        vars(self).update(scheme=scheme, engine=enlarge_neighbors(self.engine, scheme, self.system))

    def enlarge_heap(self) -> None:
        """Make more room in the calendar."""
        from carom.engine.build import enlarge_heap

        scheme = self.scheme.with_larger_heap()
        vars(self).update(scheme=scheme, engine=enlarge_heap(self.engine, scheme.heap))

    def refuse_inherited(self) -> None:
        """Raise BusyError in a fork of the process that writes the event log, if there is one."""
        if self.log is not None and self.log.inherited:
            raise BusyError(
                f"{self.log.path} is written by the process of which this one is a fork: run this simulation "
                "there, or close() it here and go on without its log."
            )

    def flush_log(self) -> None:
        """Write what the event log has in memory, if there is one."""
        self.refuse_inherited()
        if self.log is not None:
            self.log.flush(self)

    def begin_log(self, log: Recorder) -> None:
        """Let the engine write down its events from now on."""
        self.log = log
        self._write_down(log.buffer)

    def close_log(self) -> None:
        """Flush and close the event log, if there is one; in a fork, forget it."""
        if self.log is not None:
            if not self.log.inherited:
                self.log.flush(self)
                self.log.close()
            self.log = None
            self._write_down(None)

    def _write_down(self, buffer: Any) -> None:
        """Let the engine go on with another buffer for its events, or with none."""
        from carom.engine.observers.event_log import Log
        from carom.engine.observers.interface import chained, listed

        others = (each for each in listed(self.engine.model.observers) if not isinstance(each, Log))
        self.observe(chained([*others, buffer]))

    def catch_up(self) -> None:
        """Set the clock to the engine's last event; where a run ended at a time, that lies behind."""
        clock, record = self.clock, self.engine.state.clock[0]
        clock.epoch, clock.offset = max((clock.epoch, clock.offset), (int(record.epoch), float(record.now)))

    def break_off(self) -> None:
        """Go on from the last event, all scheduled anew, where nobody knows why the engine returned."""
        self.catch_up()
        self._keep_steps()
        self.scheduled = False

    def rest_until(self, end: tuple[np.int64, float]) -> None:
        """Let time pass where nothing moves."""
        record = self.engine.state.clock[0]
        ahead = int(end[0]) - int(record.epoch)
        self.engine.model.observers.at_rest(end[1] + float(ahead) * self.scheme.epoch, end[1])
        record.epoch, record.now = end
        self.engine.state.rows["t"] = end[1]
        self.engine.calendar.control.end[0] = self.scheme.epoch

    def refit(
        self,
        velocities: np.ndarray | None = None,
        rates: np.ndarray | None = None,
        move: tuple[Fraction, dict[str, Any]] | None = None,
    ) -> None:
        """Choose the neighbor scheme anew, for the diameters of the present, and schedule everything.

        ``velocities`` (n, d) and ``rates`` of the radii (n,) may be new. ``move`` is when a move was due
        [time], and the attributes that it changed: a scene in another box, a stage, how far moves are.
        """
        what = (
            "scene",
            "volume_moves",
            "oscillation",
            "system",
            "scheme",
            "engine",
            "clock",
            "counted",
            "steps",
        )
        before = {name: getattr(self, name) for name in (*what, "scheduled")}
        try:
            self._refit(velocities, rates, move)
        except BaseException:  # Ctrl-C, too: all of it, or nothing
            vars(self).update(before)
            raise

    def _refit(
        self,
        velocities: np.ndarray | None,
        rates: np.ndarray | None,
        move: tuple[Fraction, dict[str, Any]] | None,
    ) -> None:
        from carom.engine.build import build, take_over

        model_checks.check_copy_state(self.system)
        frame = self.frame()
        rescaled = velocities is not None
        velocities = frame.velocities if velocities is None else velocities
        instant, old, before = self.clock.instant, self.engine, self.unit
        positions = frame.positions
        if move is not None:  # the clock may have rounded the instant
            instant, changed = move
            vars(self).update(changed)
            if "scene" in changed:
                positions = self.scene.positions
        self._keep_steps()
        passed_in_epoch = self.in_epoch()
        if self.system.rates is not None and rates is None:
            rates = before.to_scene(self.system.rates, -1)
        speeds = speeds_of(self.scene, velocities, rates)
        unit = speeds.unit
        now: dict[str, Any] = losses_at(self.scene, speeds.slow) if rescaled else {}
        if isinstance(self.scene.motion, Shear):
            stage = 0 if self.oscillation is None else self.oscillation.done
            now["motion"] = self.scene.motion.in_stage(stage).tilted(frame.tilt or 0.0)
        if rates is not None:
            radii = 0.5 * frame.diameters
            now |= {"radii": radii, "diameter": 2.0 * float(radii.max()), "rates": unit.to_kernel(rates, -1)}
        driven = unit.to_kernel(speeds.driven, -1)
        self.system = dataclasses.replace(
            self.system, scene=self.scene, unit=unit, driven_speed=driven, **now
        )
        if self.system.stepped:
            refuse_steep(self.system, speeds.thermal)
        elapsed, counted_since = float(self.clock.since_base(instant)), self.collisions - self.counted
        rate = None
        if counted_since >= self.scene.n and elapsed > 0.0:
            rate = before.to_scene(2.0 * counted_since / (self.scene.n * elapsed), -1)
            fastest = [float(np.abs(peculiar(self.scene, v)).max()) for v in (velocities, frame.velocities)]
            quicker = fastest[0] / fastest[1]  # a common drift meets nobody
            rate = unit.to_kernel(math.ldexp(rate, round(math.log2(quicker))), -1)
        v = speeds.thermal.velocities
        try:
            self.scheme = self._choose(v, self.requested, rate)
        except InputError:  # components have outgrown the lists that were asked for
            self.scheme = self._choose(v, ("sectors", None), rate)
        self.engine = build(self.scheme, self.system, positions, v)
        present, slower = unit.to_kernel(instant, 1), unit.exponent - before.exponent
        take_over(old, self.engine, present, passed_in_epoch, slower)
        if rescaled and frame.spins is not None:  # by the factor of the velocities
            after, earlier = (np.sum(peculiar(self.scene, v) ** 2) for v in (velocities, frame.velocities))
            self.engine.model.impact.spins[:] *= math.sqrt(after / earlier)
        images = self.engine.state.images
        if frame.images is not None and images is not None:
            images[:] = frame.images
        self.clock = Clock(unit, self.scheme.epoch, instant)
        self.counted = self.collisions
        self.schedule()
