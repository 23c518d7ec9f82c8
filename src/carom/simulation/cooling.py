"""Blocks of a gas that cools: of about as many collisions each, as the time between two of them grows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from carom.block import Block

if TYPE_CHECKING:
    from carom.simulation.running import Running


def cools(sim: Running) -> bool:
    """Tell whether contacts lose energy, and nothing that grows brings any."""
    contents = sim.machine.contents
    return not contents.elastic and contents.rates is None


class Blocks:
    """Successive blocks of a simulation.

    Parameters
    ----------
    sim : Running
    collisions : float
        Pair collisions of a block, about.

    Notes
    -----
    Blocks of equal time would leave nearly all collisions of a gas that cools to the first of them. The
    length of each follows from the temperature at its beginning and from the collisions before, never from
    its own, so that no mean is biased.
    """

    def __init__(self, sim: Running, collisions: float):
        self._sim, self._wanted = sim, collisions
        self._duration = sim.time_for(collisions)
        self._cools = cools(sim)
        self._seen, self._thermal = 0, 0.0

    def next(self, size: int = 1) -> Block:
        """Run on for a block of ``size`` times the collisions, and return it."""
        if self._cools and self._seen:
            rate = self._seen / self._thermal * math.sqrt(self._sim.kT)
            self._duration = self._wanted / rate
        (block,) = self._sim.blocks(size * self._duration, 1)
        if block.kT_time is not None:
            self._seen += block.collisions
            self._thermal += math.sqrt(block.kT_time * block.duration)  # of the time in units of 1 / speed
        return block
