"""How long windows are: a number of collisions a particle, and what is left of an epoch in equal pieces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from carom.simulation.machine import Machine

LENGTHS = {2: 4.0}
"""Collisions a particle that a window holds in some dimensions: longer in the plane, where rims are thin."""

LENGTH = 2.0
"""Collisions a particle that a window holds elsewhere."""

FEWEST = 32
"""Collisions below which it never pays."""

CROWDED = 1.25
"""Collisions over those that a window should hold, from which on the rate must have been another one."""


@dataclass
class Lengths:
    """The lengths of a team's windows.

    Attributes
    ----------
    machine : Machine
        What runs.
    held : float
        Collisions a particle that a window should hold.
    least : float
        Collisions a particle below which a stretch is left to the plain cycle.
    length : float
        Length of the next window [engine's time], 0 before the first.
    known_rate : float
        Collisions of a particle a time, as the last window had them [1 / engine's time], 0 before the first.
    failed : int
        Windows in a row whose parts disagreed.
    """

    machine: Machine
    held: float
    least: float
    length: float = 0.0
    known_rate: float = 0.0
    failed: int = 0

    def rate(self) -> float:
        """Return the collisions of a particle a time [1 / engine's time]."""
        machine = self.machine
        if self.known_rate > 0.0:
            return self.known_rate
        passed = float(machine.clock.since_base(machine.clock.instant))
        seen = machine.collisions - machine.counted
        if seen >= machine.scene.n and passed > 0.0:
            return 2.0 * seen / (machine.scene.n * passed)
        from carom.engine.neighbors.choice import collision_rate

        scene = machine.scene
        return collision_rate(scene.packing_fraction, scene.dimension, scene.diameter, self._speed())

    def flight(self) -> float:
        """Return the mean free path [length]."""
        return self._speed() / self.rate()

    def _speed(self) -> float:
        """Return the root of the mean square speed [length / engine's time]."""
        return math.sqrt(float(np.mean(np.sum(self.machine.speeds**2, axis=1))))

    def end(self, start: float, last: float, target: int) -> float | None:
        """Return when a window from ``start`` ends, at ``last`` the latest; None if it is not worth one.

        Parameters
        ----------
        start, last : float
            Within the epoch [engine's time].
        target : int
            Number of the collision at which the run ends; windows stay short of it.
        """
        machine = self.machine
        if self.length == 0.0:
            self.length = self.held / self.rate()
        # What is left of the epoch in windows of one length: a short one costs nearly as much as a long one.
        length = (last - start) / max(math.ceil((last - start) / self.length - 0.02), 1)
        left = target - machine.collisions
        rate = 0.5 * machine.scene.n * self.rate()  # of all collisions
        if left < 2**60:
            # Short of it in spite of fluctuations: a window that goes beyond is of no use.
            ahead = min(left, rate * length)
            length = min(length, (left - 4.0 * math.sqrt(ahead) - 0.01 * ahead) / rate)
        if not rate * length >= max(self.least * machine.scene.n, FEWEST):
            return None
        end = start + length
        return last if end > last - 1e-9 * length else end

    def kept(self, count: int, length: float) -> None:
        """Learn from a window that was kept: its collisions, and its length [engine's time]."""
        self.failed = 0
        if count > 0:
            self.known_rate = 2.0 * count / (self.machine.scene.n * length)
            self.length = min(self.held / self.known_rate, 2.0 * self.length)

    def lost(self, count: int, length: float, alike: bool) -> bool:
        """Halve the length after a window that was lost; ``alike`` tells whether its parts agreed.

        Returns
        -------
        crowded : bool
            Whether it held more collisions than rims are made for: the rate was not the one expected, and
            is known now.
        """
        self.length = 0.5 * length
        self.failed += not alike
        held = 2.0 * count / self.machine.scene.n
        crowded = held > CROWDED * self.held
        if crowded:
            self.known_rate = held / length
            self.length = min(self.length, self.held / self.known_rate)
        return crowded
