"""Crystalline particles and their clusters, by the bonds around each: an observable of frames.

A particle is solid-like if the order of its bonds is like that of enough of its neighbors (P. R. ten Wolde,
M. J. Ruiz-Montero and D. Frenkel, J. Chem. Phys. 104, 9932 (1996)). Neighbors that are both solid-like belong
to one cluster.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.figures.palette import INK, PALE
from carom.frame import Frame
from carom.geometry.overlaps import geometry_of_frame
from carom.observables.bond_order import BondOrder, orders_of
from carom.observables.of_frames import OfFrames
from carom.observables.statistics import Estimate, blocking
from carom.results import Result
from carom.suggestions import corrected
from carom.texts import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DEGREE = 6


@corrected()
@dataclass
class Crystallinity(OfFrames):
    """Solid-like particles in three dimensions, and the largest cluster of them: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or frames or a path to :meth:`over`.

    Parameters
    ----------
    nearest : int, optional
        Number of nearest particles that count as neighbors; 12 by default.
    reach : float, optional
        Alternatively, neighbors are all particles nearer than this [length].
    likeness : float
        Two neighbors are connected if ``q_i . q_j / (|q_i| |q_j|)`` exceeds this, with the vectors q of
        degree 6.
    connections : int
        Connections that make a particle solid-like.

    Raises
    ------
    InputError
        If a number is out of range, or `nearest` and `reach` are both given. From :meth:`add`, if the
        frame is not of three dimensions, has too few particles, or differs in n. From :meth:`result`, before
        any frame.

    Notes
    -----
    Solid-like particles that are neighbors are in one cluster, whether they are connected or not.

    Examples
    --------
    >>> import carom
    >>> crystal = carom.Simulation(carom.Scene.crystal(108, 0.6), seed=1).frame()
    >>> carom.observables.Crystallinity().over([crystal]).largest.mean
    108.0
    """

    nearest: int | None = None
    reach: float | None = None
    likeness: float = 0.5
    connections: int = 7

    _what = "crystallinity"

    def __post_init__(self) -> None:
        self._bonds = BondOrder(DEGREE, nearest=self.nearest, reach=self.reach)
        checks.number(self.likeness, "likeness", low=-1.0, high=1.0)
        checks.integer(self.connections, "connections", low=1)

    def _of(self, frame: Frame) -> tuple[float, int, int]:
        if frame.dimension != 3:
            raise InputError(
                f"Solid-like particles are those of three dimensions, and a frame has {frame.dimension}."
            )
        solid, sizes = self._clusters(frame)
        return frame.time, int(solid.sum()), int(sizes.max(initial=0))

    def _clusters(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Return which particles (n,) are solid-like, and the numbers of particles in their clusters."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        room = geometry_of_frame(frame)
        places = room.wrapped(frame.positions)
        pairs, vectors = self._bonds._bonds_of(room, places)
        orders = orders_of(DEGREE, frame.n, pairs, vectors)
        lengths = np.sqrt(np.sum(orders**2, axis=1))
        orders /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
        i, j = pairs.T
        alike = np.sum(orders[i] * orders[j], axis=1) > self.likeness
        solid = np.bincount(i[alike], minlength=frame.n) >= self.connections
        both = solid[i] & solid[j]
        graph = coo_array((np.ones(both.sum(), np.bool_), (i[both], j[both])), shape=(frame.n, frame.n))
        _, cluster = connected_components(graph, directed=False)
        return solid, np.bincount(cluster[solid])

    def _found(self) -> CrystallinityResult:
        times, solid, largest = map(np.array, zip(*self._samples, strict=True))
        n = self._first.n
        return CrystallinityResult(
            n, blocking(solid / n), blocking(largest.astype(np.float64)), times, solid, largest
        )


@dataclass(frozen=True, eq=False, repr=False)
class CrystallinityResult(Result):
    """Solid-like particles, and the largest cluster of them.

    Attributes
    ----------
    n : int
        Number of particles.
    solid_fraction : Estimate
        Mean fraction of particles that are solid-like.
    largest : Estimate
        Mean number of particles in the largest cluster.
    times : (f,) array
        Time of each frame [time].
    solid, largest_cluster : (f,) int64 arrays
        Number of solid-like particles in each frame, and of those in the largest cluster.
    """

    n: int
    solid_fraction: Estimate
    largest: Estimate
    times: np.ndarray
    solid: np.ndarray
    largest_cluster: np.ndarray

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("solid-like fraction", self.solid_fraction.value_text),
            ("largest cluster", self.largest.value_text),
        ]
        return f"Crystallinity of {counted(self.n, 'particle')}, {counted(self.times.size, 'frame')}", rows

    def _draw_into(self, axes: Axes) -> None:
        axes.plot(self.times, self.solid, ".-", color=PALE, markersize=4, linewidth=0.9, label="solid-like")
        axes.plot(
            self.times, self.largest_cluster, ".-", color=INK, markersize=4, linewidth=1.2,
            label="largest cluster",
        )  # fmt: skip
        axes.set_ylim(bottom=0.0)
        axes.set(xlabel="time t", ylabel="particles")

    def _columns(self) -> dict[str, Any]:
        return {"time": self.times, "solid": self.solid, "largest_cluster": self.largest_cluster}
