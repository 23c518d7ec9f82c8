"""Which spheres overlap: the check of every initial state, in any dimension and any periodic box.

Two spheres overlap if and only if their *nearest* images do, and in a box with right angles the nearest image
is the nearest one along each axis. So one distance a pair decides, in small boxes too; that a sphere does not
meet its own image is the condition edge > diameter, which :class:`carom.Scene` checks apart.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

#: Overlap [diameter] that the engine's own rounding may leave in a frame it writes.
ENGINE_OVERLAP = 1e-12


class Overlap(NamedTuple):
    """Two spheres that overlap.

    Attributes
    ----------
    i, j : int
        The pair, i < j.
    distance : float
        Distance of their nearest images [diameter].
    """

    i: int
    j: int
    distance: float

    @property
    def depth(self) -> float:
        """How far they overlap [diameter]."""
        return 1.0 - self.distance


def rounding(box: np.ndarray, epsilon: float = float(np.finfo(np.float64).eps)) -> float:
    """Overlap [diameter] that rounded coordinates can produce between spheres in exact contact.

    Parameters
    ----------
    box : (d,) array
        Edges [diameter].
    epsilon : float
        Spacing of the floating-point numbers at 1.

    Notes
    -----
    A coordinate is below the edge L_k, so that each rounding moves it by at most epsilon L_k / 2. Four of
    them (the product and the sum that make a lattice position, its wrapping, the division by the diameter)
    move it by 2 epsilon L_k, a difference of two by 4 epsilon L_k, and their distance by at most 4 epsilon
    |L|.
    """
    return 4 * epsilon * math.hypot(*map(float, box))


def tolerance(box: np.ndarray) -> float:
    """Overlap [diameter] that is let through: what the engine and the coordinates' rounding may leave.

    Relative to the diameter, so that it does not change with the unit of length.
    """
    return ENGINE_OVERLAP + rounding(box)


def wrapped(positions: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return positions (n, d) moved by whole edges into ``0 <= x < edge``."""
    inside = np.mod(positions, box)
    # A tiny negative coordinate is rounded up to the edge itself, which is the image of 0.
    inside[inside >= box] = 0.0
    return inside


def pair_distances(
    positions: np.ndarray, pairs: np.ndarray, box: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest-image separations (m, d) from i to j and their lengths (m,) of ``pairs`` (m, 2)."""
    separation = positions[pairs[:, 1]] - positions[pairs[:, 0]]
    separation -= box * np.rint(separation / box)
    return separation, np.sqrt(np.einsum("ij,ij->i", separation, separation))


def pairs_within(positions: np.ndarray, box: np.ndarray, distance: float) -> np.ndarray:
    """Return the pairs (m, 2) whose nearest images are at most ``distance`` apart.

    Parameters
    ----------
    positions : (n, d) array
        Inside the box, 0 <= x < edge.
    box : (d,) array
        Edges.
    distance : float
        In the same unit.
    """
    from scipy.spatial import cKDTree

    # Wrapped again, because a change of unit can round a coordinate up to the edge.
    return cKDTree(wrapped(positions, box), boxsize=box).query_pairs(distance, output_type="ndarray")


def deepest(positions: np.ndarray, box: np.ndarray) -> Overlap | None:
    """Return the deepest overlap of unit spheres beyond :func:`tolerance`, or None.

    If very many spheres share one place, any one overlapping pair of them.

    Parameters
    ----------
    positions : (n, d) array
        Centres [diameter], inside the box.
    box : (d,) array
        Edges [diameter].
    """
    # A crowd of m spheres has m^2 / 2 overlapping pairs, too many to list. Those it must have are found
    # first.
    pairs = _sharing_a_cell(positions)
    if not len(pairs):
        pairs = pairs_within(positions, box, 1.0 - tolerance(box))
    if not len(pairs):
        return None
    _, distances = pair_distances(positions, pairs, box)
    worst = int(np.argmin(distances))
    i, j = sorted(map(int, pairs[worst]))
    return Overlap(i, j, float(distances[worst]))


def _sharing_a_cell(positions: np.ndarray) -> np.ndarray:
    """Return neighbours in the same cell of diagonal 1 - 2^-20, which surely overlap, as pairs (m, 2)."""
    cells = np.floor(positions * (math.sqrt(positions.shape[1]) / (1.0 - 2.0**-20)))
    order = np.lexsort(cells.T)
    cells = cells[order]
    shared = np.nonzero((cells[1:] == cells[:-1]).all(axis=1))[0]
    return np.stack([order[shared], order[shared + 1]], axis=1)
