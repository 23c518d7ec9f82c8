"""Uphill to the next local optimum of the smallest angle, by a sequence of linear programs."""

from __future__ import annotations

import numpy as np

from carom.studies.spherical_codes.contacts import ROUNDING, pairs_by_product

WIDEST, NARROWEST = 2.0**-6, 2.0**-50
"""Largest change of a coordinate in a step, and the one below which a climb ends."""

PROGRAMS = 200
"""Linear programs, at most; some ten are used."""


def climb(points: np.ndarray) -> np.ndarray:
    """Return points (n, k) at a local maximum of the smallest angle, near those given.

    Linear programs maximize it at first order, over tangent steps within a bound that shrinks where
    curvature cancels the gain (Torquato and Jiao, Phys. Rev. E 82 (2010) 061302).
    """
    x, reach = points, WIDEST
    _, products = pairs_by_product(x)
    for _ in range(PROGRAMS):
        step, gain = _program(x, reach)
        if step is None or gain <= 0.125 * ROUNDING:
            break
        ahead = x + step
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        _, later = pairs_by_product(ahead)
        if later[0] < products[0]:
            x, products = ahead, later
            reach = min(reach, 4.0 * float(np.abs(step).max()))
        else:
            reach *= 0.25
        if reach < NARROWEST:
            break
    return x


def _program(x: np.ndarray, reach: float) -> tuple[np.ndarray | None, float]:
    """Return the step (n, k) of a linear program, and the expected decrease of the largest product."""
    from scipy.optimize import linprog
    from scipy.sparse import coo_matrix

    n, k = x.shape
    pairs, products = pairs_by_product(x)
    near = products > products[0] - 4.0 * reach * np.sqrt(k)
    pairs, products = pairs[near], products[near]
    m = len(pairs)
    # In units of the bound, steps and products are of order one.
    rows = np.repeat(np.arange(m), 2 * k + 1)
    first = pairs[:, :1] * k + np.arange(k)
    second = pairs[:, 1:] * k + np.arange(k)
    columns = np.hstack([first, second, np.full((m, 1), n * k)])
    values = np.hstack([x[pairs[:, 1]], x[pairs[:, 0]], np.ones((m, 1))])
    tangent = coo_matrix((x.ravel(), (np.repeat(np.arange(n), k), np.arange(n * k))), shape=(n, n * k + 1))
    solved = linprog(
        np.r_[np.zeros(n * k), -1.0],
        A_ub=coo_matrix((values.ravel(), (rows, columns.ravel())), shape=(m, n * k + 1)),
        b_ub=(products[0] - products) / reach,
        A_eq=tangent,
        b_eq=np.zeros(n),
        bounds=[(-1.0, 1.0)] * (n * k) + [(0.0, None)],
        method="highs",
    )
    if solved.x is None:
        return None, 0.0
    return reach * solved.x[:-1].reshape(n, k), reach * float(solved.x[-1])
