"""One system on several threads: windows of time that are run in parts, compared, and kept or repeated."""

from __future__ import annotations

import math
import os
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.simulation.rims import Rims
from carom.simulation.shares import Settings, Shares

if TYPE_CHECKING:
    from carom.simulation.machine import Machine

CYCLES = 200_000
"""Cycles in one call of a worker: between two, it looks whether it is to stop."""

LENGTHS = {2: 4.0}
"""Collisions a particle that a window holds in some dimensions: longer in the plane, where rims are thin."""

LENGTH = 2.0
"""Collisions a particle that a window holds elsewhere."""

WORTHWHILE: dict[int, int] = {2: 600_000}
"""Components from which on two workers were measured to be 1.2 times as fast as one or more, by dimension."""

AT_MOST = 2
"""Workers that are chosen without being asked for: the speed of more has not been measured."""

MOST = 1024
"""Workers that may be asked for: beyond any machine that shares its memory."""

FEWEST = 32
"""Collisions below which it never is."""

SHORTAGE = 0.01
"""Part of a window after a shortage of room that is left to the plain cycle: it was none in the whole."""

PATIENCE = 6
"""Times that a window is run again, half as long each time, before the plain cycle takes it over."""


@dataclass
class Team:
    """Workers for one machine.

    Attributes
    ----------
    machine : Machine
        What runs. Its arrays always hold the true state, of the end of the window kept last.
    workers : int
        How many threads.
    settings : Settings
        How long windows are and how deep rims.
    shares : Shares
        Where the time went.
    """

    machine: Machine
    workers: int
    settings: Settings = field(default_factory=Settings)
    shares: Shares = field(default_factory=Shares)

    def __post_init__(self) -> None:
        wanted = self.settings.collisions
        self._held = LENGTHS.get(self.machine.scene.dimension, LENGTH) if wanted is None else wanted
        self._engine: Any = None
        self._ledger: Any = None
        self._partition: Any = None
        self._truth: Any = None
        self._limit = math.inf  # time at which a window is lost already
        self._parts: list[Any] = []
        self._fresh = False  # whether every part holds the true state of its own cells
        self._mark: tuple[Any, ...] = ()
        self._length = 0.0
        self._plain = (-1, 0.0, 0.0)  # epoch, and from when until when the plain cycle is to run
        self._failed = 0
        self._rims = Rims(self.settings.depth)
        self._cut = 1.0  # factor that the partition was made with
        self._known_rate = 0.0
        self._stopping = threading.Event()
        self._pool: ThreadPoolExecutor | None = None
        self._seen = {"<lambda>"}

    # One window -------------------------------------------------------------------------------------------

    def window(self, stop: tuple[np.int64, float], target: int) -> bool:
        """Run one window, if the machine can and it is worth it; False if the plain cycle is to go on.

        Parameters
        ----------
        stop : tuple
            Epoch and offset where the run has to end.
        target : int
            Number of the collision at which it has to end; windows stay short of it.
        """
        machine = self.machine
        record = machine.engine.state.clock[0]
        epoch, start = int(record.epoch), float(record.now)
        if machine.clock.epoch == epoch:
            start = max(start, machine.clock.offset)
        last = math.nextafter(float(record.length), 0.0)
        if int(stop[0]) < epoch or machine.clock.epoch > epoch:
            return False
        if start >= last:
            return int(stop[0]) > epoch and self._turn(epoch)
        if int(stop[0]) == epoch:
            last = min(last, float(stop[1]))
        if epoch == self._plain[0] and self._engine is not None:
            _, first, until = self._plain
            if self._engine.neighbors is not machine.engine.neighbors:  # what there was to do is done
                self._plain = (-1, 0.0, 0.0)
            elif start < first:
                last = min(last, first)
            elif start < until:
                return False
        if self._length == 0.0:
            self._length = self._held / self._rate()
        # What is left of the epoch in windows of one length: a short one costs nearly as much as a long one.
        length = (last - start) / max(math.ceil((last - start) / self._length - 0.02), 1)
        left = target - machine.collisions
        if left < 2**60:
            # Short of it in spite of fluctuations: a window that goes beyond is of no use.
            ahead = min(left, 0.5 * machine.scene.n * self._rate() * length)
            length = min(
                length,
                (left - 4.0 * math.sqrt(ahead) - 0.01 * ahead) / (0.5 * machine.scene.n * self._rate()),
            )
        expected = 0.5 * machine.scene.n * self._rate() * length
        if not expected >= max(self.settings.least * machine.scene.n, FEWEST):
            return False
        end = start + length
        return self._run(epoch, start, last if end > last - 1e-9 * length else end, target)

    def _rate(self) -> float:
        """Return the collisions of a particle a time [1 / engine's time]."""
        machine = self.machine
        if self._known_rate > 0.0:
            return self._known_rate
        passed = float(machine.clock.since_base(machine.clock.instant))
        seen = machine.collisions - machine.counted
        if seen >= machine.scene.n and passed > 0.0:
            return 2.0 * seen / (machine.scene.n * passed)
        from carom.engine.neighbors.choice import collision_rate

        scene = machine.scene
        speed = math.sqrt(float(np.mean(np.sum(machine.speeds**2, axis=1))))
        return collision_rate(scene.packing_fraction, scene.dimension, scene.diameter, speed)

    def _run(self, epoch: int, start: float, end: float, target: int) -> bool:
        from carom.compiling.held import signals_held
        from carom.engine import constants
        from carom.engine.windows.parts import restart

        began = time.perf_counter()
        shares = self.shares
        self._ready()
        try:
            self._each(self._load)
            loaded = time.perf_counter()
            self._ledger.used[:] = 0
            for part in self._parts:
                restart(part.engine, epoch, start)
                part.engine.tallies.view(np.ndarray)[:] = 0
                part.digests[:] = 0
            self._limit = end
            codes = self._each(self._advance, epoch, end)
            ran = time.perf_counter()
            alike = all(code in (constants.REACHED_TIME, constants.IDLE) for code in codes)
            alike = alike and all(self._each(self._agree))
            compared = time.perf_counter()
        except BaseException:  # Ctrl-C: the true state is that of the beginning
            self._fresh = False
            raise
        own = [self._own_of(k) for k in range(self.workers)]
        count = sum(own)
        if not alike or self.machine.collisions + count >= target:
            self._again(codes, epoch, end, end - start, alike, count)
            shares.lost += time.perf_counter() - began
            shares.wall += time.perf_counter() - began
            return True
        with signals_held():
            self._each(self._store, end)
            stored = time.perf_counter()
            self._merge(own)
            self._at(epoch, end)
        self._adapt(count, end - start)
        now = time.perf_counter()
        shares.windows += 1
        shares.collisions += count
        shares.processed += sum(int(part.engine.tallies.collisions[0]) for part in self._parts)
        shares.busy += sum(self._busy)
        shares.load += loaded - began
        shares.run += ran - loaded
        shares.compare += compared - ran
        shares.store += stored - compared
        shares.merge += now - stored
        shares.wall += now - began
        return True

    def _turn(self, epoch: int) -> bool:
        """Begin the next epoch with all parts, where all has happened that was due in this one."""
        from carom.compiling.held import signals_held

        if not self._fresh or self._mark != self._state():
            return False
        began = time.perf_counter()
        with signals_held():
            self._each(self._turn_part)
            self._each(self._renew_part)
            self._at(epoch + 1, 0.0)
        passed = time.perf_counter() - began
        self.shares.turn += passed
        self.shares.wall += passed
        return True

    def _at(self, epoch: int, now: float) -> None:
        """Note that the true state, and that of all parts in their own cells, is now of this time."""
        from carom.engine.windows.parts import restart

        restart(self.machine.engine, epoch, now)
        self.machine.clock.epoch, self.machine.clock.offset = epoch, now
        self._mark = self._state()
        self._fresh = True

    # Its steps --------------------------------------------------------------------------------------------

    def _load(self, k: int) -> None:
        from carom.engine.windows.exchange import load, refresh

        fill = refresh if self._fresh else load
        fill(self._parts[k].share, self._truth, self._partition.flags[k])

    def _turn_part(self, k: int) -> None:
        from carom.engine.windows.exchange import turn

        self._in_both(k, turn)

    def _renew_part(self, k: int) -> None:
        from carom.engine.windows.exchange import renew_all

        self._in_both(k, renew_all)

    def _in_both(self, k: int, step: Any) -> None:
        """Take a step of an epoch with all components of a copy, and with this part's share of the truth."""
        machine, part = self.machine, self._parts[k]
        n, workers = machine.scene.n, self.workers
        model = machine.engine.model
        step(model, part.share, part.engine.state, np.int64(0), np.int64(n))
        begin, end = n * k // workers, n * (k + 1) // workers
        step(model, self._truth, machine.engine.state, np.int64(begin), np.int64(end))

    def _advance(self, k: int, epoch: int, end: float) -> int:
        from carom.engine import constants, cycle
        from carom.engine.windows.exchange import give_up
        from carom.engine.windows.partition import STAGES
        from carom.engine.windows.parts import with_larger_heap

        code = constants.SPENT
        began = time.thread_time()
        start, stage = float(self._parts[k].engine.state.clock.now[0]), 1
        while not self._stopping.is_set():
            part = self._parts[k]
            then = end if stage == STAGES else start + (end - start) * (stage / STAGES)
            until = np.int64(epoch), min(then, self._limit)
            code = cycle.run(*part.engine, part.gathered, *until, np.int64(2**62), np.int64(CYCLES))
            if code in (constants.REACHED_TIME, constants.IDLE) and stage < STAGES and then <= self._limit:
                boundary, stages = part.engine.model.boundary, self._partition.stages[k]
                give_up(part.share, boundary, stages, np.int64(stage))
                stage += 1
            elif code == constants.NEEDS_HEAP:
                self._parts[k] = with_larger_heap(part)
            elif code == constants.NEEDS_NEIGHBORS:
                # The window is lost: what the others do after this is of no use.
                self._limit = min(self._limit, float(part.engine.state.clock.now[0]))
                break
            elif code != constants.SPENT:
                break
        self._busy[k] = time.thread_time() - began
        return int(code)

    def _agree(self, k: int) -> bool:
        """Return whether the same happened in the zone of a part and in the copies of its owners."""
        from carom.engine.windows.shares import ZONE

        owners, flags, _ = self._partition
        zone = flags[k] == ZONE
        return all(
            np.array_equal(self._parts[k].digests[cells], self._parts[other].digests[cells])
            for other in self._beside[k]
            for cells in [zone & (owners == other)]
        )

    def _store(self, k: int, end: float) -> None:
        from carom.engine.windows.exchange import loosen, store

        part, flags = self._parts[k], self._partition.flags[k]
        boundary = part.engine.model.boundary
        loosen(part.share, boundary, flags, end)
        store(part.share, self._truth, boundary, flags)

    def _merge(self, own: list[int]) -> None:
        from carom.engine.windows.hooks import merge

        machine, engine = self.machine, self.machine.engine
        heads = np.zeros(self.workers, np.int64)
        log = None if machine.log is None else machine.log.buffer
        for part, count in zip(self._parts, own, strict=True):
            self._add_scheduling(part.engine.tallies[0], count)
        while not merge(
            self._ledger,
            heads,
            engine.state.clock,
            engine.tallies,
            engine.by_species,
            engine.model.obstacles,
            engine.model.boundary,
            log,
        ):
            machine.flush_log()

    def _add_scheduling(self, tally: Any, own: int) -> None:
        """Count what a part did to schedule its ``own`` collisions: the part of the rims is estimated.

        What is a warning if it is large is counted with the rims.
        """
        total = self.machine.engine.tallies[0]
        for name in ("advancements", "transits", "returns"):
            total[name] += round(int(tally[name]) * own / max(int(tally.collisions), 1))
        total.clamped += tally.clamped
        total.depth = max(total.depth, tally.depth)

    def _own_of(self, k: int) -> int:
        """Return the collisions of pairs in the cells of a part."""
        from carom.engine.constants import LAMBDA

        return int(np.count_nonzero(self._ledger.entries.word[k, : self._ledger.used[k, 0]] >= LAMBDA))

    # How long and how deep --------------------------------------------------------------------------------

    def _again(
        self, codes: list[int], epoch: int, end: float, length: float, alike: bool, count: int
    ) -> None:
        """Prepare to run a window again, from where it began."""
        from carom.engine import constants

        self.shares.repeats += 1
        self._fresh = False
        if constants.NEEDS_NEIGHBORS in codes:  # what the plain run does about it, it does itself
            needed = min(
                float(part.engine.state.clock.now[0])
                for code, part in zip(codes, self._parts, strict=True)
                if code == constants.NEEDS_NEIGHBORS
            )
            self._plain = (epoch, math.nextafter(needed, 0.0), needed + SHORTAGE * length)
        elif constants.NEEDS_LOG in codes:
            self._engine = None  # with more room
            self._room *= 2
        else:
            self._length = 0.5 * length
            self._failed += not alike
            held = 2.0 * count / self.machine.scene.n
            if self._failed > PATIENCE:
                self._plain = (epoch, end - length, end)
            elif held > 1.25 * self._held:
                # More than the rims are made for: the rate was not the one expected, and is known now.
                self._known_rate = held / length
                self._length = min(self._length, self._held / self._known_rate)
            elif not alike:
                self._rims.lost()

    def _adapt(self, count: int, length: float) -> None:
        """Choose the length of the next window."""
        self._failed = 0
        if count > 0:
            self._known_rate = 2.0 * count / (self.machine.scene.n * length)
            self._length = min(self._held / self._known_rate, 2.0 * self._length)
        self._rims.kept()

    # The copies -------------------------------------------------------------------------------------------

    def _state(self) -> tuple[Any, ...]:
        """Return what changes whenever the plain cycle has run."""
        record = self.machine.engine.state.clock[0]
        control = self.machine.engine.calendar.control[0]
        return int(record.epoch), float(record.now), int(control.full), self.machine.collisions

    def _ready(self) -> None:
        """Make the copies, where the engine is another than before, and see whether they are up to date."""
        from carom.engine.windows.hooks import make_ledger, page_of
        from carom.engine.windows.parts import make_part, share_of, with_neighbors
        from carom.engine.windows.shares import OWN, ZONE

        machine = self.machine
        engine: Any = machine.engine
        self._fresh = self._fresh and self._mark == self._state()
        if self._engine is not None and self._engine.neighbors is engine.neighbors:
            if self._cut != self._rims.factor:  # in place: the parts look at these arrays
                fresh = self._share_out()
                self._partition.flags[...], self._partition.stages[...] = fresh.flags, fresh.stages
                self._fresh = False
            return
        old, self._engine = self._engine, engine
        self._fresh = False
        if old is not None and old.state.rows is engine.state.rows:  # there is only more room
            self._truth = self._truth._replace(neighbors=engine.neighbors)
            self._parts = self._each(lambda k: with_neighbors(self._parts[k], engine.neighbors))
            return
        n, workers = machine.scene.n, self.workers
        if not self._parts:
            self._room = int(n * self._held) + 1024
            self._pool = None if workers == 1 else ThreadPoolExecutor(workers)
        self._partition = self._share_out()
        owners, flags, _ = self._partition
        self._beside = [sorted(set(owners[flags[k] == ZONE].tolist())) for k in range(workers)]
        self._truth = share_of(engine, np.full(n, OWN, np.uint8))
        if self._ledger is None or self._ledger.entries.shape[1] < self._room:
            self._ledger = make_ledger(workers, self._room)
        pages = [page_of(self._ledger, k) for k in range(workers)]
        self._parts = self._each(lambda k: make_part(engine, flags[k], pages[k]))
        self._busy = [0.0] * workers

    def _share_out(self) -> Any:
        """Return the cells of all parts, with rims as deep as they should be now."""
        from carom.engine.windows.partition import layout_of, share_out

        scene: Any = self.machine.scene
        self._cut = self._rims.factor
        layout = layout_of(self.machine.engine.neighbors, scene.box, scene.periodic)  # type: ignore[arg-type]
        return share_out(layout, self.workers, *self.depths())

    def depths(self) -> tuple[float, float]:
        """Return how deep rims have to be beyond what a part touches, at both ends of a window [length]."""
        speed = math.sqrt(float(np.mean(np.sum(self.machine.speeds**2, axis=1))))
        return self._rims.depths(self.machine.scene, speed / self._rate(), self._held)

    # Threads ----------------------------------------------------------------------------------------------

    def _each(self, step: Any, *arguments: Any) -> list[Any]:
        """Take a step with every part, each in its thread, and return what they return."""
        if self._pool is None or step.__name__ not in self._seen:
            # The first time in this thread, one after the other: that is when it is compiled.
            self._seen.add(step.__name__)
            return [step(k, *arguments) for k in range(self.workers)]
        self._stopping.clear()
        futures: list[Future[Any]] = [self._pool.submit(step, k, *arguments) for k in range(self.workers)]
        try:
            return [future.result() for future in futures]
        except BaseException:
            self._stopping.set()
            wait(futures)
            self._stopping.clear()
            raise

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None


def team_of(machine: Machine, workers: int | str) -> Team | None:
    """Return the workers of a machine, or None for a single one.

    Raises
    ------
    InputError
        If ``workers`` is neither a number nor "auto", or several are asked for and the scene cannot be run in
        windows.
    """
    from carom.engine.windows.parts import obstacle_to_windows

    automatic = workers == "auto"
    if isinstance(workers, str) and not automatic:
        raise InputError(f"workers is {workers!r}; expected a number or 'auto'.")
    count = _cores() if automatic else checks.integer(workers, "workers", low=1, high=MOST)
    if automatic and machine.scene.n < WORTHWHILE.get(machine.scene.dimension, math.inf):
        return None
    if count == 1:
        return None
    obstacle = obstacle_to_windows(machine.engine)
    if obstacle is None:
        return Team(machine, min(count, AT_MOST) if automatic else count)
    if automatic:
        return None
    raise InputError(f"This scene runs on one worker only, because of {obstacle}: leave out workers.")


def _cores() -> int:
    """Return the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
