"""Quantiles and tails of the three distributions that error bars need.

They are those of ``scipy.stats``, bit for bit. Its import takes as long as 10^5 collisions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


def normal_above(tail: float) -> float:
    """Return the bound that a standard normal number exceeds with this probability."""
    from scipy.special import ndtri

    return -float(ndtri(tail))


def student_above(tail: float, degrees: float) -> float:
    """Return the bound that Student's t exceeds with this probability."""
    from scipy.special import stdtrit

    return -float(stdtrit(degrees, tail))


def student_tail(bound: float, degrees: float) -> float:
    """Return the probability that Student's t exceeds a bound."""
    from scipy.special import stdtr

    return float(stdtr(degrees, -bound))


def chi_squared_below(probability: float, degrees: np.ndarray) -> np.ndarray:
    """Return the bounds below which chi squared lies with this probability, for each number of degrees."""
    from scipy.special import gammaincinv

    bounds: np.ndarray = 2.0 * gammaincinv(0.5 * degrees, probability)
    return bounds


def chi_squared_tail(bound: float, degrees: float) -> float:
    """Return the probability that chi squared exceeds a bound."""
    from scipy.special import chdtrc

    return float(chdtrc(degrees, bound))
