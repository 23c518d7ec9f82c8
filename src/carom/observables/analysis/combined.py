"""Two estimators of one number, measured in the same blocks: the combination with the smallest error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.observables.statistics import Estimate

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


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
