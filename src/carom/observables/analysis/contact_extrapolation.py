"""The contact value: g(r) extrapolated to the distance where two touch, with its error bar."""

from __future__ import annotations

import math

import numpy as np

from carom.arithmetic import exponential, power, pseudo_inverse
from carom.observables.statistics import Estimate, blocking, unwarned

# The fit is a parabola in ln g from contact to where g has fallen to half, but at most over a quarter of a
# diameter. In this range g falls on a single scale at every density. For the reference histograms of the
# tests (densities 0.5 and 0.8) the parabola is within 1e-3 of the contact value that the pressure implies,
# and a cubic only has more noise. In a crystal g has fallen to a fifth within that range, and the parabola is
# 1 % too low at packing fraction 0.6 and 7 % at 0.7; there it is a cubic down to that fifth.
REACH = 0.25
FALL = 0.5
DEGREE = 2
CRYSTAL_FALL = 0.2
CRYSTAL_DEGREE = 3

# Blocks of frames for the jackknife: they give the error to 10 %, and are few enough to be cheap.
JACKKNIFE = 64

# Gauss quadrature with three points on (-1, 1).
NODES = (-math.sqrt(0.6), 0.0, math.sqrt(0.6))
WEIGHTS = (5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0)


def contact_value(
    counts: np.ndarray, ideal: np.ndarray, edges: np.ndarray, dimension: int
) -> Estimate | None:
    """Extrapolate g to contact.

    Parameters
    ----------
    counts : (frames, m) int array
        Pairs in each bin of each frame, in order of time.
    ideal : (m,) float array
        Expected counts of an ideal gas.
    edges : (m + 1,) float array
        Edges of the bins [length]; the first is the diameter.
    dimension : int
        d.

    Returns
    -------
    Estimate or None
        None for a diameter of zero, if no pair was seen near contact, or if bins are too wide for the first
        peak of a crystal: fewer than six of them until g has fallen to a fifth. Its ``n_eff`` and ``tau`` are
        in blocks of frames. With fewer than 8 frames the error is that of independent pairs, with fewer than
        64 at least that; where it is that error, ``n_eff`` is the number of frames.

    Notes
    -----
    ``ln g`` is a parabola in r - sigma (of lower degree with fewer than five bins), fitted by maximum
    likelihood to Poisson counts. It is averaged over each shell by three-point Gauss quadrature, so that the
    width of the bins introduces no bias. The range ends where g, smoothed over three bins, has fallen to half
    of its first value, and at 0.25 diameters at the latest. Where it falls to a fifth within these, as in
    crystals, the range ends there, and ``ln g`` is a cubic. The error is by a jackknife over up to 64 blocks
    of frames. The pseudo-values pass through :func:`carom.observables.blocking`, so that correlated frames do
    not make it too small.
    """
    total = counts.sum(axis=0)
    used, degree = _range(total / ideal, edges)
    if used == 0 or total[:used].sum() == 0:
        return None
    fit = Fit(ideal[:used], edges[: used + 1], dimension, degree)
    frames = counts.shape[0]
    start = fit.start(total[:used], frames)
    full, variance = fit.solve(total[:used], frames, start)
    value = math.exp(full[0])
    independent = Estimate(value, value * math.sqrt(variance), float(frames), 1.0, frames)
    groups = min(frames, JACKKNIFE)
    if groups < 8:
        return independent
    # Groups have equal sizes, so that pseudo-values are alike; the error leaves out some first frames.
    size = frames // groups
    kept = counts[frames - groups * size :, :used].reshape(groups, size, used).sum(axis=1)
    without = [math.exp(fit.solve(total[:used] - part, frames - size, full)[0][0]) for part in kept]
    with unwarned():  # As for g: a wide error bar shows too few samples.
        pseudo = blocking(groups * value - (groups - 1) * np.array(without))
    if groups < JACKKNIFE and pseudo.error < independent.error:
        return independent
    return Estimate(value, pseudo.error, pseudo.n_eff, pseudo.tau, pseudo.blocks)


def _range(g: np.ndarray, edges: np.ndarray) -> tuple[int, int]:
    """Return the number of bins, from contact on, that the fit uses (0 if none will do), and its degree."""
    diameter = edges[0]
    if diameter <= 0.0:
        return 0, 0
    # A range that ends within rounding of a bin's edge includes that bin.
    reach = int(np.searchsorted(edges[1:], diameter * (1.0 + REACH) + 0.5 * (edges[1] - diameter)))
    near = g[: reach + 2]
    smooth = (near[:-2] + near[1:-1] + near[2:]) / 3.0

    def until(fall: float) -> int:
        """Return the number of bins until g has fallen to a part of its first value, or 0."""
        fallen = np.flatnonzero(smooth < fall * smooth[0]) if smooth.size else np.empty(0, dtype=int)
        return int(fallen[0]) + 1 if fallen.size else 0

    if used := until(CRYSTAL_FALL):
        return (used, CRYSTAL_DEGREE) if used >= CRYSTAL_DEGREE + 3 else (0, 0)
    return min(max(until(FALL) or reach, DEGREE + 3), g.size), DEGREE


class Fit:
    """Poisson likelihood of ``ln g`` as a polynomial, averaged over shells."""

    def __init__(self, ideal: np.ndarray, edges: np.ndarray, dimension: int, degree: int) -> None:
        nodes, weights = np.array(NODES), np.array(WEIGHTS)
        half = 0.5 * np.diff(edges)[:, None]
        r = edges[:-1, None] + half * (1.0 + nodes)
        shell = weights * power(r, dimension - 1)
        self.ideal = ideal
        self.weights = shell / shell.sum(axis=1, keepdims=True)
        # Two bins more than coefficients, so that the polynomial smooths and does not interpolate noise.
        degree = max(min(degree, ideal.size - 3), 0)
        x = (r - edges[0]) / (edges[-1] - edges[0])
        self.powers = np.stack([power(x, k) for k in range(degree + 1)], axis=-1)

    def start(self, counts: np.ndarray, frames: int) -> np.ndarray:
        """Return the coefficients of a constant g with the same number of pairs."""
        coefficients = np.zeros(self.powers.shape[-1])
        coefficients[0] = math.log(counts.sum() / (frames * self.ideal.sum()))
        return coefficients

    def solve(self, counts: np.ndarray, frames: int, start: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the coefficients of ln g by Fisher scoring, and the variance of ln g at contact."""
        a = start
        inverse = np.eye(a.size)
        for _ in range(50):
            g = exponential(np.sum(self.powers * a, axis=-1)) * self.weights
            expected = frames * self.ideal * g.sum(axis=1)
            jacobian = (frames * self.ideal)[:, None] * np.sum(g[..., None] * self.powers, axis=1)
            both = jacobian[:, :, None] * (jacobian / expected[:, None])[:, None, :]
            information = np.sum(both, axis=0)
            inverse = pseudo_inverse(information)
            score = np.sum(jacobian * (counts / expected - 1.0)[:, None], axis=0)
            step = np.sum(inverse * score, axis=1)
            # A step from a poor start may be too long; ln g never needs to change by more than 1 at once.
            a = a + step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-300))
            # Converged when the step is a hundredth of the statistical error.
            if np.sum(information * step[:, None] * step) < 1e-4:
                break
        return a, float(inverse[0, 0])
