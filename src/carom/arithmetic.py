"""Arithmetic with the same bits on every processor, for results that promise to repeat.

NumPy's powers, exponentials and matrix products depend on the width of registers. Sums, products, quotients
and square roots of arrays are rounded as IEEE 754 says; the order of sums depends on the shape alone.
"""

from __future__ import annotations

import math

import numpy as np

LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
"""ln 2 in two parts: a small multiple of the first is exact."""

EXPONENTIAL = tuple(1.0 / math.factorial(k) for k in range(14))
"""Coefficients of the Taylor series of exp: up to half of ln 2 the rest is below 1e-17."""

SINE = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)  # fmt: skip
COSINE = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)  # fmt: skip
"""Coefficients of fdlibm (Sun Microsystems, 1993) for angles up to pi / 4."""

SWEEPS = 30
"""Most sweeps of Jacobi's method, which converges in less than ten."""


def dot(a: np.ndarray, b: np.ndarray) -> float:
    """Return the scalar product of two arrays of one shape."""
    return float(np.sum(a * b))


def power(x: np.ndarray, exponent: int) -> np.ndarray:
    """Return ``x ** exponent`` for an integer of at least zero, by multiplications alone."""
    result, square = np.ones_like(x, dtype=np.float64), np.asarray(x, dtype=np.float64)
    while exponent:
        if exponent & 1:
            result = result * square
        exponent >>= 1
        if exponent:
            square = square * square
    return result


def root(x: float, degree: int) -> float:
    """Return the root of a positive number, by Newton's steps down from above."""
    y, before = max(x, 1.0), math.inf
    while y < before:
        before, y = y, y - (y - x / float(power(np.array(y), degree - 1))) / degree
    return before


def exponential(x: np.ndarray) -> np.ndarray:
    """Return exp(x), to a unit in the last place."""
    twos = np.rint(x * (1.0 / math.log(2.0)))
    rest = (x - twos * LN2_HIGH) - twos * LN2_LOW
    return np.asarray(np.ldexp(_polynomial(EXPONENTIAL, rest), twos.astype(np.int64)))


def cosine_and_sine(turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return cosine and sine of ``2 pi turns``, to 1e-16."""
    quarters = np.rint(4.0 * turns)
    x = 2.0 * math.pi * (turns - 0.25 * quarters)
    z = x * x
    sine = x + x * z * _polynomial(SINE, z)
    cosine = 1.0 - (0.5 * z - z * z * _polynomial(COSINE, z))
    quarter = quarters.astype(np.int64) & 3
    odd = (quarter & 1).astype(bool)
    c, s = np.where(odd, sine, cosine), np.where(odd, cosine, sine)
    return np.where((quarter == 1) | (quarter == 2), -c, c), np.where(quarter >= 2, -s, s)


def _polynomial(coefficients: tuple[float, ...], x: np.ndarray) -> np.ndarray:
    """Return the polynomial with these coefficients, the constant first."""
    total = np.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        total = total * x + c
    return total


def factor(form: np.ndarray, tolerance: float) -> np.ndarray:
    """Return F (m, r) with ``F F^T = form`` for a symmetric matrix (m, m) without negative eigenvalues.

    Its rank r counts Cholesky's pivots above a fraction ``tolerance`` of the first.
    """
    rest = np.array(form, dtype=np.float64)
    columns: list[np.ndarray] = []
    first = float(rest.diagonal().max())
    while len(columns) < len(rest):
        k = int(np.argmax(rest.diagonal()))
        pivot = float(rest[k, k])
        if pivot <= tolerance * first:
            break
        columns.append(rest[:, k] / math.sqrt(pivot))
        rest = rest - columns[-1][:, None] * columns[-1]
    return np.stack(columns, axis=1)


def pseudo_inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the pseudo-inverse of a symmetric matrix (Jacobi); eigenvalues of rounding count as zero."""
    a, m = np.array(matrix, dtype=np.float64), len(matrix)
    vectors = np.eye(m)
    for _ in range(SWEEPS):
        turned = False
        for p in range(m):
            for q in range(p + 1, m):
                if abs(a[p, q]) <= np.finfo(np.float64).eps * math.sqrt(abs(a[p, p] * a[q, q])):
                    continue
                turned = True
                theta = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for each in (a, vectors):
                    each[:, p], each[:, q] = c * each[:, p] - s * each[:, q], s * each[:, p] + c * each[:, q]
                a[p], a[q] = c * a[p] - s * a[q], s * a[p] + c * a[q]
        if not turned:
            break
    values = a.diagonal()
    kept = np.abs(values) > m * np.finfo(np.float64).eps * np.abs(values).max(initial=0.0)
    return np.asarray(np.sum(vectors[:, None, kept] * vectors[None, :, kept] / values[kept], axis=2))


def least_squares(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients (m,) of few independent ``columns`` (n, m) nearest to ``values`` (n,)."""
    products = np.sum(columns[:, :, None] * columns[:, None, :], axis=0)
    return np.asarray(np.sum(pseudo_inverse(products) * np.sum(columns * values[:, None], axis=0), axis=1))
