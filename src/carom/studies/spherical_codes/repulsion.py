"""Quick starts near local optima: points of a sphere that repel each other, ever more steeply."""

from __future__ import annotations

import math

import numpy as np

EXPONENTS = (4.0, 16.0, 64.0, 256.0, 1024.0)
"""Exponents s of the repulsion r^-s. The largest leaves the smallest angle some 1e-3 below that of the code
nearby."""

FIRST = 4
"""A start begins with one of so many exponents: weak ones order the points, steep ones lead to more codes."""

ITERATIONS = 300
"""Iterations of each minimization, at most."""

PLACES = 3000
"""Points of all starts of a seed together, by default."""

STARTS, FEWEST = 50, 4
"""Starts of a seed, by default: for small codes, and for large ones."""


def starts_for(n: int) -> int:
    """Return the default number of starts of a seed."""
    return max(FEWEST, min(STARTS, PLACES // n))


def repelled(n: int, k: int, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return ``n`` points of the sphere in R^k that repel each other, (n, k), and the log of their energy.

    The exponent of the energy, the sum of r^-s, rises until the nearest pairs alone matter (Leech,
    Mathematical Gazette 41 (1957) 81).
    """
    x, logarithm = rng.standard_normal((n, k)), math.inf
    for exponent in EXPONENTS[rng.integers(FIRST) :]:
        x, logarithm = _minimized(x, exponent)
    return x, logarithm


def _minimized(x: np.ndarray, exponent: float) -> tuple[np.ndarray, float]:
    """Return unit vectors at a minimum of :func:`_energy` near those given, and its value there."""
    from scipy.optimize import minimize

    found = minimize(
        _energy,
        x.ravel(),
        args=(*x.shape, exponent),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": ITERATIONS, "maxcor": 20},
    )
    points = found.x.reshape(x.shape)
    return points / np.linalg.norm(points, axis=1)[:, None], float(found.fun)


def _energy(flat: np.ndarray, n: int, k: int, exponent: float) -> tuple[float, np.ndarray]:
    """Return log(sum r^-s) / s over pairs of unit vectors along ``flat`` (n k,), and its gradient by it."""
    long = flat.reshape(n, k)
    lengths = np.linalg.norm(long, axis=1)[:, None]
    x = long / lengths
    squares = np.maximum(2.0 - 2.0 * (x @ x.T), np.finfo(float).tiny)
    np.fill_diagonal(squares, math.inf)
    nearest = squares.min()
    parts = (nearest / squares) ** (0.5 * exponent)  # in units of the largest term: none overflows
    total = parts.sum()
    along = 2.0 * (parts / squares / total) @ x
    along -= np.einsum("ij,ij->i", along, x)[:, None] * x
    return math.log(0.5 * total) / exponent - 0.5 * math.log(nearest), (along / lengths).ravel()
