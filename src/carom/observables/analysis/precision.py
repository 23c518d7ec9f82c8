"""Runs to a requested error: when a mean is known well enough, and how much longer that takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.observables.statistics import Estimate

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

FLOOR = 64
"""Least number of independent blocks of an error bar. With 64 it is known to sqrt(3 / 126), 15 %
(:attr:`Estimate.degrees_of_freedom`). Without this condition, a run would stop at an error bar that is too
small by chance.
"""

LEAST_GROWTH, MOST_GROWTH = 1.1, 4.0
"""Smallest and largest factor by which a stretch grows between two checks of its error bar. With few checks,
an error bar that is too small by chance is unlikely. A prediction is not trusted beyond the larger factor.
"""

FEWEST_COLLISIONS = 16
"""Least number of collisions of a block, for small n: a virial of fewer terms is hardly normal, and
correlated with its own error bar.
"""


class Aim(Protocol):
    """The condition for a stretch to be long enough."""

    def reached(self, estimate: Estimate) -> bool:
        """Return whether the error is small enough."""

    def next_look(self, length: int, estimate: Estimate) -> int:
        """Return the length for the next check; if it does not exceed ``length``, the stretch ends."""


def lengthen(
    aim: Aim,
    length: int,
    extend: Callable[[int], int | None],
    error_bar: Callable[[], Estimate | None],
    expect: Callable[[int, Estimate], object] = lambda length, estimate: None,
) -> bool:
    """Make a stretch longer until its error bar is small enough; False if there was not enough time.

    ``extend`` continues to a length [blocks] and returns what was reached, or None without time;
    ``error_bar`` returns None if there will never be one.
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
    """Return the pair collisions of a block: one per particle, so that blocks are hardly correlated."""
    return max(0.5 * n, float(FEWEST_COLLISIONS))


@dataclass(frozen=True)
class Goal:
    """A relative error to reach: one standard error over the absolute mean, from 1e-9 to 1."""

    relative_error: float

    def __post_init__(self) -> None:
        checks.number(self.relative_error, "relative_error", low=checks.FINEST_ERROR, high=1.0)

    def reached(self, estimate: Estimate) -> bool:
        """Return whether the error is small enough, and based on at least ``FLOOR`` independent blocks."""
        return (
            estimate.error == 0.0 or _independent(estimate) >= FLOOR
        ) and estimate.error <= self.relative_error * abs(estimate.mean)

    def remaining(self, estimate: Estimate) -> float:
        """Return the factor by which the stretch must grow according to an estimate, at least 1.

        The error shrinks with the square root of the length. The factor is infinite if nothing is known yet.
        """
        if self.reached(estimate):
            return 1.0
        wanted = self.relative_error * abs(estimate.mean)
        shrink = (estimate.error / wanted) ** 2 if wanted > 0.0 else math.inf
        known = _independent(estimate)
        return max(shrink, FLOOR / known if known > 0.0 else math.inf, 1.0)

    def next_look(self, length: int, estimate: Estimate) -> int:
        """Return the length for the next check, after a stretch of ``length`` that is too short."""
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
    """Return the number of independent blocks that the error is based on.

    All count where neighbors are anticorrelated (tau < 1), as of rods: blocking ends with few large blocks.
    """
    if estimate.tau < 1.0:
        return estimate.tau * estimate.n_eff
    return min(float(estimate.blocks), estimate.n_eff)


def combined(first: ArrayLike, second: ArrayLike) -> Estimate:
    """Return the mean of two unbiased estimators, weighted for the least variance.

    Parameters
    ----------
    first, second : (n,) array_like of float
        Both estimators of each block. Blocks must be independent of each other.

    Raises
    ------
    InputError
        If the two series differ in length, or have fewer than 8 blocks.

    Notes
    -----
    ``x = a + w (b - a)`` has the least variance for ``w = cov(a, a - b) / var(a - b)``. w is estimated from
    the blocks and may lie outside 0 to 1 if the estimators are strongly correlated. The uncertainty of w
    makes the error larger by the factor ``sqrt((n - 1) / (n - 2))``, which is included (control variates: R.
    Y. Rubinstein and R. Marcus, Oper. Res. 33, 661 (1985)).
    """
    a, b = np.asarray(first, np.float64), np.asarray(second, np.float64)
    n = a.size
    if a.shape != b.shape or a.ndim != 1 or n < 8:
        raise InputError(f"Series of {a.shape} and {b.shape} blocks; expected two of one length, at least 8.")
    x = least_variance(a, b)
    error = float(np.std(x, ddof=1)) / math.sqrt(n) * math.sqrt((n - 1.0) / (n - 2.0))
    return Estimate(float(x.mean()), error, float(n), 1.0, n)


def least_variance(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return in each block the combination of two estimators whose variance over the blocks is the least."""
    difference = a - b
    variance = float(np.var(difference, ddof=1))
    weight = float(np.cov(a, difference)[0, 1]) / variance if variance else 0.0
    return a - weight * difference
