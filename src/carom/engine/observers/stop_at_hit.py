"""The end of a run at a contact with an obstacle: the cycle returns before anything else happens."""

from __future__ import annotations

import numpy as np

from carom.engine.constants import OBSTACLE
from carom.engine.observers.interface import Observer


class StopAtHit(Observer):
    """A counter of contacts with some obstacles, in the chain for the length of a run alone."""

    wanted: np.ndarray  # whether contacts with each obstacle count, by the engine's numbers, bool
    left: np.ndarray  # contacts that are still to come, (1,) int64

    def ends_run(self):
        return self.left[0] <= 0

    def record(self, clock, i, ref, impulse):
        number = OBSTACLE - ref
        if 0 <= number < len(self.wanted) and self.wanted[number]:
            self.left[0] -= 1
