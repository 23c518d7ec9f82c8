"""How long windows are: a number of collisions a particle, and what is left of an epoch in equal pieces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

LENGTH = 8.0
"""Collisions a particle that a window holds at most: all is lost where it must be run again."""

FIRST, SMALLEST = 0.5, 0.25  # part of this in the first windows, and where windows are often lost

COMMITS_IN_A_ROW = 8  # windows kept in a row after which they become twice as long

FEWEST = 32  # collisions below which it never pays

SEEN = 0.1  # collisions a particle from which a rate follows

GUESSED = 0.25
"""How long the first window is, in proportion: disks placed at random collide more often at first."""

DRIFT = 0.002
"""By how much the rate may change, in proportion, from one window to the next, in addition to what it changed
by the last time.
"""


@dataclass
class WindowLength:
    """The lengths of a team's windows."""

    run_state: RunState
    held: float  # collisions a particle in a window at most
    least: float  # below which a stretch is left to the plain cycle
    share: float = FIRST  # part of ``held`` for the next window
    length: float = 0.0  # of the next [engine's time], 0 before the first
    failed: int = 0  # windows in a row that were lost

    def __post_init__(self) -> None:
        self._known = 0.0  # rate of a particle, as it was found last
        self._change = 0.1  # and by how much it changed, in proportion: unknown at first
        self._streak = 0
        self._counted = self.run_state.collisions
        self._base, self._instant = self.run_state.clock.base, self.run_state.clock.instant

    def rate(self) -> float:
        """Return the collisions of a particle a time [1 / engine's time]."""
        run_state = self.run_state
        n = run_state.scene.n
        clock = run_state.clock
        if clock.base != self._base:  # other velocities, maybe in another unit
            self._base, self._known = clock.base, 0.0
            self._counted, self._instant = run_state.collisions, clock.instant
        counted = 2.0 * (run_state.collisions - self._counted) / n
        if counted >= SEEN:
            elapsed = float(clock.since_base(clock.instant) - clock.since_base(self._instant))
            if elapsed > 0.0:
                before, self._known = self._known, counted / elapsed
                self._change = abs(self._known / before - 1.0) if before > 0.0 else self._change
            self._counted, self._instant = run_state.collisions, clock.instant
        if self._known > 0.0:
            return self._known
        from carom.engine.neighbors.plan import collision_rate

        scene = run_state.scene
        speed = math.sqrt(float(np.mean(np.sum(run_state.speeds**2, axis=1))))
        return collision_rate(scene.packing_fraction, scene.dimension, scene.diameter, speed)

    def end(self, start: float, last: float, target: int) -> float | None:
        """Return when a window from ``start`` ends, by ``last`` and short of collision ``target``."""
        run_state = self.run_state
        rate = self.rate()
        if self.failed == 0:
            self.length = self.share * self.held * (1.0 if self._known > 0.0 else GUESSED) / rate
        # What is left of the epoch in windows of one length: a short one costs nearly as much as a long one.
        length = (last - start) / max(math.ceil((last - start) / self.length - 0.02), 1)
        left = target - run_state.collisions
        rate *= 0.5 * run_state.scene.n  # of all collisions
        if left < 2**60:
            # Short of it in spite of fluctuations: a window that goes beyond is of no use.
            ahead = min(left, rate * length)
            length = min(length, (left - 4.0 * math.sqrt(ahead) - (DRIFT + self._change) * ahead) / rate)
        if not rate * length >= max(self.least * run_state.scene.n, FEWEST):
            return None
        end = start + length
        return last if end > last - 1e-9 * length else end

    def commit(self) -> None:
        """Learn that a window was kept."""
        self.failed = 0
        self._streak += 1
        if self._streak == COMMITS_IN_A_ROW:
            self._streak, self.share = 0, min(2.0 * self.share, 1.0)

    def rollback(self) -> None:
        """Learn that a window was lost, for whatever reason."""
        self._streak, self.share = 0, max(0.5 * self.share, min(SMALLEST, self.share))

    def restart(self) -> None:
        """Let the next windows be as short as any."""
        self._streak, self.share = 0, min(SMALLEST, self.share)

    def halve(self, length: float) -> None:
        """Let the next window, which is run again, be half as long as it was."""
        self.length, self.failed = 0.5 * length, self.failed + 1
