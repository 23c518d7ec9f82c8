"""One system on several threads: windows of time that all parts run together, kept or run again."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from carom.simulation.workers.crew import Crew, cores
from carom.simulation.workers.lengths import LENGTH, Lengths
from carom.simulation.workers.shares import LEAD, MANY, Settings, Shares

if TYPE_CHECKING:
    from carom.simulation.machine import Machine

CYCLES = 2_000_000
"""Cycles in one call of a worker: between two, others wait for it, and it looks whether it is to stop."""

PATIENCE = 6
"""Times that a window is run again, half as long each time, before the plain cycle takes it over."""

OFTEN, SELDOM = 64, 4096
"""Refusals after which a thread lets others go first: where they share cores, and where each has its own."""

EVENTS = 0.7
"""Events of a part for each collision of a particle there, about."""

MORE, LEAST_ROOM = 1.5, 4096
"""Room for collisions in a window, over those that a part should have, and in addition."""

SPARE = 4
"""For how many more each list and each cell has room, where all have the same."""

STREAK = 16
"""Windows kept in a row after which parts may be further ahead of each other again."""


@dataclass
class Team:
    """Workers for one machine.

    Attributes
    ----------
    machine : Machine
        What runs. Between two windows its arrays hold the true state.
    workers : int
        How many threads.
    settings : Settings
        How long windows are, and how far parts may be ahead of each other.
    shares : Shares
        Where the time went.
    """

    machine: Machine
    workers: int
    settings: Settings = field(default_factory=Settings)
    shares: Shares = field(default_factory=Shares)

    def __post_init__(self) -> None:
        wanted, least = self.settings.collisions, self.settings.least
        self._crew = Crew(self.workers)
        self._lengths = Lengths(self.machine, LENGTH if wanted is None else wanted, least)
        if wanted is not None:
            self._lengths.share = 1.0
        lead = self.settings.lead
        scheme, neighbors = self.machine.scheme, cast(Any, self.machine.engine.neighbors)
        if scheme.kind == "lists" and scheme.step == 0 and not neighbors.counts.any():
            for full_cell in (True, False):  # a window that finds no room is run again
                self.machine.enlarge_neighbors(full_cell, SPARE)
        self._most = LEAD * min(1.0, self.machine.scene.n / MANY) if lead is None else lead
        self._lead = self._most
        self._streak = 0
        self._engine: Any = None
        self._ledger: Any = None
        self._detailed = False
        self._room = 0
        self._parts: list[Any] = []
        self._kept: tuple[np.ndarray, np.ndarray | None] | None = None
        self._width = 0.0  # of the buckets of all parts
        self._settled = True  # whether the last window was kept, or undone
        self._fresh = False  # whether the calendars of the parts are those of the true state
        self._mark: tuple[Any, ...] = ()
        self._plain = (-1, 0.0)  # epoch, and until when the plain cycle is to run
        self._idle: list[bool] = []
        self._busy: list[float] = []
        self._idling = threading.Lock()
        self._over = threading.Event()

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
            return int(stop[0]) > epoch and self._turn(epoch) and self.window(stop, target)
        if int(stop[0]) == epoch:
            last = min(last, float(stop[1]))
        if epoch == self._plain[0] and start < self._plain[1]:  # windows did not get over this
            return False
        end = self._lengths.end(start, last, target)
        return end is not None and self._fits() and self._run(epoch, start, end, target)

    def _fits(self) -> bool:
        """Return whether the box has room for the slabs, with the neighbour scheme that the run has now."""
        from carom.engine.windows.slabs import most_slabs

        neighbors: Any = self.machine.engine.neighbors
        return self.workers == 1 or self.workers <= most_slabs(neighbors, self.machine.scene.box)

    def _run(self, epoch: int, start: float, end: float, target: int) -> bool:
        from carom.compiling.held import signals_held
        from carom.engine.windows.parts import begin_window

        began = time.perf_counter()
        self._ready(epoch, start)
        self._ledger.used[:] = 0
        begin_window(self._parts, epoch, start, end, self._lead)
        self._crew.each(self._keep)
        self._fresh = self._settled = False
        self._idle = [False] * self.workers
        self._over.clear()
        kept = time.perf_counter()
        try:
            codes = self._crew.each(self._advance, epoch, end, halt=self._halt)
            ran = time.perf_counter()
            with signals_held():
                good = self._settle(codes, epoch, start, end, target)
        except BaseException:  # Ctrl-C: the true state is that of the beginning
            if not self._settled:
                self._back(epoch, start)
            raise
        shares, now = self.shares, time.perf_counter()
        shares.wall += now - began
        if not good:
            shares.repeats += 1
            shares.lost += now - began
            return True
        shares.windows += 1
        shares.busy += sum(self._busy)
        shares.keep += kept - began
        shares.run += ran - kept
        shares.merge += now - ran
        return True

    def _settle(self, codes: list[int], epoch: int, start: float, end: float, target: int) -> bool:
        """Keep a window, or go back to its beginning; return which of the two."""
        from carom.engine import constants
        from carom.engine.windows.parts import stopped

        reached = all(code in (constants.REACHED_TIME, constants.IDLE) for code in codes)
        reached = reached and not stopped(self._parts)
        count = sum(int(part.engine.tallies[0].collisions) for part in self._parts)
        good = reached and self.machine.collisions + count < target
        if good:
            self._merge()
            self._at(epoch, end)
            self._fresh = True
            self.shares.collisions += count
            self._learn()
        else:
            if constants.NEEDS_NEIGHBORS in codes:
                self.machine.enlarge_neighbors(times=SPARE if self.machine.scheme.step == 0 else 1)
            self._back(epoch, start)
            self._again(codes, epoch, end, end - start, reached)
        self._settled = True
        return good

    def _turn(self, epoch: int) -> bool:
        """Begin the next epoch with all workers, where all has happened that was due in this one."""
        from carom.compiling.held import signals_held

        if not self._fresh or self._mark != self._state():
            return False
        began = time.perf_counter()
        with signals_held():
            self._crew.each(self._turn_some)
            self._crew.each(self._renew_some)
            self._at(epoch + 1, 0.0)
        self._fresh = False
        passed = time.perf_counter() - began
        self.shares.turn += passed
        self.shares.wall += passed
        return True

    def _at(self, epoch: int, now: float) -> None:
        """Note that the true state is now of this time."""
        from carom.engine.windows.parts import restart

        restart(self.machine.engine, epoch, now)
        self.machine.clock.epoch, self.machine.clock.offset = epoch, now
        self._mark = self._state()

    # Its steps --------------------------------------------------------------------------------------------

    def _mine(self, k: int) -> tuple[int, int]:
        """Return the share of worker k of what is done for one component after the other."""
        n = self.machine.scene.n
        return n * k // self.workers, n * (k + 1) // self.workers

    def _keep(self, k: int) -> None:
        """Copy rows and images, for the case that the window is lost."""
        assert self._kept is not None
        state: Any = self.machine.engine.state
        mine = slice(*self._mine(k))
        rows, images = self._kept
        rows[mine] = state.rows.view(np.ndarray)[mine]
        if images is not None:
            images[mine] = state.images[mine]

    def _back(self, epoch: int, start: float) -> None:
        """Go back to the beginning of a window that was lost: scheduling leaves no trace."""
        from carom.compiling.held import signals_held

        assert self._kept is not None
        machine = self.machine
        state: Any = machine.engine.state
        rows, images = self._kept
        with signals_held():
            state.rows.view(np.ndarray)[: len(rows)] = rows
            if images is not None:
                state.images[...] = images
            state.clock.epoch[0], state.clock.now[0] = epoch, start
            machine.scheduled = False
        machine.schedule()

    def _turn_some(self, k: int) -> None:
        from carom.engine.windows.epochs import turn

        engine = self.machine.engine
        turn(engine.model, engine.state, engine.neighbors, *map(np.int64, self._mine(k)))

    def _renew_some(self, k: int) -> None:
        from carom.engine.windows.epochs import renew_all

        engine = self.machine.engine
        renew_all(engine.model, engine.state, *map(np.int64, self._mine(k)))

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
        from carom.engine.windows.parts import stop

        stop(self._parts)

    def _to_the_end(self, k: int, epoch: int, end: float) -> int:
        """Run part k to the end of the window, or until all are to stop."""
        from carom.engine import constants
        from carom.engine.windows.parts import stopped, with_larger_heap

        code = constants.SPENT
        while not stopped(self._parts):
            code = self._cycle(k, epoch, end)
            if code in (constants.REACHED_TIME, constants.IDLE):
                if self._rest(k):
                    break
            elif code == constants.NEEDS_HEAP:
                self._parts[k] = with_larger_heap(self._parts[k])
            elif code != constants.SPENT:
                self._halt()
        return code

    def _cycle(self, k: int, epoch: int, end: float) -> int:
        from carom.engine import cycle

        part = self._parts[k]
        until = np.int64(epoch), end
        code, _ = cycle.run(*part.engine, part.gathered, *until, np.int64(2**62), np.int64(CYCLES))
        return int(code)

    def _rest(self, k: int) -> bool:
        """Wait at the end of the window; False if part k has messages to read, True if all is over."""
        from carom.engine.windows.parts import has_mail, stopped

        with self._idling:
            self._idle[k] = True
            if all(self._idle) and not any(map(has_mail, self._parts)):
                self._over.set()
        while not self._over.is_set():
            if stopped(self._parts):
                return True
            if has_mail(self._parts[k]):
                with self._idling:
                    self._idle[k] = False
                return False
            time.sleep(0)
        return True

    def _merge(self) -> None:
        from carom.engine.windows.ledger import merge, put_in_order

        machine, engine = self.machine, self.machine.engine
        heads = np.zeros(self.workers, np.int64)
        log = None if machine.log is None else machine.log.buffer
        total = engine.tallies[0]
        for part in self._parts:
            tally = part.engine.tallies[0]
            for name in ("advancements", "transits", "returns", "clamped"):
                total[name] += tally[name]
            total.depth = max(total.depth, tally.depth)
            if part.engine.calendar.desk[0].late != 0:
                put_in_order(part.gathered.page)
        while not merge(
            self._ledger,
            heads,
            engine.state.clock,
            engine.tallies,
            engine.model.observers,
            engine.model.obstacles,
            engine.model.boundary,
            log,
        ):
            machine.flush_log()

    # What windows teach -----------------------------------------------------------------------------------

    def _learn(self) -> None:
        """Let parts be further ahead of each other after many windows that were kept."""
        self._lengths.kept()
        self._streak += 1
        if self._streak >= STREAK:
            self._streak, self._lead = 0, min(2.0 * self._lead, self._most)

    def _again(self, codes: list[int], epoch: int, end: float, length: float, good: bool) -> None:
        """Prepare to run a window again, from where it began."""
        from carom.engine import constants

        self._streak = 0
        self._lengths.lost()
        if constants.NEEDS_NEIGHBORS in codes:
            return
        if constants.NEEDS_LOG in codes:
            self._engine = None  # with more room
            self._room *= 2
        else:
            self._lengths.halve(length)
            if self._lengths.failed > PATIENCE:
                self._plain = (epoch, end)
                self._lengths.kept()
            elif not good:
                self._lead *= 0.5

    # The parts --------------------------------------------------------------------------------------------

    def _state(self) -> tuple[Any, ...]:
        """Return what changes whenever the plain cycle has run."""
        record = self.machine.engine.state.clock[0]
        control = self.machine.engine.calendar.control[0]
        return int(record.epoch), float(record.now), int(control.full), self.machine.collisions

    def _ready(self, epoch: int, start: float) -> None:
        """Make the parts, where the engine is another than before, and lay out their calendars."""
        from carom.engine.windows.parts import restart

        other = self._engine is None or self._engine.neighbors is not self.machine.engine.neighbors
        if other or self._detailed != self._details():
            self._make_parts()
        fresh = self._fresh and self._mark == self._state()
        wanted = self._bucket()
        if not 0.5 < self._width / wanted < 2.0:
            self._width, fresh = 2.0 ** round(math.log2(wanted)), False
        if not fresh:
            for part in self._parts:
                restart(part.engine, epoch, start, self._width)

    def _details(self) -> bool:
        """Tell whether anybody asks for more of a collision than its virial."""
        engine: Any = self.machine.engine
        asking = (engine.model.observers, engine.model.obstacles, self.machine.log)
        return any(who is not None for who in asking)

    def _make_parts(self) -> None:
        """Make the parts, and compile what they run: at a time before anything is due."""
        from carom.engine.windows.ledger import make_ledger, page_of
        from carom.engine.windows.parts import begin_window, make_board, make_part, restart
        from carom.engine.windows.slabs import slabs_of

        machine, workers = self.machine, self.workers
        scene: Any = machine.scene
        engine: Any = machine.engine
        if self._room == 0:
            self._room = int(MORE * 0.5 * scene.n * self._lengths.held / workers) + LEAST_ROOM
        self._detailed = self._details()
        ledger = self._ledger
        small = ledger is None or ledger.entries.shape[1] < self._room
        if small or (ledger.details is None) == self._detailed:
            self._ledger = make_ledger(workers, self._room, self._detailed)
        slabs = slabs_of(engine.neighbors, scene.box, scene.periodic, workers)
        board = make_board(workers, scene.dimension)
        pages = [page_of(self._ledger, k) for k in range(workers)]
        patience = SELDOM if workers <= cores() else OFTEN
        self._parts = [make_part(engine, k, slabs, board, pages[k], patience) for k in range(workers)]
        self._engine, self._fresh, self._busy = engine, False, [0.0] * workers
        rows, images = engine.state.rows.view(np.ndarray)[: scene.n], engine.state.images
        self._kept = np.empty_like(rows), None if images is None else np.empty_like(images)
        begin_window(self._parts, 0, 0.0, 0.0, 0.0)
        restart(self._parts[0].engine, 0, 0.0, self._width)
        self._cycle(0, 0, -math.inf)

    def _bucket(self) -> float:
        """Return how wide the buckets of all parts should be: a few cycles of each fall into one."""
        from carom.engine.calendar import AHEAD, FEWEST, MOST
        from carom.engine.neighbors.prefetch import HUGE

        n = self.machine.scene.n
        cycles = EVENTS * self._lengths.rate() * n / self.workers
        return (AHEAD if n >= HUGE else 1.0) * math.sqrt(FEWEST * MOST) / cycles

    def close(self) -> None:
        """End the threads."""
        self._crew.close()
