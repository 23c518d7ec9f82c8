"""Order parameters near freezing: psi_6 in 2D, Q_6 in 3D."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from carom.frame import Frame
from carom.geometry.neighbors import within
from carom.geometry.overlaps import geometry_of_frame
from carom.geometry.tessellation import voronoi_bonds
from carom.observables.bond_order import orders_of

REACH = 1.2 * 2 ** (1 / 6)
"""Longest bond of Q_6 [(V / n)^(1/3)]: half way between the first and the second neighbors of fcc."""

MANY = 2048
"""Bonds of Q_6 in one matrix product."""


def psi_6(frame: Frame) -> float:
    """Return the modulus of the mean of psi_6, over the neighbors of the Voronoi tessellation."""
    room = geometry_of_frame(frame)
    pairs, bonds = voronoi_bonds(room, room.wrapped(frame.positions))
    mean = orders_of(6, frame.n, pairs, bonds.__getitem__).mean(axis=0)
    return math.sqrt(float(np.sum(mean**2)))


def q_6(frame: Frame) -> float:
    """Return the global Q_6 of Steinhardt, Nelson and Ronchetti, Phys. Rev. B 28, 784 (1983).

    By the addition theorem its square is the mean of P_6(u . u') over pairs of bonds, and the mean of
    ``(u . u')^k`` the sum of squared moments ``<x^a y^b z^c>`` of degree k, weighted by multinomials.
    """
    room = geometry_of_frame(frame)
    reach = REACH * (math.prod(frame.box) / frame.n) ** (1 / 3)
    pairs, bonds = within(room, room.wrapped(frame.positions), reach)
    if not len(pairs):
        return 0.0
    # In parts, so that intermediate arrays stay in the cache.
    parts = [slice(at, at + MANY) for at in range(0, len(pairs), MANY)]
    products = np.sum([_products(bonds(part).T) for part in parts], axis=0)
    moments = dict(zip(SUMS, (products / len(pairs)).ravel(), strict=True))
    squares = [_ordered_squares(moments)]
    for degree in (4, 2, 0):
        moments = {
            (a, b, c): moments[a + 2, b, c] + moments[a, b + 2, c] + moments[a, b, c + 2]
            for a, b, c in _exponents(degree)
        }
        squares.append(_ordered_squares(moments))
    mean_legendre = (231 * squares[0] - 315 * squares[1] + 105 * squares[2] - 5 * squares[3]) / 16
    return math.sqrt(max(mean_legendre, 0.0))


ORDERS: dict[int, tuple[str, Callable[[Frame], float]]] = {2: ("psi_6", psi_6), 3: ("Q_6", q_6)}
"""Name and value of the order parameter, by dimension."""


def _products(bonds: np.ndarray) -> np.ndarray:
    """Return the sums (10, 10) over bonds (3, m) of products of two terms of degree 3 of their directions."""
    x, y, z = bonds / np.sqrt(np.sum(bonds * bonds, axis=0))
    xx, yy, zz = x * x, y * y, z * z
    terms = np.stack([xx * x, xx * y, xx * z, x * yy, x * y * z, x * zz, yy * y, yy * z, y * zz, zz * z])
    return terms @ terms.T


def _exponents(degree: int) -> list[tuple[int, int, int]]:
    """Return the exponents of all terms ``x^a y^b z^c`` of a degree, in falling order."""
    return [(a, b, degree - a - b) for a in range(degree, -1, -1) for b in range(degree - a, -1, -1)]


SUMS = [(a + i, b + j, c + k) for a, b, c in _exponents(3) for i, j, k in _exponents(3)]
"""Exponents of the products of two terms of degree 3, row by row."""


def _ordered_squares(moments: dict[tuple[int, int, int], float]) -> float:
    """Return the sum of the squared moments, weighted by multinomial coefficients."""
    return math.fsum(
        math.factorial(a + b + c) / (math.factorial(a) * math.factorial(b) * math.factorial(c)) * moment**2
        for (a, b, c), moment in moments.items()
    )
