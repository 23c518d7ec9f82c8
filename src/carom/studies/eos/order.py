"""Order parameters near freezing: psi_6 in 2D (by freud, where it is installed), Q_6 in 3D."""

from __future__ import annotations

import math
from collections import Counter
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from carom.frame import Frame

REACH = 1.2 * 2 ** (1 / 6)
"""Longest bond of Q_6 [(V / n)^(1/3)]: half way between the first and the second neighbours of fcc."""

NAMES = {2: "psi_6", 3: "Q_6"}
"""Name of the order parameter, by dimension."""


def available(dimension: int) -> bool:
    """Return whether there is an order parameter in this dimension, and what it needs can be imported."""
    from importlib.util import find_spec

    return dimension == 3 or (dimension == 2 and find_spec("freud") is not None)


class OrderParameter:
    """The global order parameter of successive frames.

    Parameters
    ----------
    dimension : int
        2 (the modulus of the mean psi_6) or 3 (the global Q_6 of Steinhardt); in others nothing is measured.
    """

    def __init__(self, dimension: int):
        self.name = NAMES[dimension] if available(dimension) else None
        self._values: list[float] = []

    def add(self, frame: Frame) -> None:
        """Measure one frame."""
        if self.name is None:
            return
        self._values.append(psi_6(frame) if frame.dimension == 2 else q_6(frame))

    def values(self) -> dict[str, Any] | None:
        """Return the name and the values so far; None where nothing is measured."""
        return None if self.name is None else {"name": self.name, "values": self._values}


def psi_6(frame: Frame) -> float:
    """Return the modulus of the mean of psi_6, over the neighbours of the Voronoi tessellation."""
    import freud

    points = np.zeros((frame.n, 3), dtype=np.float32)
    points[:, :2] = frame.positions - 0.5 * np.asarray(frame.box)
    box = freud.box.Box(Lx=frame.box[0], Ly=frame.box[1], is2D=True)
    # The sums of several threads depend on who comes first; and the other cores have work of their own.
    with freud.parallel.NumThreads(1):
        voronoi = freud.locality.Voronoi()
        voronoi.compute((box, points))
        hexatic = freud.order.Hexatic(k=6)
        hexatic.compute((box, points), neighbors=voronoi.nlist)
    return float(abs(np.mean(hexatic.particle_order.astype(np.complex128))))


def q_6(frame: Frame) -> float:
    """Return the global Q_6 of Steinhardt, Nelson and Ronchetti, Phys. Rev. B 28, 784 (1983).

    Notes
    -----
    By the addition theorem Q_6 squared is the mean of the Legendre polynomial P_6(u . u') over all pairs of
    bonds; and the mean of ``(u . u')^k`` is the square of the mean tensor ``u u ... u`` of rank k. Three
    matrix products take the place of thirteen spherical harmonics a bond.
    """
    from scipy.spatial import cKDTree

    box = np.asarray(frame.box)
    around = box * frame.periodic  # 0 is what the tree calls an axis that is not
    reach = REACH * (box.prod() / frame.n) ** (1 / 3)
    pairs = cKDTree(frame.positions, boxsize=around).query_pairs(reach, output_type="ndarray")
    if not len(pairs):
        return 0.0
    places = np.ascontiguousarray(frame.positions.T)
    bonds = places[:, pairs[:, 0]] - places[:, pairs[:, 1]]
    bonds -= around[:, None] * np.rint(bonds / box[:, None])
    u = bonds / np.sqrt(np.einsum("im,im->m", bonds, bonds))
    squares = [1.0]
    for rank in (1, 2, 3):
        factors = np.empty((math.comb(rank + 2, 2), len(pairs)))
        for row, axes in zip(factors, combinations_with_replacement(range(3), rank), strict=True):
            # Components of a symmetric tensor that are equal are kept once, and weighed.
            number = math.factorial(rank) / math.prod(map(math.factorial, Counter(axes).values()))
            np.multiply(math.sqrt(number), np.prod(u[list(axes)], axis=0), out=row)
        squares.append(float(np.sum((factors @ factors.T / len(pairs)) ** 2)))
    mean_legendre = (231 * squares[3] - 315 * squares[2] + 105 * squares[1] - 5 * squares[0]) / 16
    return math.sqrt(max(mean_legendre, 0.0))
