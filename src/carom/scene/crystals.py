"""Scenes on lattices: ``Scene.cubic``, ``fcc``, ``triangular``, ``dn``, ``lattice`` and ``on``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from carom import checks, densities
from carom.scene import box as _box
from carom.scene import lattices
from carom.scene.fields import S

if TYPE_CHECKING:
    from carom.models.obstacles import Obstacle


def cubic(
    cls: Callable[..., S],
    cells: int | Sequence[int],
    dimension: int = 3,
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
) -> S:
    """Place spheres on the simple cubic lattice, one per cell.

    Parameters
    ----------
    cells : int or d ints
        Cells along each axis; the box is that many cells long.
    dimension : int
        d.
    packing_fraction, density : float
        Exactly one of the two: the fraction of the volume that is filled, or the number of spheres per
        diameter^d.
    diameter, mass : float
        As in :class:`carom.Scene`.

    Raises
    ------
    InputError
        If the spheres would overlap, or an argument is out of range.
    """
    lattice = lattices.cubic(_box.dimensions(dimension))
    return on(
        cls,
        lattice,
        cells,
        packing_fraction=packing_fraction,
        density=density,
        diameter=diameter,
        mass=mass,
    )


def fcc(
    cls: Callable[..., S],
    cells: int | Sequence[int],
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
) -> S:
    """Place spheres on the face-centred cubic lattice (d = 3), four per cell.

    Parameters and errors are those of :meth:`carom.Scene.cubic`.
    """
    return on(
        cls,
        lattices.dn(3),
        cells,
        packing_fraction=packing_fraction,
        density=density,
        diameter=diameter,
        mass=mass,
    )


def triangular(
    cls: Callable[..., S],
    cells: int | Sequence[int],
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
) -> S:
    """Place disks on the triangular lattice (d = 2), two per cell of edges a and sqrt(3) a.

    One number of cells counts those along x; along y their number is chosen so that the box is nearly a
    square. Other parameters and errors are those of :meth:`carom.Scene.cubic`.
    """
    return on(
        cls,
        lattices.triangular(),
        cells,
        packing_fraction=packing_fraction,
        density=density,
        diameter=diameter,
        mass=mass,
    )


def dn(
    cls: Callable[..., S],
    cells: int | Sequence[int],
    dimension: int,
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
) -> S:
    """Place spheres on the lattice D_n (d >= 3), 2^(d-1) per cell.

    Parameters and errors are those of :meth:`carom.Scene.cubic`.
    """
    lattice = lattices.dn(_box.dimensions(dimension, low=3))
    return on(
        cls,
        lattice,
        cells,
        packing_fraction=packing_fraction,
        density=density,
        diameter=diameter,
        mass=mass,
    )


def lattice(
    cls: Callable[..., S],
    cells: int | Sequence[int],
    dimension: int = 3,
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
) -> S:
    """Place spheres on a dense lattice: a row, triangular, fcc, D_n (d = 1, 2, 3, more).

    Parameters and errors are those of :meth:`carom.Scene.cubic`.
    """
    lattice = lattices.densest(_box.dimensions(dimension))
    return on(
        cls,
        lattice,
        cells,
        packing_fraction=packing_fraction,
        density=density,
        diameter=diameter,
        mass=mass,
    )


def on(
    cls: Callable[..., S],
    lattice: lattices.Lattice,
    cells: int | Sequence[int],
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
    periodic: bool | Sequence[bool] = True,
    obstacles: Sequence[Obstacle] = (),
) -> S:
    """Place spheres on any ``carom.scene.lattices.Lattice``.

    Parameters and errors are those of :meth:`carom.Scene.cubic` and :class:`carom.Scene`. Along axes with
    walls the lattice is compressed to make room for the spheres at the walls.
    """
    sigma = checks.positive(diameter, "diameter")
    # The limit of any packing comes first: above it no other lattice helps.
    for limit, where in ((None, "any packing"), (lattice.limit, f"a {lattice.name} lattice")):
        rho = densities.reduced_density(
            lattice.dimension,
            packing_fraction=packing_fraction,
            density=density,
            limit=limit,
            where=where,
        )
    block = lattices.cells_along(lattice, cells)
    edge = lattice.edge(rho) * sigma
    box = _box.edges(lattice.box(block, edge), lattice.dimension, sigma, sigma)
    repeats = _box.periodicity(periodic, lattice.dimension)
    places = lattices.between_walls(lattice.points(block, edge), box, repeats, sigma)
    return cls(places, box, diameter=sigma, mass=mass, periodic=repeats, obstacles=obstacles)
