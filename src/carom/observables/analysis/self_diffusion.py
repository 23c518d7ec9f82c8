"""The coefficient of self-diffusion from mean square displacements: a line through an octave of times.

At long times the mean square displacement is ``2 d D t + c``. The slope at longer times has less of what is
no diffusion yet, and more noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from carom.observables.statistics import UNKNOWN, Estimate, blocking

AGREE = 2.0  # standard errors of their difference up to which two slopes agree


class Line(NamedTuple):
    """The line ``2 d D t + fit_offset`` from one time to another."""

    diffusion: Estimate  # D [length^2 / time]
    fit_first: float  # [time]
    fit_last: float  # [time]
    fit_offset: float  # [length^2]


NO_LINE = Line(UNKNOWN, math.nan, math.nan, math.nan)


def line_of(octaves: Iterable[tuple[np.ndarray, np.ndarray, float]], n: int, dimension: int) -> Line:
    """Return the line through the octave after the first whose slope agrees with those of all later ones.

    What is no diffusion yet in the first of these is hidden by the errors, and is far less in the next. If
    the slopes still change at the end, there is no line.

    Parameters
    ----------
    octaves : iterable of (l,) array, (l, m) array and float
        For each, from short times on, the lags, the squared displacements of ``n`` particles over them that
        end at each of m frames, and the time between two of these.
    """
    lines = []
    for lags, squares, spacing in octaves:
        away = lags - lags.mean()
        weights = away / np.sum(away**2)
        slope = blocking(np.sum(weights[:, None] * squares, axis=0))
        least = _brownian_error(lags, weights, squares.shape[1], n * dimension)
        error = max(slope.error, least * abs(slope.mean))
        slope = Estimate(slope.mean, error, slope.n_eff, slope.tau, slope.blocks)
        offset = float(squares.mean() - slope.mean * lags.mean())
        times = float(lags[0] * spacing), float(lags[-1] * spacing)
        lines.append((Line(slope.scaled(0.5 / (dimension * spacing)), *times, offset), least))
    for k, (one, _) in enumerate(lines[:-1]):
        if all(_agree(one.diffusion, later.diffusion, least) for later, least in lines[k + 1 :]):
            return lines[k + 1][0]
    return NO_LINE


def _agree(one: Estimate, later: Estimate, least: float) -> bool:
    """Tell whether a later slope may be this one, of which its relative error is ``least`` or more."""
    error = math.hypot(one.error, max(later.error, least * abs(one.mean)))
    return abs(one.mean - later.mean) <= AGREE * error


def _brownian_error(lags: np.ndarray, weights: np.ndarray, ends: int, coordinates: int) -> float:
    """Return the relative error of a slope for independent Gaussian steps from each frame to the next.

    It is that of few frames, whose scatter does not give it. The slope is the mean of a quadratic form ``B``
    of the last steps before each end, and the variance of such a mean ``2 sum_ij tr(B_i B_j) / ends^2``
    (compare J. T. Bullerjahn, S. von Bülow and G. Hummer, J. Chem. Phys. 153, 024116 (2020)).
    """
    longest = int(lags[-1])
    form = np.zeros((longest, longest))
    for lag, weight in zip(lags, weights, strict=True):
        form[longest - lag :, longest - lag :] += weight
    shifted = [np.sum(form[s:, s:] * form[: longest - s, : longest - s]) for s in range(min(longest, ends))]
    pairs = [ends, *(2.0 * (ends - s) for s in range(1, len(shifted)))]
    return math.sqrt(2.0 * float(np.sum(np.multiply(pairs, shifted))) / coordinates) / ends
