"""A measurement that continues until its error bar is small enough."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from carom.block import Block, weighted_sum
from carom.compiling import entry
from carom.errors import CaromWarning, warn
from carom.observables.analysis.equilibrium import doubts_about
from carom.observables.analysis.precision import FLOOR, Goal, Prediction, block_collisions, lengthen
from carom.observables.statistics import Estimate
from carom.simulation.measuring import stretches
from carom.simulation.measuring.equilibration import StructuralRelaxation
from carom.simulation.measuring.equipartition import Thermometer
from carom.simulation.measuring.stretches import Blocks

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

MEANS = ("sizes", "energy")
"""Fields of a block that are means over its time; all others are sums."""


def until(
    sim: Simulation,
    observable: Any,
    goal: Goal,
    *,
    blocks: int,
    walltime: float = math.inf,
    progress: Callable[[float], object] | None = None,
    predicted: Callable[[Prediction], object] | None = None,
) -> Any:
    """Run on until the observable's error bar reaches the goal, and return the estimate.

    It is checked after a pilot of 64 blocks, then where the previous error predicts, at four times the length
    at most. Twice the wanted blocks are merged in pairs. The length depends on the values only, but for
    ``walltime``.
    """
    stretch = _Stretch(sim, observable, goal, blocks, walltime, progress, predicted)
    if not lengthen(goal, FLOOR, stretch.extend, stretch.error_bar, stretch.expect):
        stretch.result = stretches.estimate(sim, observable, stretch.blocks)
        found = stretch.result.primary
        if not goal.reached(found):
            warn(
                f"walltime = {walltime:g} s ended the measurement at a relative error of "
                f"{found.relative_error:.2g}; {goal.relative_error:g} was asked for."
            )
    if progress is not None:
        progress(1.0)
    tell_doubts(stretch.result, stretch.thermometer, stretch.relaxation)
    return stretch.result


def tell_doubts(result: Any, thermometer: Thermometer, relaxation: StructuralRelaxation) -> None:
    """Warn of what speaks against a result."""
    primary = getattr(result, "primary", None)
    error = math.inf if primary is None else primary.relative_error
    for sentence in (*doubts_about(result), *relaxation.doubts(), *thermometer.doubts(error)):
        warn(sentence)


class _Stretch:
    """A measurement that grows until its error bar fits. Lengths are in blocks of the first kind."""

    def __init__(
        self,
        sim: Simulation,
        observable: Any,
        goal: Goal,
        blocks: int,
        walltime: float,
        progress: Callable[[float], object] | None,
        predicted: Callable[[Prediction], object] | None,
    ):
        self._sim, self._observable, self._goal = sim, observable, goal
        self._seconds, self._deadline = walltime, entry.running() + walltime
        self._progress, self._predicted = progress, predicted
        self._source = Blocks(sim, block_collisions(sim.scene.n))
        self._capacity = 2 * max(blocks, 2 * FLOOR)
        self._size = 1  # of a block now
        self._expected = math.inf
        self._rate = _Rate(sim)
        self.thermometer, self.relaxation = Thermometer(sim._state), StructuralRelaxation(sim._state)
        self.blocks: list[Block] = []
        self.result: Any = None

    @property
    def _length(self) -> int:
        return self._size * len(self.blocks)

    def extend(self, length: int) -> int | None:
        """Run on to a length, and return the length then; None if the time is over before."""
        while self._length < length:
            if len(self.blocks) >= 2 and entry.running() >= self._deadline:
                return None
            self.blocks.append(self._source.next(self._size))
            self._rate.tick()
            self.thermometer.look()
            if len(self.blocks) == self._capacity:
                pairs = zip(self.blocks[::2], self.blocks[1::2], strict=True)
                self.blocks = [merged(*pair) for pair in pairs]
                self._size *= 2
            if self._progress is not None:
                left = self._deadline - entry.running()
                fraction_spent = 1.0 - left / self._seconds if self._seconds < math.inf else 0.0
                self._progress(min(max(self._length / self._expected, fraction_spent), 1.0))
        return self._length

    def error_bar(self) -> Estimate:
        """Return the estimate so far."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CaromWarning)  # the run may go on, so it is not short yet
            self.result = stretches.estimate(self._sim, self._observable, self.blocks)
        return self.result.primary

    def expect(self, length: int, found: Estimate) -> None:
        """Say how much is still to come."""
        self._expected = length * self._goal.remaining(found)
        if self._predicted is not None:
            more = (self._expected / length - 1.0) * sum(block.collisions for block in self.blocks)
            self._predicted(Prediction(found.relative_error, more, more / self._rate.collisions_per_second))
        self._rate.pause()


class _Rate:
    """Collisions per second of wall time, the first block left out: it may have waited for the compiler."""

    def __init__(self, sim: Simulation):
        self._sim = sim
        self._collisions, self._seconds = 0, 0.0
        self._last: tuple[int, float] | None = None

    def tick(self) -> None:
        """Count what came since the last tick."""
        now = self._sim.collisions, entry.running()
        if self._last is not None:
            self._collisions += now[0] - self._last[0]
            self._seconds += now[1] - self._last[1]
        self._last = now

    def pause(self) -> None:
        """Leave out the time from the last tick until now."""
        if self._last is not None:
            self._last = self._last[0], entry.running()

    @property
    def collisions_per_second(self) -> float:
        """Seen so far; infinite before anything was."""
        return self._collisions / self._seconds if self._seconds else math.inf


def merged(one: Block, other: Block) -> Block:
    """Return two neighboring blocks as one: their sums, and their means weighted with the durations."""
    part = one.duration / (one.duration + other.duration)
    fields = one._asdict().items()
    weights = {name: (part, 1.0 - part) if name in MEANS else (1, 1) for name, _ in fields}
    return Block(
        **{name: weighted_sum(value, getattr(other, name), *weights[name]) for name, value in fields}
    )
