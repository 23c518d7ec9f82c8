"""Self-diffusion by one rule for all methods: the slope of the mean square displacement."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from carom.observables.statistics import Estimate, blocking, unwarned

BLOCK = 2.5
"""Duration of a block [mean free times]."""

NEAR, FAR = 4, 8
"""The slope is taken between these numbers of blocks: 10 and 20 mean free times. In a fluid it is larger at
later times, because collective currents decay slowly; slow methods do not reach such times."""

FASTEST = 6.0
"""Largest expected velocity along an axis [thermal velocities]: one in 500 million is faster."""


def looks(box: Sequence[float], thermal: float, duration: float) -> int:
    """Return in how many parts of a duration [time] no sphere crosses half of the box.

    ``thermal`` is the root mean square velocity along an axis [length / time].
    """
    return max(1, math.ceil(FASTEST * thermal * duration / (0.5 * min(box))))


class EinsteinSlope:
    """D as ``(<r^2(20)> - <r^2(10)>) / (2 d t(10))`` with times in mean free times, over all origins.

    Positions (n, d), at the start, are up to whole boxes [length]; ``duration`` is that of a block [time].
    """

    def __init__(self, positions: np.ndarray, box: Sequence[float], duration: float):
        self._box, self._duration = np.asarray(box), duration
        self._at = positions
        self._way: np.ndarray = np.zeros_like(positions)
        self._ways = deque([self._way], maxlen=FAR + 1)
        self.values: list[float] = []

    def look(self, positions: np.ndarray) -> None:
        """Follow the spheres to where they are now."""
        step = positions - self._at
        self._way = self._way + step - self._box * np.rint(step / self._box)
        self._at = positions

    def mark(self) -> None:
        """End a block."""
        self._ways.append(self._way)
        if len(self._ways) == FAR + 1:
            far, near = (
                float(((self._way - self._ways[-1 - lag]) ** 2).sum(axis=1).mean()) for lag in (FAR, NEAR)
            )
            time = (FAR - NEAR) * self._duration
            self.values.append((far - near) / (2.0 * self._way.shape[1] * time))

    def estimate(self) -> Estimate:
        """Return D [length^2 / time]."""
        with unwarned():  # the table shows the error bar
            return blocking(self.values)
