"""One system on several threads: windows of time that all parts run together, kept or run again."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from carom.engine import constants, cycle
from carom.engine.build import stripped
from carom.engine.calendar import FEWEST, LARGE_SYSTEM_FACTOR, MOST
from carom.engine.domains.decomposition import most_slabs, slabs_of
from carom.engine.domains.event_log_merge import lp_events_of, make_all_events
from carom.engine.domains.logical_process import (
    begin_window,
    has_messages,
    make_channels,
    make_process,
    refill_queue,
    stop,
    stopped,
    why_not_parallel,
    with_larger_heap,
)
from carom.engine.domains.rollback import commit, make_saved_state, roll_back, save_state
from carom.engine.epochs import advance_epoch, retime_all
from carom.engine.neighbors.prefetch import HUGE
from carom.engine.observers.interface import Observers
from carom.processors import cores
from carom.simulation.autotune import Pace
from carom.simulation.workers.thread_pool import ThreadPool, signals_held
from carom.simulation.workers.window_length import LENGTH, WindowLength

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

CYCLES = 2_000_000
"""Cycles in one call of a worker: between two, others wait for it, and it looks whether it is to stop."""

MOST_ROLLBACKS = 6
"""Times that a window is run again, half as long each time, before the plain cycle takes it over."""

SPINS_SHARED, SPINS_OWN = 64, 4096
"""Refusals after which a thread lets others go first: where they share cores, and where each has its own."""

EVENTS = 0.7  # events of a part for each collision of a particle there, about

MORE, LEAST_ROOM = 1.5, 4096
"""Room for collisions in a window, over those that a part should have, and in addition."""

EXTRA_CAPACITY = 4  # for how many more each list and each cell has room, where all have the same

COMMITS_IN_A_ROW = 16  # windows kept in a row after which parts may be further ahead of each other again


LEAST_PER_WINDOW = 0.1  # collisions for each particle below which a stretch is not worth a window

TIME_WINDOW = 8.0  # widths of a bucket, of a few cycles each, that a part may be ahead of another

MANY = 100_000
"""Components below which that is less, in proportion: more often something comes late then."""


@dataclass
class Timings:
    """Where the time of a run in windows went [s], and what came of it."""

    windows: int = 0  # kept
    repeats: int = 0  # run again
    collisions: int = 0  # in windows that were kept
    wall: float = 0.0  # in windows
    save_state: float = 0.0  # keeping what a window begins with
    run: float = 0.0
    merge: float = 0.0  # adding up
    epochs: float = 0.0  # going over into the next
    rolled_back: float = 0.0  # windows that were run again
    busy: float = 0.0  # CPU time of all workers in ``run``


@dataclass
class Settings:
    """How long windows are, how far parts may be ahead, and whether there must be any; None: as measured."""

    collisions: float | None = None  # a particle, in a window
    time_window: float | None = None  # widths of a bucket at a border; halved where it loses a window
    least: float = LEAST_PER_WINDOW  # a particle, below which the plain cycle runs
    compare: bool = True  # time the plain cycle now and then


@dataclass
class Executive:
    """Workers for one run."""

    run_state: RunState  # between two windows its arrays hold the true state
    workers: int  # threads
    settings: Settings = field(default_factory=Settings)
    timings: Timings = field(default_factory=Timings)  # where the time went

    def __post_init__(self) -> None:
        wanted, least = self.settings.collisions, self.settings.least
        self._pool = ThreadPool(self.workers)
        self._window_length = WindowLength(self.run_state, LENGTH if wanted is None else wanted, least)
        if wanted is not None:
            self._window_length.share = 1.0
        self._pace = Pace(self.run_state) if self.settings.compare else None
        self._several = True  # whether windows were wanted last
        time_window = self.settings.time_window
        scheme, neighbors = self.run_state.scheme, cast(Any, self.run_state.engine.neighbors)
        if scheme.kind == "lists" and scheme.step == 0 and not neighbors.counts.any():
            for full_cell in (True, False):  # a window that finds no room is run again
                self.run_state.enlarge_neighbors(full_cell, EXTRA_CAPACITY)
        self._most = (
            TIME_WINDOW * min(1.0, self.run_state.scene.n / MANY) if time_window is None else time_window
        )
        self._time_window = self._most
        self._streak = 0
        self._engine: Any = None
        self._all_events: Any = None
        self._detailed = False
        self._capacity = 0
        self._processes: list[Any] = []
        self._saved: Any = None  # the state that a window begins with
        self._width = 0.0  # of the buckets of all parts
        self._decided = True  # whether the last window was kept, or undone
        self._queues_valid = False  # whether the calendars of the parts are those of the true state
        self._committed: tuple[Any, ...] = ()
        self._plain = (-1, 0.0)  # epoch, and until when the plain cycle is to run
        self._idle: list[bool] = []
        self._busy: list[float] = []
        self._idling = threading.Lock()
        self._over = threading.Event()

    # One window -------------------------------------------------------------------------------------------

    def window(self, stop: tuple[np.int64, float], target: int) -> bool:
        """Try a window: True if one ran, kept or undone; False if the plain cycle is to go on.

        It ends at ``stop``, an epoch and offset, and stays short of collision number ``target``.
        """
        run_state = self.run_state
        before, self._several = self._several, self._pace is None or self._pace.first()
        if not self._several:
            return False
        if not before and self._pace is not None and self._pace.trial:
            self._window_length.restart()
        record = run_state.engine.state.clock[0]
        epoch, start = int(record.epoch), float(record.now)
        if run_state.clock.epoch == epoch:
            start = max(start, run_state.clock.offset)
        last = math.nextafter(float(record.length), 0.0)
        if int(stop[0]) < epoch or run_state.clock.epoch > epoch:
            return False
        if start >= last:
            return int(stop[0]) > epoch and self._next_epoch(epoch) and self.window(stop, target)
        if int(stop[0]) == epoch:
            last = min(last, float(stop[1]))
        if epoch == self._plain[0] and start < self._plain[1]:  # windows did not get over this
            return False
        end = self._window_length.end(start, last, target)
        return end is not None and self._fits() and self._run(epoch, start, end, target)

    def _fits(self) -> bool:
        """Return whether the box has room for the slabs, with the neighbor scheme that the run has now."""
        engine: Any = self.run_state.engine
        if why_not_parallel(engine) is not None:
            return False
        return self.workers == 1 or self.workers <= most_slabs(engine.neighbors, self.run_state.scene.box)

    def _run(self, epoch: int, start: float, end: float, target: int) -> bool:
        began = time.perf_counter()
        self._ready(epoch, start)
        self._all_events.used[:] = 0
        begin_window(self._processes, epoch, start, end, self._time_window)
        self._pool.each(self._save_state)
        self._queues_valid = self._decided = False
        self._idle = [False] * self.workers
        self._over.clear()
        commit = time.perf_counter()
        try:
            codes = self._pool.each(self._advance, epoch, end, halt=self._halt)
            ran = time.perf_counter()
            with signals_held():
                good = self._commit_or_roll_back(codes, epoch, start, end, target)
        except BaseException:  # Ctrl-C: the true state is that of the beginning
            if not self._decided:
                self._roll_back(epoch, start)
            raise
        timings, now = self.timings, time.perf_counter()
        timings.wall += now - began
        if not good:
            timings.repeats += 1
            timings.rolled_back += now - began
            return True
        timings.windows += 1
        timings.busy += sum(self._busy)
        timings.save_state += commit - began
        timings.run += ran - commit
        timings.merge += now - ran
        return True

    def _commit_or_roll_back(
        self, codes: list[int], epoch: int, start: float, end: float, target: int
    ) -> bool:
        """Keep a window, or go back to its beginning; return which of the two."""
        reached = all(code in (constants.REACHED_TIME, constants.IDLE) for code in codes)
        reached = reached and not stopped(self._processes)
        count = sum(int(process.engine.tallies[0].collisions) for process in self._processes)
        good = reached and self.run_state.collisions + count < target
        if good:
            engine: Any = self.run_state.engine
            commit(engine, self._processes, self._all_events, self._pool.each, self.run_state.flush_log)
            self._at(epoch, end)
            self._queues_valid = True
            self.timings.collisions += count
            self._after_commit()
        else:
            if constants.NEEDS_NEIGHBORS in codes:
                self.run_state.enlarge_neighbors(
                    times=EXTRA_CAPACITY if self.run_state.scheme.step == 0 else 1
                )
            self._roll_back(epoch, start)
            self._after_rollback(codes, epoch, end, end - start, reached)
        self._decided = True
        return good

    def _next_epoch(self, epoch: int) -> bool:
        """Begin the next epoch with all workers, where all has happened that was due in this one."""
        if not self._queues_valid or self._committed != self._state():
            return False
        began = time.perf_counter()
        with signals_held():
            self._pool.each(self._advance_epoch_of)
            self._pool.each(self._retime_of)
            self._at(epoch + 1, 0.0)
        self._queues_valid = False
        elapsed = time.perf_counter() - began
        self.timings.epochs += elapsed
        self.timings.wall += elapsed
        return True

    def _at(self, epoch: int, now: float) -> None:
        """Note that the true state is now of this time."""
        refill_queue(self.run_state.engine, epoch, now)
        self.run_state.clock.epoch, self.run_state.clock.offset = epoch, now
        self._committed = self._state()

    # Its steps --------------------------------------------------------------------------------------------

    def _mine(self, k: int) -> tuple[int, int]:
        """Return the share of worker k of what is done for one component after the other."""
        n = self.run_state.scene.n
        return n * k // self.workers, n * (k + 1) // self.workers

    def _save_state(self, k: int) -> None:
        """Keep a share of the state, for the case that the window is lost."""
        save_state(self._saved, self.run_state.engine.state, slice(*self._mine(k)))

    def _roll_back(self, epoch: int, start: float) -> None:
        """Go back to the beginning of a window that was lost: scheduling leaves no trace."""
        with signals_held():
            roll_back(self._saved, self.run_state.engine.state, epoch, start)
            self.run_state.scheduled = False
        self.run_state.schedule()

    def _advance_epoch_of(self, k: int) -> None:
        engine = stripped(self.run_state.engine)
        advance_epoch(engine.model, engine.state, engine.neighbors, *map(np.int64, self._mine(k)))

    def _retime_of(self, k: int) -> None:
        engine = stripped(self.run_state.engine)
        retime_all(engine.model, engine.state, *map(np.int64, self._mine(k)))

    def _advance(self, k: int, epoch: int, end: float) -> int:
        began = time.thread_time()
        try:
            return self._to_the_end(k, epoch, end)
        except BaseException:  # the others do not wait for it
            self._halt()
            raise
        finally:
            self._busy[k] = time.thread_time() - began

    def _halt(self) -> None:
        stop(self._processes)

    def _to_the_end(self, k: int, epoch: int, end: float) -> int:
        """Run part k to the end of the window, or until all are to stop."""
        code = constants.SPENT
        while not stopped(self._processes):
            code = self._cycle(k, epoch, end)
            if code in (constants.REACHED_TIME, constants.IDLE):
                if self._wait_for_others(k):
                    break
            elif code == constants.NEEDS_HEAP:
                self._processes[k] = with_larger_heap(self._processes[k])
            elif code != constants.SPENT:
                self._halt()
        return code

    def _cycle(self, k: int, epoch: int, end: float) -> int:
        process = self._processes[k]
        until = np.int64(epoch), end
        code, _ = cycle.run(*process.engine, *until, np.int64(2**62), np.int64(CYCLES))
        return int(code)

    def _wait_for_others(self, k: int) -> bool:
        """Wait at the end of the window; False if part k has messages to read, True if all is over."""
        with self._idling:
            self._idle[k] = True
            if all(self._idle) and not any(map(has_messages, self._processes)):
                self._over.set()
        while not self._over.is_set():
            if stopped(self._processes):
                return True
            if has_messages(self._processes[k]):
                with self._idling:
                    self._idle[k] = False
                return False
            time.sleep(0)
        return True

    # What windows teach -----------------------------------------------------------------------------------

    def _after_commit(self) -> None:
        """Let parts be further ahead of each other after many windows that were kept."""
        self._window_length.commit()
        self._streak += 1
        if self._streak >= COMMITS_IN_A_ROW:
            self._streak, self._time_window = 0, min(2.0 * self._time_window, self._most)

    def _after_rollback(self, codes: list[int], epoch: int, end: float, length: float, good: bool) -> None:
        """Prepare to run a window again, from where it began."""
        self._streak = 0
        self._window_length.rollback()
        if constants.NEEDS_NEIGHBORS in codes:
            return
        if constants.NEEDS_LOG in codes:
            self._engine = None  # with more room
            self._capacity *= 2
        else:
            self._window_length.halve(length)
            if self._window_length.failed > MOST_ROLLBACKS:
                self._plain = (epoch, end)
                self._window_length.commit()
            elif not good:
                self._time_window *= 0.5

    # The parts --------------------------------------------------------------------------------------------

    def _state(self) -> tuple[Any, ...]:
        """Return what changes whenever the plain cycle has run."""
        record = self.run_state.engine.state.clock[0]
        control = self.run_state.engine.calendar.control[0]
        return int(record.epoch), float(record.now), int(control.full), self.run_state.collisions

    def _ready(self, epoch: int, start: float) -> None:
        """Make the parts, where the engine is another than before, and lay out their calendars."""
        other = self._engine is None or self._engine.neighbors is not self.run_state.engine.neighbors
        if other or self._detailed != self._details():
            self._make_processes()
        valid = self._queues_valid and self._committed == self._state()
        wanted = self._bucket_width()
        if not 0.5 < self._width / wanted < 2.0:
            self._width, valid = 2.0 ** round(math.log2(wanted)), False
        if not valid:
            for process in self._processes:
                refill_queue(process.engine, epoch, start, self._width)

    def _details(self) -> bool:
        """Tell whether anybody asks for more of a collision than its virial."""
        model: Any = self.run_state.engine.model
        return isinstance(model.observers, Observers) or model.obstacles is not None

    def _make_processes(self) -> None:
        """Make the parts, and compile what they run: at a time before anything is due."""
        run_state, workers = self.run_state, self.workers
        scene: Any = run_state.scene
        engine: Any = run_state.engine
        if self._capacity == 0:
            self._capacity = int(MORE * 0.5 * scene.n * self._window_length.held / workers) + LEAST_ROOM
        self._detailed = self._details()
        all_events = self._all_events
        small = all_events is None or all_events.entries.shape[1] < self._capacity
        if small or (all_events.details is None) == self._detailed:
            self._all_events = make_all_events(workers, self._capacity, self._detailed)
        slabs = slabs_of(engine.neighbors, scene.box, scene.periodic, workers)
        channels = make_channels(workers, scene.dimension)
        events_of_all = [lp_events_of(self._all_events, k) for k in range(workers)]
        spins_before_yield = SPINS_OWN if workers <= cores() else SPINS_SHARED
        self._processes = [
            make_process(engine, k, slabs, channels, events_of_all[k], spins_before_yield)
            for k in range(workers)
        ]
        self._engine, self._queues_valid, self._busy = engine, False, [0.0] * workers
        self._saved = make_saved_state(engine.state)
        begin_window(self._processes, 0, 0.0, 0.0, 0.0)
        refill_queue(self._processes[0].engine, 0, 0.0, self._width)
        self._cycle(0, 0, -math.inf)

    def _bucket_width(self) -> float:
        """Return how wide the buckets of all parts should be: a few cycles of each fall into one."""
        n = self.run_state.scene.n
        cycles = EVENTS * self._window_length.rate() * n / self.workers
        return (LARGE_SYSTEM_FACTOR if n >= HUGE else 1.0) * math.sqrt(FEWEST * MOST) / cycles

    def close(self) -> None:
        """End the threads."""
        self._pool.close()
