"""One system on several threads: windows of time that are run in parts, compared, and kept or repeated."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.simulation.workers.crew import Crew
from carom.simulation.workers.lengths import LENGTH, LENGTHS, Lengths
from carom.simulation.workers.rims import Rims
from carom.simulation.workers.shares import Settings, Shares

if TYPE_CHECKING:
    from carom.simulation.machine import Machine

CYCLES = 200_000
"""Cycles in one call of a worker: between two, it looks whether it is to stop."""

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
        held = LENGTHS.get(self.machine.scene.dimension, LENGTH) if wanted is None else wanted
        self._crew = Crew(self.workers)
        self._lengths = Lengths(self.machine, held, self.settings.least)
        self._rims = Rims(self.settings.depth)
        self._cut = 1.0  # factor that the partition was made with
        self._engine: Any = None
        self._ledger: Any = None
        self._partition: Any = None
        self._truth: Any = None
        self._limit = math.inf  # time at which a window is lost already
        self._parts: list[Any] = []
        self._fresh = False  # whether every part holds the true state of its own cells
        self._mark: tuple[Any, ...] = ()
        self._plain = (-1, 0.0, 0.0)  # epoch, and from when until when the plain cycle is to run

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
        end = self._lengths.end(start, last, target)
        return end is not None and self._run(epoch, start, end, target)

    def _run(self, epoch: int, start: float, end: float, target: int) -> bool:
        from carom.compiling.held import signals_held
        from carom.engine import constants
        from carom.engine.windows.parts import restart

        began = time.perf_counter()
        shares = self.shares
        self._ready()
        try:
            self._crew.each(self._load)
            loaded = time.perf_counter()
            self._ledger.used[:] = 0
            for part in self._parts:
                restart(part.engine, epoch, start)
                part.engine.tallies.view(np.ndarray)[:] = 0
                part.digests[:] = 0
            self._limit = end
            codes = self._crew.each(self._advance, epoch, end)
            ran = time.perf_counter()
            alike = all(code in (constants.REACHED_TIME, constants.IDLE) for code in codes)
            alike = alike and all(self._crew.each(self._agree))
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
            self._crew.each(self._store, end)
            stored = time.perf_counter()
            self._merge(own)
            self._at(epoch, end)
        self._lengths.kept(count, end - start)
        self._rims.kept()
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
            self._crew.each(self._turn_part)
            self._crew.each(self._renew_part)
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
        while not self._crew.stopping.is_set():
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
            crowded = self._lengths.lost(count, length, alike)
            if self._lengths.failed > PATIENCE:
                self._plain = (epoch, end - length, end)
            elif not (alike or crowded):
                self._rims.lost()

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
            self._parts = self._crew.each(lambda k: with_neighbors(self._parts[k], engine.neighbors))
            return
        n, workers = machine.scene.n, self.workers
        if not self._parts:
            self._room = int(n * self._lengths.held) + 1024
        self._partition = self._share_out()
        owners, flags, _ = self._partition
        self._beside = [sorted(set(owners[flags[k] == ZONE].tolist())) for k in range(workers)]
        self._truth = share_of(engine, np.full(n, OWN, np.uint8))
        if self._ledger is None or self._ledger.entries.shape[1] < self._room:
            self._ledger = make_ledger(workers, self._room)
        pages = [page_of(self._ledger, k) for k in range(workers)]
        self._parts = self._crew.each(lambda k: make_part(engine, flags[k], pages[k]))
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
        return self._rims.depths(self.machine.scene, self._lengths.flight(), self._lengths.held)

    def close(self) -> None:
        """End the threads."""
        self._crew.close()
