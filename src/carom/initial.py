"""Initial states as plain arrays: lattices, packing fractions, Maxwell velocities.

A lattice is a cell with right angles, repeated: the box is then a whole number of cells and the lattice fits
it without a seam. Lengths are in units of the cell's first edge here; :class:`carom.Scene` gives them their
unit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError

#: The most components a scene may have; the arrays of more fill some 30 GB.
MOST = 10**8

#: The most dimensions: D_n has 2^(d-1) points a cell, and every sphere 3^d sectors around it.
MOST_DIMENSIONS = 12

#: Packing fraction of the densest known packing of equal spheres in d dimensions (d = 1, 2, 3, 8 proven;
#: lattices Z, A2, D3, D4, D5, E6, E7, E8). Conway and Sloane, Sphere Packings, Lattices and Groups, table
#: 1.2.
CLOSEST_PACKING = {
    1: 1.0,
    2: math.pi / math.sqrt(12),
    3: math.pi / math.sqrt(18),
    4: math.pi**2 / 16,
    5: math.pi**2 / (15 * math.sqrt(2)),
    6: math.pi**3 / (48 * math.sqrt(3)),
    7: math.pi**3 / 105,
    8: math.pi**4 / 384,
}


def unit_ball_volume(dimension: int) -> float:
    """Return the volume of the ball of radius 1 in ``dimension`` dimensions, pi^(d/2) / Gamma(d/2 + 1)."""
    return math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1)


def sphere_volume(dimension: int) -> float:
    """Return the volume v_d of the sphere of *diameter* 1: the packing fraction at unit reduced density."""
    return unit_ball_volume(dimension) / 2**dimension


def packing_fraction(n: int, box: Sequence[float], diameter: float = 1.0) -> float:
    """Return the part of the box's volume that ``n`` spheres fill.

    Parameters
    ----------
    n : int
        Number of spheres.
    box : sequence of d floats
        Edges [length].
    diameter : float
        [length].
    """
    return n * sphere_volume(len(box)) * math.prod(diameter / edge for edge in box)


def reduced_density(
    dimension: int,
    *,
    packing_fraction: Any = None,
    density: Any = None,
    limit: float | None = None,
    where: str = "any packing",
) -> float:
    """Return the number of spheres in a volume diameter^d, from the one of the two that is given.

    Parameters
    ----------
    dimension : int
        d.
    packing_fraction : float, optional
        Part of the volume that the spheres fill.
    density : float, optional
        Number of spheres in a volume diameter^d.
    limit : float, optional
        The highest packing fraction that can be had; the densest known packing when left out.
    where : str
        What that limit is of, for the message.

    Raises
    ------
    InputError
        If none or both are given, or beyond the limit.
    """
    if (packing_fraction is None) == (density is None):
        found = "neither" if density is None else "both"
        raise InputError(f"Give exactly one of packing_fraction and density, found {found}.")
    volume = sphere_volume(dimension)
    if packing_fraction is not None:
        fraction = checks.number(packing_fraction, "packing_fraction", low=0, open_low=True)
        given, result = f"packing_fraction {fraction:.6g}", fraction / volume
    else:
        result = checks.number(density, "density", low=0, open_low=True)
        fraction = result * volume
        given = f"density {result:.6g} (packing fraction {fraction:.6g})"
    if limit is None:
        limit = CLOSEST_PACKING.get(dimension, 1.0)
    # The limits themselves are irrational, and a few roundings of them are no denser packing.
    if fraction > limit * (1 + 8 * np.finfo(float).eps):
        raise InputError(
            f"{given} is beyond the densest that {where} of equal spheres in {dimension} "
            f"dimension{'s' * (dimension > 1)} can reach, {limit:.6f}. Lower it."
        )
    return result


@dataclass(frozen=True)
class Lattice:
    """A lattice as a cell with right angles.

    Parameters
    ----------
    name : str
        E.g. "fcc".
    basis : tuple of d-tuples
        The points of one cell, in units of its edges.
    shape : tuple of d floats
        Edges of the cell, the first being 1.
    nearest : float
        Distance of nearest neighbours, in units of the first edge.
    """

    name: str
    basis: tuple[tuple[float, ...], ...]
    shape: tuple[float, ...]
    nearest: float

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return len(self.shape)

    @property
    def limit(self) -> float:
        """Packing fraction at which nearest neighbours touch."""
        return packing_fraction(len(self.basis), self.shape, self.nearest)

    def edge(self, density: float) -> float:
        """Return the cell's first edge [diameter] at a reduced density."""
        return (len(self.basis) / (density * math.prod(self.shape))) ** (1 / self.dimension)

    def count(self, cells: Sequence[int]) -> int:
        """Return the number of points of a block of ``cells``."""
        return len(self.basis) * math.prod(cells)

    def box(self, cells: Sequence[int], edge: float = 1.0) -> tuple[float, ...]:
        """Return the edges of a block of ``cells`` whose first edge is ``edge`` long."""
        return tuple(c * (edge * s) for c, s in zip(cells, self.shape, strict=True))

    def points(self, cells: Sequence[int], edge: float = 1.0) -> np.ndarray:
        """Return the points of a periodic block of cells.

        Parameters
        ----------
        cells : sequence of d ints
            Cells along each axis.
        edge : float
            First edge of a cell [length].

        Returns
        -------
        (n, d) array
            In [0, :meth:`box`), clear of its faces.
        """
        edges = edge * np.asarray(self.shape)
        basis = np.asarray(self.basis)
        # Off the faces of the box, where rounding would decide on which side a point lies.
        basis = basis + (1 - basis.max(axis=0)) / 2
        corners = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1)
        places = corners.reshape(-1, 1, self.dimension) + basis
        return places.reshape(-1, self.dimension) * edges


def cubic(dimension: int) -> Lattice:
    """Return the simple cubic lattice Z^d: one point a cell."""
    return Lattice("cubic", ((0.0,) * dimension,), (1.0,) * dimension, 1.0)


def triangular() -> Lattice:
    """Return the triangular lattice of the plane: two points a cell of edges 1 and sqrt(3)."""
    return Lattice("triangular", ((0.0, 0.0), (0.5, 0.5)), (1.0, math.sqrt(3)), 1.0)


def dn(dimension: int) -> Lattice:
    """Return the checkerboard lattice D_n, the integer points of even sum: 2^(d-1) points a cell.

    D_3 is fcc; D_3, D_4 and D_5 are the densest lattices of their dimensions.
    """
    halves = itertools.product((0.0, 0.5), repeat=dimension)
    basis = tuple(p for p in halves if sum(p) == int(sum(p)))
    return Lattice("fcc" if dimension == 3 else "dn", basis, (1.0,) * dimension, math.sqrt(0.5))


def densest(dimension: int) -> Lattice:
    """Return the densest lattice offered here: Z for d = 1, triangular for 2, D_n from 3 on."""
    if dimension == 1:
        return cubic(1)
    return triangular() if dimension == 2 else dn(dimension)


def named(lattice: Any, dimension: int | None = None) -> Lattice:
    """Return a lattice from its name: "cubic", "fcc", "triangular" or "dn"; a Lattice stays what it is.

    Parameters
    ----------
    lattice : str or Lattice
    dimension : int, optional
        d, for "cubic" and "dn" (3 when left out).

    Raises
    ------
    InputError
        If there is none of that name and dimension.
    """
    if isinstance(lattice, Lattice):
        return lattice
    d = checks.integer(3 if dimension is None else dimension, "dimension", low=1, high=MOST_DIMENSIONS)
    if lattice == "cubic":
        return cubic(d)
    if lattice == "dn" and d >= 3:
        return dn(d)
    fixed = {"fcc": (3, dn), "triangular": (2, lambda _: triangular())}
    if isinstance(lattice, str) and lattice in fixed and dimension in (None, fixed[lattice][0]):
        return fixed[lattice][1](fixed[lattice][0])
    raise InputError(
        "lattice must be cubic, fcc (dimension 3), triangular (dimension 2) or dn (dimension 3 and up); "
        f"found {checks.describe(lattice)} in dimension {d}."
    )


def between_walls(
    points: np.ndarray, box: Sequence[float], periodic: Sequence[bool], diameter: float
) -> np.ndarray:
    """Return points (n, d) compressed along axes with walls, where needed, to half a diameter from these.

    Parameters
    ----------
    points : (n, d) array
        In the box, centred in it.
    box, periodic : sequences of d floats and bools
        Edges [length], and which axes have no walls.
    diameter : float
        [length].
    """
    result = points.copy()
    for axis, (edge, repeats) in enumerate(zip(box, periodic, strict=True)):
        low, high = points[:, axis].min(), points[:, axis].max()
        if not repeats and low < 0.5 * diameter and high > low:
            scale = (edge - diameter) / (high - low)
            result[:, axis] = 0.5 * edge + (points[:, axis] - 0.5 * (low + high)) * scale
    return result


def cells_along(lattice: Lattice, cells: Any) -> tuple[int, ...]:
    """Return the number of cells along each axis, from one number or one an axis.

    One number m stands for m cells along the first axis and as many along the others as make the box most
    nearly a cube.

    Raises
    ------
    InputError
        If they are not positive integers, of another number of axes, or too many.
    """
    if isinstance(cells, Sequence | np.ndarray) and not isinstance(cells, str):
        if len(cells) != lattice.dimension:
            raise InputError(
                f"cells must be one integer or {lattice.dimension} of them (one an axis), found {len(cells)}."
            )
        result = tuple(checks.integer(c, "cells", low=1, high=MOST) for c in cells)
    else:
        first = checks.integer(cells, "cells", low=1, high=MOST)
        result = tuple(max(1, round(first / s)) for s in lattice.shape)
    if lattice.count(result) > MOST:
        raise InputError(f"cells must make at most {MOST} components, found {lattice.count(result)}.")
    return result


def cells_for(lattice: Lattice, n: Any) -> tuple[int, ...]:
    """Return the block of cells, the same along every axis (see :func:`cells_along`), holding ``n`` points.

    Raises
    ------
    InputError
        If there is none; the message names the nearest numbers that do.
    """
    n = checks.integer(n, "n", low=1, high=MOST)
    below, above = None, None
    guess = (n / len(lattice.basis) * math.prod(lattice.shape)) ** (1 / lattice.dimension)
    for first in itertools.count(max(1, int(guess) - 2)):
        cells = tuple(max(1, round(first / s)) for s in lattice.shape)
        count = lattice.count(cells)
        if count == n:
            return cells
        if count > n:
            above = count
            break
        below = count
    near = " or ".join(str(c) for c in (below, above) if c is not None)
    raise InputError(
        f"n = {n} does not fill a {lattice.name} lattice with equal cells along every axis; "
        f"take n = {near}, or give cells."
    )


def maxwell_velocities(
    n: int,
    dimension: int,
    masses: float | np.ndarray = 1.0,
    kT: float = 1.0,
    seed: int | np.random.Generator = 0,
    conserved: Sequence[bool] | None = None,
) -> np.ndarray:
    """Draw velocities with zero total momentum and an exact temperature.

    Parameters
    ----------
    n, dimension : int
        Number of components and of dimensions, d.
    masses : float or (n,) array
        Mass of each [mass].
    kT : float
        Temperature [energy]; 0 leaves all at rest.
    seed : int or numpy.random.Generator
        Source of randomness.
    conserved : d bools, optional
        Axes along which momentum is conserved, and zero: all by default. Walls and obstacles take up that of
        others.

    Returns
    -------
    (n, d) array
        Velocities with ``2 K = kT (d n - c)`` for c axes with momentum zero: on a torus d (n - 1) degrees of
        freedom move. One component alone keeps its momentum and has ``2 K = kT d``.

    Raises
    ------
    InputError
        If a number is out of range.
    """
    n = checks.integer(n, "n", low=1, high=MOST)
    dimension = checks.integer(dimension, "dimension", low=1)
    kT = checks.number(kT, "kT", low=0, high=checks.HOTTEST)
    rng = checks.generator(seed)
    if np.ndim(masses) == 0:
        mass = np.full(n, checks.positive(masses, "masses"))
    else:
        mass = checks.array(masses, "masses", "(n,)", ndim=1)
        if len(mass) != n or (mass <= 0).any():
            least = mass.min(initial=np.inf)
            raise InputError(f"masses must be {n} positive numbers, found {len(mass)}, the least {least:g}.")
    velocities = rng.standard_normal((n, dimension)) / np.sqrt(mass)[:, None]
    still = np.ones(dimension, bool) if conserved is None else np.array(conserved, bool)
    if n == 1:
        still[:] = False
    if still.any():
        for _ in range(2):  # the second time takes away what rounding left
            velocities -= np.where(still, mass @ velocities, 0.0) / mass.sum()
    twice_kinetic = float(mass @ np.einsum("ij,ij->i", velocities, velocities))
    freedoms = dimension * n - int(still.sum())
    return velocities * math.sqrt(kT * freedoms / twice_kinetic)
