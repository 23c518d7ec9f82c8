"""Blocks of a cooling gas: about equally many collisions in each, as the time between collisions grows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.block import Block
from carom.models.motions.shear import Shear
from carom.simulation.measuring import stretches

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation


def cools(sim: Simulation) -> bool:
    """Return whether contacts lose energy, and growth adds none."""
    system = sim._state.system
    sheared = isinstance(system.motion, Shear)  # the stream makes up for what is lost
    return not system.conserves_energy and system.rates is None and not sheared


class Blocks:
    """Successive blocks of a simulation, of about so many pair collisions.

    In blocks of equal time nearly all collisions of a cooling gas would fall into the first. Lengths follow
    from the temperature at the beginning and earlier collisions, never a block's own: no mean is biased.
    """

    def __init__(self, sim: Simulation, collisions: float):
        self._sim, self._wanted = sim, collisions
        self._duration = stretches.time_for(sim, collisions)
        self._cools = cools(sim)
        self._seen, self._thermal = 0, 0.0

    def next(self, size: int = 1) -> Block:
        """Run on for a block of ``size`` times the collisions, and return it."""
        if self._cools and self._seen:
            rate = self._seen / self._thermal * math.sqrt(self._sim.kT)
            self._duration = self._wanted / rate
        (block,) = stretches.blocks(self._sim, size * self._duration, 1)
        if block.kT_time is not None:
            self._seen += block.collisions
            self._thermal += math.sqrt(block.kT_time * block.duration)  # of the time in units of 1 / speed
        return block
