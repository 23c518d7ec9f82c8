"""Tests of equilibrium for a stretch of a run: drift, relaxation, and the displacement of particles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from carom.arithmetic import dot
from carom.frame import Frame
from carom.observables.analysis.quantiles import normal_above, student_tail
from carom.observables.statistics import blocking, unwarned

PARTS = 16
"""Number of means of a series: few enough to be nearly independent, enough to give their scatter."""

MEANS = 64
"""Number of means of a long series in the test for a decay. A block of a short run may have no collision, and
the tails of such blocks are not normal."""

LEVEL = 1e-3
"""Probability that a point in equilibrium is called drifting."""

STUCK = 0.5
"""Median displacement [mean spacing] below which the particles are still near their start. In a crystal it
stays at some 0.15 (Lindemann); in a fluid it grows as the square root of the time."""


def drift(values: Sequence[float], parts: int = PARTS) -> float:
    """Return the trend of equally spaced values, as a standard normal number; 0 if they are constant.

    The slope of the means of so many ``parts`` is divided by its error from the scatter about the line:
    Student's t with ``parts - 2`` degrees of freedom. A relaxation not much shorter than the run inflates it,
    too: the run is then too short for its error bar.
    """
    x = np.asarray(values, dtype=np.float64)
    parts = min(parts, x.size)
    if parts < 4:
        return 0.0
    size = x.size // parts
    means = x[x.size - parts * size :].reshape(parts, size).mean(axis=1)
    centered = np.arange(parts) - 0.5 * (parts - 1)
    slope = dot(centered, means) / dot(centered, centered)
    rest = means - means.mean() - slope * centered
    if _constant(means):
        return 0.0
    error = math.sqrt(dot(rest, rest) / (parts - 2) / dot(centered, centered))
    return _as_normal(slope, error, parts - 2)


def relaxation(values: Sequence[float]) -> float:
    """Return how far the first quarter of a series lies above its second half, as a standard normal number.

    J. Geweke, in Bayesian Statistics 4 (Oxford, 1992), p. 169: the error is that of the second half, so that
    a decay does not widen it. :func:`drift` misses a decay, which bends its line; this misses a steady trend.
    """
    x = np.asarray(values, dtype=np.float64)
    if x.size > 2 * MEANS:
        size = x.size // MEANS
        x = x[x.size - MEANS * size :].reshape(MEANS, size).mean(axis=1)
    if x.size < 32 or _constant(x):
        return 0.0
    early, late = x[: x.size // 4], x[x.size // 2 :]
    with unwarned():
        after = blocking(late)
    error = after.error * math.sqrt(1.0 + late.size / early.size)
    return _as_normal(float(early.mean()) - after.mean, error, after.degrees_of_freedom)


def _constant(values: np.ndarray) -> bool:
    """Return whether values differ only by the rounding of a mean."""
    return bool(np.ptp(values) <= 8.0 * np.finfo(np.float64).eps * np.abs(values).max())


def _as_normal(difference: float, error: float, freedoms: float) -> float:
    """Return Student's t as the normal number of the same probability."""
    tail = student_tail(abs(difference) / error, freedoms) if error > 0.0 else 0.0
    return math.copysign(normal_above(max(tail, 1e-300)), difference)


def together(drifts: Sequence[float]) -> float:
    """Return the common trend of independent runs from their ``drifts``, as a standard normal (Stouffer)."""
    return math.fsum(drifts) / math.sqrt(len(drifts)) if drifts else 0.0


def drifts(values: Sequence[float]) -> bool:
    """Return whether independent runs with the trends ``values`` were out of equilibrium.

    The common trend and the largest single trend are tested, each at half of ``LEVEL``.
    """
    if not values:
        return False
    shared = normal_above(LEVEL / 4.0)
    single = normal_above(LEVEL / 4.0 / len(values))
    return abs(together(values)) > shared or max(abs(v) for v in values) > single


def moved(start: np.ndarray, frame: Frame) -> float:
    """Return the median distance of a ``frame`` from ``start`` (n, d), in mean spacings ``(V / n)^(1/d)``."""
    distance = np.sqrt(np.sum((frame.unwrapped - start) ** 2, axis=1))
    return float(np.median(distance)) / float((math.prod(frame.box) / frame.n) ** (1.0 / frame.dimension))
