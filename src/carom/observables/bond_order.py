"""Bond-orientational order during a run: psi_l in 2D, Q_l in 3D, and their analogue in any dimension.

A bond is the direction u from a particle to a neighbor. Its order of degree l is a vector y of real
harmonics of degree l. They are scaled so that ``y(u) . y(u')`` is the Gegenbauer polynomial of ``u . u'``
that is 1 at 1: ``cos(l angle)`` in 2D, the Legendre polynomial P_l in 3D. The length of the mean of y over
the bonds of a particle is therefore ``|psi_l|`` of Halperin and Nelson (1978) in 2D, and q_l of Steinhardt,
Nelson and Ronchetti (1983) in 3D.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.arithmetic import factor
from carom.errors import InputError
from carom.figures import curves
from carom.frame import Frame
from carom.geometry.neighbors import Bonds, nearest, pairs_within, within
from carom.geometry.overlaps import Geometry, geometry_of_frame
from carom.geometry.tessellation import voronoi_bonds
from carom.observables.of_frames import OfFrames, of_species
from carom.observables.statistics import UNKNOWN, Estimate, arrays, blocking
from carom.results import Binned
from carom.suggestions import corrected

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NEAREST = {2: 6, 3: 12, 4: 24}
"""Default number of neighbors, by dimension: the number of contacts in the densest lattice."""


PORTION = 2**15
"""Bonds at a time: all at once would exceed the processor's cache, and take gigabytes for a long ``rmax``."""


@corrected()
@dataclass
class BondOrder(OfFrames):
    """Local and global bond-orientational order, and its correlation: an observable of frames.

    Give it to :meth:`carom.Simulation.measure`, or frames or a path to :meth:`over`.

    Parameters
    ----------
    l : int
        Degree: 6 for psi_6 and Q_6.
    nearest : int, optional
        Number of nearest particles that count as neighbors; by default 6, 12 and 24 in 2, 3 and 4
        dimensions. In a small box, images of one particle count each.
    reach : float, optional
        Alternatively, neighbors are all particles nearer than this [length].
    voronoi : bool
        Alternatively, neighbors share a face of the Voronoi tessellation (2D and 3D).
    rmax : float, optional
        Largest distance at which the correlation of local orders is measured [length], at most half of the
        shortest edge. By default it is not measured.
    width : float
        Width of the bins of the correlation [length].
    species : int, optional
        Species to measure, with the bonds between its particles; by default all particles.

    Raises
    ------
    InputError
        If a number is out of range (l is at most 12), or more than one choice of neighbors is given. From
        :meth:`add`, if between walls there are too few particles, if frames differ in n, or the box is too
        small for `rmax`. From :meth:`result`, before any frame.

    Examples
    --------
    >>> import carom
    >>> crystal = carom.Simulation(carom.Scene.crystal(108, 0.6), seed=1).frame()
    >>> round(BondOrder(6).over([crystal]).global_order.mean, 5)
    0.57452
    """

    l: int = 6
    nearest: int | None = None
    reach: float | None = None
    voronoi: bool = False
    rmax: float | None = None
    width: float = 0.1
    species: int | None = None

    _what = "order"

    def __post_init__(self) -> None:
        checks.integer(self.l, "l", low=1, high=12)
        checks.number(self.width, "width", low=0.0, open_low=True)
        if (self.nearest is not None) + (self.reach is not None) + bool(self.voronoi) > 1:
            raise InputError("nearest, reach and voronoi each say who the neighbors are; give one of them.")
        if self.nearest is not None:
            checks.integer(self.nearest, "nearest", low=1)
        for name in ("reach", "rmax"):
            if getattr(self, name) is not None:
                checks.number(getattr(self, name), name, low=0.0, open_low=True)

    def _of(self, frame: Frame) -> tuple[Any, ...]:
        if frame.dimension < 2:
            raise InputError("Bonds on a line have no directions to order; expected a frame of d >= 2.")
        positions = frame.positions[of_species(frame, self.species)]
        room = geometry_of_frame(frame)
        places = room.wrapped(positions)
        orders, bonds = self._orders(room, places)
        local = float(np.sqrt(np.sum(orders**2, axis=1)).mean())
        whole = float(np.sqrt(np.sum(orders.mean(axis=0) ** 2)))
        return local, whole, bonds / len(places), *self._correlated(room, places, orders)

    def _orders(self, room: Geometry, places: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the order of each particle (n, h), zero without neighbors, and the number of bonds."""
        pairs, bonds = self._bonds_of(room, places)
        return orders_of(self.l, len(places), pairs, bonds), len(pairs)

    def _bonds_of(self, room: Geometry, places: np.ndarray) -> tuple[np.ndarray, Bonds]:
        """Return particle and neighbor of each bond (m, 2), and the function that makes its vectors.

        A pair of neighbors has two bonds. There are many, so a portion of vectors is made at a time.
        """
        d = places.shape[1]
        if self.voronoi:
            if d not in (2, 3):
                raise InputError("voronoi needs 2 or 3 dimensions; give nearest or reach.")
            pairs, vectors = voronoi_bonds(room, places)
            return pairs, vectors.__getitem__
        if self.reach is not None:
            return within(room, places, self.reach)
        count = NEAREST.get(d) if self.nearest is None else self.nearest
        if count is None:
            raise InputError(f"In {d} dimensions nearest or reach must say who the neighbors are.")
        return nearest(room, places, count)

    def _correlated(
        self, room: Geometry, places: np.ndarray, orders: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the sums of ``q_i . q_j`` and the numbers of pairs in each bin."""
        if self.rmax is None:
            return np.zeros(0), np.zeros(0, np.int64)
        edges, shape = self._edges, len(self._edges) - 1
        if self._samples:  # bins for which the box has become too small have no pairs of this frame
            edges = edges[edges <= room.half]
        elif self.rmax > room.half:
            raise InputError(
                f"rmax is {self.rmax:g}, beyond half of the shortest edge of the box ({room.half:g}), where "
                "images are counted twice."
            )
        sums, counts = np.zeros(shape), np.zeros(shape, np.int64)
        found = pairs_within(room, places, float(edges[-1]))
        for part in _portions(len(found)):
            pairs = found[part]
            bins = np.searchsorted(edges, room.distances(places, pairs), side="right") - 1
            i, j = pairs.T
            products = np.sum(orders[i] * orders[j], axis=1)
            inside = bins < len(edges) - 1
            sums += np.bincount(bins[inside], products[inside], shape)
            counts += np.bincount(bins[inside], minlength=shape)
        return sums, counts

    @property
    def _edges(self) -> np.ndarray:
        """Edges of the bins of the correlation [length]."""
        if self.rmax is None:
            return np.zeros(1)
        return self.width * np.arange(max(int(self.rmax / self.width * (1.0 + 1e-12)), 1) + 1)

    def _found(self) -> BondOrderResult:
        local, whole, bonds, sums, counts = (np.array(each) for each in zip(*self._samples, strict=True))
        correlation = arrays([_ratio(*each) for each in zip(sums.T, counts.T, strict=True)])
        means = blocking(local), blocking(whole), blocking(whole**2), blocking(bonds)
        return BondOrderResult(self.l, *means, self._edges, *correlation)


def orders_of(degree: int, n: int, pairs: np.ndarray, bonds: Bonds) -> np.ndarray:
    """Return the order (n, h) of each particle, 0 without bonds; ``bonds`` makes vectors of ``pairs``."""
    counts = np.bincount(pairs[:, 0], minlength=n)
    sums = None
    for part in _portions(len(pairs)):
        vectors, who = bonds(part), pairs[part, 0]
        values = harmonics(degree, vectors / np.sqrt(np.sum(vectors**2, axis=1))[:, None])
        sums = np.zeros((values.shape[1], n)) if sums is None else sums
        first, last = int(who.min()), int(who.max()) + 1
        for total, column in zip(sums, values.T, strict=True):
            total[first:last] += np.bincount(who - first, column, last - first)
    return np.zeros((n, 1)) if sums is None else sums.T / np.maximum(counts, 1)[:, None]


def _portions(count: int) -> list[slice]:
    """Return the portions of a number of pairs."""
    return [slice(at, at + PORTION) for at in range(0, count, PORTION)]


def _ratio(sums: np.ndarray, counts: np.ndarray) -> Estimate:
    """Return the mean over all pairs of all frames, with a linearized error; nan where there is no pair."""
    total = counts.sum()
    if not total:
        return UNKNOWN
    mean = sums.sum() / total
    found = blocking((sums - mean * counts) / (total / len(counts)))
    return Estimate(float(mean), found.error, found.n_eff, found.tau, found.blocks)


@dataclass(frozen=True, eq=False, repr=False)
class BondOrderResult(Binned):
    """Bond-orientational order, with error bars.

    Attributes
    ----------
    l : int
        Degree.
    local_order : Estimate
        Mean of ``|psi_l|``, or q_l, over particles.
    global_order : Estimate
        Modulus of the mean over particles: ``|Psi_l|``, or Q_l.
    global_square : Estimate
        Mean of its square. In a fluid of n particles it does not vanish, but falls as 1 / n.
    neighbors : Estimate
        Number of neighbors of a particle.
    edges : (b + 1,) array
        Edges of the bins of the correlation [length].
    correlation, correlation_error : (b,) arrays
        Mean of ``q_i . q_j`` over pairs in a bin, and its standard error; ``g_6(r) / g(r)`` for d = 2 and
        l = 6. It is nan if no pair was seen.
    """

    l: int
    local_order: Estimate
    global_order: Estimate
    global_square: Estimate
    neighbors: Estimate
    edges: np.ndarray
    correlation: np.ndarray
    correlation_error: np.ndarray

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        rows = [
            ("local", self.local_order),
            ("global", self.global_order),
            ("neighbors", self.neighbors),
        ]
        return f"Bond order of degree {self.l}", [(name, each.value_text) for name, each in rows]

    def _draw_into(self, axes: Axes) -> None:
        seen = np.isfinite(self.correlation)
        if not seen.any():
            raise InputError("The correlation of orders was not measured; give BondOrder(rmax=...).")
        curves.curve(axes, self.middle[seen], self.correlation[seen], self.correlation_error[seen])
        curves.level(axes, 0.0)
        axes.set(xlabel="distance r", ylabel="correlation of local orders")

    def _columns(self) -> dict[str, Any]:
        if not self.correlation.size:
            return super()._columns()
        return self._bins("r") | self._with_errors("correlation")

    def __str__(self) -> str:
        return (
            f"order {self.l}: local {self.local_order.value_text}, global {self.global_order.value_text}, "
            f"{self.neighbors.mean:.3g} neighbors"
        )


def gegenbauer(degree: int, dimension: int) -> np.ndarray:
    """Return the coefficients (degree + 1,), lowest first, of a Gegenbauer polynomial that is 1 at 1.

    In the cosine it is orthogonal on the sphere to all of lower degree: Chebyshev's in 2D, Legendre's in 3D.
    """
    before, now = np.array([1.0]), np.array([0.0, 1.0])
    if degree == 0:
        return before
    for k in range(1, degree):
        # (k + d - 2) P_(k+1) = (2 k + d - 2) x P_k - k P_(k-1)
        later = (2 * k + dimension - 2) * np.append(0.0, now)
        later[:k] -= k * before
        before, now = now, later / (k + dimension - 2)
    return now


@functools.cache
def _basis(degree: int, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Return exponents (m, d) of all terms of a degree, and weights (m, h) that combine them to harmonics."""
    rows = _terms(degree, dimension)
    # (u . u')^l is the sum over all terms of term(u) term(u') times a multinomial coefficient. A lower power
    # l - 2 k of the polynomial is multiplied by |u|^2k |u'|^2k = 1. So the polynomial is a quadratic form of
    # the terms, and any factor of its matrix gives harmonics.
    at = {row: k for k, row in enumerate(rows)}
    form = np.zeros((len(rows), len(rows)))
    coefficients = gegenbauer(degree, dimension)
    for power in range(degree, -1, -2):
        half = (degree - power) // 2
        low = _terms(power, dimension)
        lift = np.zeros((len(rows), len(low)))
        for b, term in enumerate(low):
            for part in _terms(half, dimension):  # of (x^2 + y^2 + ...)^half, which is 1
                row = tuple(t + 2 * s for t, s in zip(term, part, strict=True))
                lift[at[row], b] += _orders_of(part)
        form += coefficients[power] * (lift * [_orders_of(term) for term in low]) @ lift.T
    return np.array(rows), factor(form, 1e-9)


def _terms(degree: int, dimension: int) -> list[tuple[int, ...]]:
    """Return the exponents of all products of ``degree`` coordinates."""
    if dimension == 1:
        return [(degree,)]
    return [(k, *rest) for k in range(degree + 1) for rest in _terms(degree - k, dimension - 1)]


def _orders_of(term: tuple[int, ...]) -> float:
    """Return the multinomial coefficient of a term."""
    return math.factorial(sum(term)) / math.prod(math.factorial(k) for k in term)


def harmonics(degree: int, units: np.ndarray) -> np.ndarray:
    """Return harmonics (m, h) of unit vectors (m, d); their scalar products are Gegenbauer polynomials."""
    exponents, weights = _basis(degree, units.shape[1])
    powers = [[np.ones(len(units)), np.ascontiguousarray(x)] for x in units.T]
    for each in powers:
        for _ in range(2, degree + 1):
            each.append(each[-1] * each[1])
    terms = np.empty((len(exponents), len(units)))
    for term, row in zip(terms, exponents, strict=True):
        term[:] = functools.reduce(np.multiply, [each[k] for each, k in zip(powers, row, strict=True)])
    return np.einsum("kh,kp->hp", weights, terms).T
