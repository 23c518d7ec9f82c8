"""Which of two ways runs what comes next: the faster one, as measured now and then. Neither changes a bit.

Several workers go at the pace of the one whose core is kept busy; one is faster in small systems. Asking for
memory ahead in sectors gains from some ten or hundred thousand particles on, by processor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

STRETCH = 1.0  # collisions a particle after which a rate is known

LEAST_SECONDS = 0.1
"""Wall time [s] after which it is known at the earliest: several turns of the system's scheduler."""

MOST_COST, COST = 1.0 / 16.0, 1.0 / 128.0
"""Part of the wall time that is lost by trials of the slower one: at first, and in the long run. After each
trial that confirms who is faster, the next one comes after twice the time.
"""

FEWEST_STRETCHES = 16
"""Stretches between two trials at least, and after one that showed that the other is faster."""

FALL = 0.75
"""The other is tried at once where the rate falls below this part of what it was at the last comparison."""


class Pace:
    """The rates of two ways to run, and which of them is to go on."""

    def __init__(self, run_state: RunState):
        self.run_state = run_state
        self._first = True  # whether the first one was faster
        self.trial = False  # whether the other one runs
        self._rates = {True: 0.0, False: 0.0}  # of the first and the second, 0 where it is not known [1/s]
        self._compared = 0.0  # the rate of the faster one when they were compared last
        self._wait = 0.0  # wall time between two trials [s]
        self._left = 0.0  # and until the next one
        self._begin()

    def _begin(self) -> None:
        self._collisions, self._seconds = self.run_state.collisions, self.run_state.seconds

    def first(self) -> bool:
        """Return whether the first way is to go on; what ran since the last call was run as it said."""
        seconds = self.run_state.seconds - self._seconds
        count = self.run_state.collisions - self._collisions
        if seconds >= LEAST_SECONDS and count >= 0.5 * STRETCH * self.run_state.scene.n:
            self._rates[self._first != self.trial] = count / seconds
            self._left -= seconds
            self._decide(seconds)
            self._begin()
        return self._first != self.trial

    def _stretch(self, rate: float) -> float:
        """Return how long a stretch takes [s]."""
        return max(LEAST_SECONDS, 0.5 * STRETCH * self.run_state.scene.n / rate)

    def _decide(self, seconds: float) -> None:
        """Choose what runs the next stretch, after one that took some time [s]."""
        rate, other = self._rates[self._first], self._rates[not self._first]
        if not self.trial:
            self.trial = self._left <= 0.0 or rate < FALL * self._compared
            return
        self.trial = False
        if other > rate:
            self._first, self._wait, rate, lost = not self._first, 0.0, other, 0.0
        else:
            lost = seconds * (1.0 - other / rate)
        self._compared = rate
        least = max(lost / MOST_COST, FEWEST_STRETCHES * self._stretch(rate))
        self._wait = max(min(2.0 * self._wait, lost / COST), least)
        self._left = self._wait
