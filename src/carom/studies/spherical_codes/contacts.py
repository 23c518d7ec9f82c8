"""Which pairs of a jammed code touch, and whether forces along the contacts hold it."""

from __future__ import annotations

import numpy as np

ROUNDING = 2.0**-48
"""Rounding of a product x_i . x_j of unit vectors in double precision, with a margin."""


def pairs_by_product(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all pairs (m, 2) of points (n, k) and their products x_i . x_j (m,), the nearest pair first."""
    i, j = np.triu_indices(len(points), 1)
    products = np.einsum("ij,ij->i", points[i], points[j])
    order = np.argsort(-products, kind="stable")
    return np.column_stack([i, j])[order], products[order]


def contact_graph(points: np.ndarray) -> np.ndarray:
    """Return the pairs (m, 2) that touch in a jammed configuration (n, k): those before the largest leap.

    Gaps of contacts are of one size and others larger by orders of magnitude, so it is where a gap is the
    largest multiple of the mean of those before.
    """
    pairs, products = pairs_by_product(points)
    gaps = products[0] - products
    least = max(len(points) * (points.shape[1] - 1) // 2, 1)
    if len(points) <= points.shape[1] + 1:  # the simplex: all pairs touch
        return pairs
    means = np.cumsum(gaps)[:-1] / np.arange(1, len(gaps))
    leaps = gaps[1:] / np.maximum(means, ROUNDING)
    return pairs[: least + int(np.argmax(leaps[least - 1 :]))]


def jacobian(points: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the derivatives of the equations by the coordinates and the cosine c, (m + n, n k + 1).

    The equations are ``x_i . x_j - c`` for the pairs and ``(x_i . x_i - 1) / 2`` for the points.
    """
    n, k = points.shape
    m = len(pairs)
    matrix = np.zeros((m + n, n * k + 1))
    rows = np.arange(m)
    for axis in range(k):
        matrix[rows, pairs[:, 0] * k + axis] = points[pairs[:, 1], axis]
        matrix[rows, pairs[:, 1] * k + axis] = points[pairs[:, 0], axis]
        matrix[m + np.arange(n), np.arange(n) * k + axis] = points[:, axis]
    matrix[:m, -1] = -1.0
    return matrix


def forces(points: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Return the force along each contact (m,) in equilibrium, none negative; all zero where there is none.

    Forces on a point must add up to a vector along its radius. Then no small displacement makes all contacts
    longer (Farkas): the dual of the linear program that maximizes the smallest angle. Of all equilibria it
    is one in which the largest number of contacts bear a force.
    """
    from scipy.optimize import linprog
    from scipy.sparse import coo_matrix, hstack, identity

    n, k = points.shape
    m = len(pairs)
    if not m:
        return np.zeros(0)
    i, j = pairs.T
    product = np.einsum("ij,ij->i", points[i], points[j])[:, None]
    along = np.vstack([points[j] - product * points[i], points[i] - product * points[j]])
    rows = np.r_[i, j][:, None] * k + np.arange(k)
    columns = np.repeat(np.tile(np.arange(m), 2), k)
    # Forces f >= s, where s from 0 to 1 is maximized: s = 1 wherever f can be positive.
    equal = coo_matrix((along.ravel(), (rows.ravel(), columns)), shape=(n * k, 2 * m))
    solved = linprog(
        np.r_[np.zeros(m), -np.ones(m)],
        A_ub=hstack([-identity(m), identity(m)]),
        b_ub=np.zeros(m),
        A_eq=equal,
        b_eq=np.zeros(n * k),
        bounds=[(0.0, None)] * m + [(0.0, 1.0)] * m,
        method="highs",
    )
    if solved.x is None:
        return np.zeros(m)
    bearing = solved.x[m:] > 0.5
    return np.where(bearing, solved.x[:m], 0.0)


def is_rigid(points: np.ndarray, pairs: np.ndarray) -> bool:
    """Return whether the points that contacts hold can only rotate together.

    Apart from rotations, every first-order motion then changes the length of a contact. Only a simplex in
    more dimensions than it spans gives way to first order, but not to second.
    """
    held = np.unique(pairs)
    if not len(held):
        return False
    n, k = len(held), points.shape[1]
    if n <= k + 1 and len(pairs) == n * (n - 1) // 2:
        return True
    here = np.searchsorted(held, pairs)
    values = np.linalg.svd(jacobian(points[held], here)[:, :-1], compute_uv=False)
    rank = int((values > np.sqrt(ROUNDING) * values[0]).sum())
    span = int(np.linalg.matrix_rank(points[held], tol=np.sqrt(ROUNDING)))
    turns = k * (k - 1) // 2 - (k - span) * (k - span - 1) // 2
    return rank == n * k - turns
