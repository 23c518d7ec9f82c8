"""Effects of a finite number of particles in a mixture, at constant energy in a periodic box."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from carom import checks
from carom.errors import InputError
from carom.theory.arithmetic import checked

STEP = 2e-3
"""Relative step of second differences: their truncation error is about 1e-5, and rounding adds 1e-9."""

ORDER = 24
"""Points of the quadrature from zero density, over which an equation of state is smooth."""


def mixture_finite_size_shift(
    packing_fraction: float,
    fractions: ArrayLike,
    diameters: ArrayLike,
    dimension: int,
    n: int,
    equation: Callable[[float, np.ndarray, np.ndarray], float],
) -> float:
    """``Z_N - Z`` of a mixture of N particles in a periodic box of given volume, to leading order in 1 / N.

    Parameters
    ----------
    packing_fraction : float
        eta of all particles together.
    fractions, diameters : (s,) array_like
        Number fraction, positive, and diameter of each species.
    dimension, n : int
        d, and the number of particles N.
    equation : callable
        Z of the infinite mixture from packing fraction, fractions and diameters.

    Raises
    ------
    InputError
        If a fraction is not positive, or fractions and diameters differ in number. If the packing fraction is
        not in (0, 1), or n is less than 1.

    Notes
    -----
    ``-(1 / 2N) d ln K / d ln eta`` at fixed composition, with ``K = det(delta_ij + rho_j d^2 a / d rho_i d
    rho_j)`` and the excess free energy a = beta A / V. The number of *every* species is fixed, so that
    fluctuations of composition are missing, too. The grand canonical sum over numbers N_i has the Gaussian
    factor ``sqrt(det <dN_i dN_j>)``. The shift is the derivative of its logarithm with respect to the volume.
    For one species, and for equal species with different names, it is :func:`carom.theory.finite_size_shift`.
    """
    checks.number(checked(packing_fraction), "packing_fraction", low=0, open_low=True)
    checks.number(n, "n", low=1)
    x, sigma = np.asarray(fractions, np.float64), np.asarray(diameters, np.float64)
    if x.shape != sigma.shape or x.ndim != 1 or not (x > 0.0).all():
        raise InputError(f"Fractions {x} and diameters {sigma}: expected one positive fraction a species.")
    x = checks.shares(x)
    volumes = sigma**dimension / float(x @ sigma**dimension)  # of a particle, in units of their mean
    nodes, weights = np.polynomial.legendre.leggauss(ORDER)
    at, weights = 0.5 * (nodes + 1.0), 0.5 * weights

    def free_energy(rho: np.ndarray) -> float:
        """Return a for densities in units in which eta is rho . volumes."""
        total = float(rho.sum())
        eta, parts = float(rho @ volumes), rho / total
        excess = [(equation(float(s) * eta, parts, sigma) - 1.0) / s for s in at]
        return total * float(weights @ np.array(excess))

    def log_determinant(eta: float) -> float:
        rho = eta * x
        step = STEP * rho
        kinds = len(x)
        here = free_energy(rho)
        matrix = np.eye(kinds)
        unit = np.eye(kinds) * step
        for i in range(kinds):
            for j in range(i, kinds):
                if i == j:
                    up, down = free_energy(rho + unit[i]), free_energy(rho - unit[i])
                    second = (up - 2.0 * here + down) / step[i] ** 2
                else:
                    corners = [
                        a * b * free_energy(rho + a * unit[i] + b * unit[j]) for a in (1, -1) for b in (1, -1)
                    ]
                    second = sum(corners) / (4.0 * step[i] * step[j])
                matrix[i, j] += second * rho[j]
                if i != j:
                    matrix[j, i] += second * rho[i]
        return float(np.linalg.slogdet(matrix)[1])

    slope = (
        log_determinant(packing_fraction * (1 + STEP)) - log_determinant(packing_fraction * (1 - STEP))
    ) / (2.0 * STEP)
    return -slope / (2.0 * n)
