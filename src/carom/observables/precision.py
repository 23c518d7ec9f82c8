"""Accuracy as a request: when a mean is known well enough, and how much longer that takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from carom import checks
from carom.observables.statistics import Estimate

FLOOR = 64
"""Independent blocks without which no error bar counts as known: with 64 it is known to sqrt(3 / 126), 15 %
(:attr:`Estimate.degrees_of_freedom`). A run that stops at its first lucky error bar would stop too soon.
"""

LEAST_GROWTH, MOST_GROWTH = 1.1, 4.0
"""A stretch grows by this much from one look at its error bar to the next. Few looks give luck few chances; a
prediction from a pilot is not trusted beyond the larger one.
"""

FEWEST_COLLISIONS = 16
"""Collisions of a block, where one a particle are fewer: a virial of so few terms is hardly normal, and
correlated with its own error bar.
"""


class Aim(Protocol):
    """When a stretch is long enough."""

    def reached(self, estimate: Estimate) -> bool:
        """Tell whether the error is small enough."""

    def next_look(self, length: int, estimate: Estimate) -> int:
        """Return at which length to look again; no more than ``length`` gives up."""


def lengthen(
    aim: Aim,
    length: int,
    extend: Callable[[int], int | None],
    error_bar: Callable[[], Estimate | None],
    expect: Callable[[int, Estimate], object] = lambda length, estimate: None,
) -> bool:
    """Make a stretch longer until its error bar fits.

    Parameters
    ----------
    aim : Aim
        How small the error shall be, and when to look at it again.
    length : int
        At which length to look first, in blocks.
    extend : callable
        Goes on to a length, and returns the length then; None if there was no time for it.
    error_bar : callable
        Returns the estimate so far; None where it never gets an error bar.
    expect : callable, optional
        Called with length and estimate, where more is needed.

    Returns
    -------
    bool
        False if there was no time.
    """
    while (reached := extend(length)) is not None:
        found = error_bar()
        if found is None or aim.reached(found):
            return True
        expect(reached, found)
        length = aim.next_look(reached, found)
        if length <= reached:
            return True
    return False


def block_collisions(n: int) -> float:
    """Return the pair collisions of a block: one a particle, so that one block hardly knows of the next."""
    return max(0.5 * n, float(FEWEST_COLLISIONS))


@dataclass(frozen=True)
class Goal:
    """A relative error to be reached.

    Parameters
    ----------
    relative_error : float
        One standard error over the absolute value of the mean, from 1e-9 to 1.

    Raises
    ------
    InputError
        If it is not.
    """

    relative_error: float

    def __post_init__(self) -> None:
        checks.number(self.relative_error, "relative_error", low=checks.FINEST_ERROR, high=1.0)

    def reached(self, estimate: Estimate) -> bool:
        """Tell whether the error is small enough, and rests on at least ``FLOOR`` independent blocks."""
        return (
            estimate.error == 0.0 or _independent(estimate) >= FLOOR
        ) and estimate.error <= self.relative_error * abs(estimate.mean)

    def remaining(self, estimate: Estimate) -> float:
        """Return by what factor the stretch must grow, as far as this estimate can tell: at least 1.

        Its error shrinks with the square root of the length. Infinity where nothing is known yet.
        """
        if self.reached(estimate):
            return 1.0
        wanted = self.relative_error * abs(estimate.mean)
        shrink = (estimate.error / wanted) ** 2 if wanted > 0.0 else math.inf
        known = _independent(estimate)
        return max(shrink, FLOOR / known if known > 0.0 else math.inf, 1.0)

    def next_look(self, length: int, estimate: Estimate) -> int:
        """Return at which length to look again, after a stretch of ``length`` that is too short."""
        growth = min(max(self.remaining(estimate), LEAST_GROWTH), MOST_GROWTH)
        return math.ceil(growth * length)


@dataclass(frozen=True)
class Prediction:
    """Expected length of a measurement, estimated when its error bar was computed.

    Attributes
    ----------
    relative_error : float
        Relative standard error reached so far.
    collisions : float
        Pair collisions still to come.
    seconds : float
        Wall time that they will take [s].
    """

    relative_error: float
    collisions: float
    seconds: float


def _independent(estimate: Estimate) -> float:
    """Return the number of independent blocks that the error rests on.

    Where neighbours are anticorrelated (tau < 1), as in the quasi-periodic motion of rods on a line, blocking
    ends with few large blocks, and an error bar too large rather than too small: then all blocks count.
    """
    if estimate.tau < 1.0:
        return estimate.tau * estimate.n_eff
    return min(float(estimate.blocks), estimate.n_eff)
