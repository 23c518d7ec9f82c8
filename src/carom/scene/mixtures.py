"""Scenes without order: ``Scene.random``, and mixtures of species, ``Scene.mixture``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import above, checks, seeds
from carom.errors import InputError
from carom.models import obstacles as _obstacles
from carom.scene import box as _box
from carom.scene import lattices, placement
from carom.scene import species as _species
from carom.scene.fields import S
from carom.scene.overlaps import Room
from carom.scene.species import Contacts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.obstacles import Obstacle


def random(
    cls: Callable[..., S],
    n: int,
    dimension: int | None = None,
    *,
    packing_fraction: float | None = None,
    density: float | None = None,
    box: float | Sequence[float] | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
    periodic: bool | Sequence[bool] = True,
    obstacles: Sequence[Obstacle] = (),
    seed: int | np.random.Generator = 0,
) -> S:
    """Place equal spheres at random, without overlap, up to 0.95 of random close packing.

    Parameters
    ----------
    n : int
        Number of spheres.
    dimension : int, optional
        d; by default that of the box, or 3.
    packing_fraction, density, box : optional
        At most one of the three: the fraction of a cube's volume that is filled, the number of spheres per
        diameter^d, or the edges. The default is the packing fraction 0.3, and from d = 4 on half of random
        close packing.
    diameter, mass, periodic, obstacles
        As in :class:`carom.Scene`.
    seed : int or numpy.random.Generator
        Source of randomness.

    Raises
    ------
    InputError
        If the box is too full (see ``carom.scene.placement``), or an argument is out of range.

    Notes
    -----
    For d = 1 the result is an exact equilibrium configuration; for d >= 2 it must still be equilibrated.
    Above 0.85 of random close packing smaller spheres are placed, which then grow while they move
    (``carom.simulation.growth``).
    """
    n = checks.integer(n, "n", low=1, high=lattices.MOST)
    sigma = checks.positive(diameter, "diameter")
    return _thrown(
        cls,
        np.full(n, sigma),
        np.full(n, checks.positive(mass, "mass")),
        dimension=dimension,
        packing_fraction=packing_fraction,
        density=density,
        box=box,
        periodic=periodic,
        obstacles=obstacles,
        seed=seed,
    )


def mixture(
    cls: Callable[..., S],
    counts: Sequence[int] | None = None,
    *,
    n: int | None = None,
    fractions: Sequence[float] | None = None,
    diameters: Sequence[float],
    masses: Sequence[float] | None = None,
    names: Sequence[str] = (),
    contact: ArrayLike | None = None,
    dimension: int | None = None,
    packing_fraction: float | None = None,
    density: float | None = None,
    box: float | Sequence[float] | None = None,
    lattice: lattices.Lattice | str | None = None,
    cells: int | Sequence[int] | None = None,
    periodic: bool | Sequence[bool] = True,
    obstacles: Sequence[Obstacle] = (),
    seed: int | np.random.Generator = 0,
) -> S:
    """Place a mixture of species: at random without overlap, or in random order on a lattice.

    Parameters
    ----------
    counts : sequence of K ints, optional
        Number of each species; alternatively ``n`` and ``fractions``.
    n : int, optional
        Total number; may be omitted on a lattice with ``cells``.
    fractions : sequence of K floats, optional
        Ratios of the numbers of each species; they need not sum to 1. Numbers are rounded to integers.
    diameters, masses : sequences of K floats
        Diameter and mass of each species [length], [mass]; masses are 1 by default.
    names : sequence of K str, optional
        Names of the species.
    contact
        As in :class:`carom.Scene`.
    dimension : int, optional
        d; by default that of the box or the lattice, or 3.
    packing_fraction, density, box : optional
        At most one of the three, as in :meth:`carom.Scene.random`; density = N sigma_max^d / V, with the
        *largest* diameter.
    lattice : str or Lattice, optional
        "cubic", "fcc", "triangular" or "dn". It needs a packing fraction or a density at which the largest
        spheres fit side by side.
    cells : int or d ints, optional
        Cells of the lattice along each axis; by default enough for all spheres.
    periodic, obstacles
        As in :class:`carom.Scene`.
    seed : int or numpy.random.Generator
        Source of randomness.

    Raises
    ------
    InputError
        If the box is too full, or an argument is missing or out of range.

    Examples
    --------
    >>> from carom import Scene
    >>> scene = Scene.mixture(n=100, fractions=[1, 3], diameters=[1.0, 0.5], names=["large", "small"])
    >>> scene
    Scene(n=100, dimension=3, ..., diameter=0.5 to 1, mass=1, ..., species=large 25, small 75)
    """
    rng = seeds.generator(seed, "places")
    names = () if names is None else _species.listed(names, "names")
    kinds = np.asarray([checks.positive(x, "diameters") for x in _species.listed(diameters, "diameters")])
    weights = [1.0] * len(kinds) if masses is None else _species.listed(masses, "masses")
    each_mass = np.asarray([checks.positive(x, "masses") for x in weights])
    spots = None if lattice is None else lattices.named(lattice, dimension)
    if spots is not None and cells is not None and counts is None and n is None:
        n = spots.count(lattices.cells_along(spots, cells))
    numbers = _species.counts_from(counts, n, fractions, lattices.MOST)
    for name, values in (("diameters", kinds), ("masses", each_mass), ("names", names or kinds)):
        if len(values) != len(numbers):
            raise InputError(
                f"{name} must have one value for each of {len(numbers)} species, found {len(values)}."
            )
    species = np.repeat(np.arange(len(numbers)), numbers)
    if not species.size:
        raise InputError("A mixture needs at least one component, found none.")
    more: dict[str, Any] = {"species": species, "species_names": names, "contact": contact}
    places: dict[str, Any] = {"packing_fraction": packing_fraction, "density": density}
    if spots is None:
        if cells is not None:
            raise InputError("cells belong to a lattice; give lattice too, or n.")
        return _thrown(
            cls,
            kinds[species],
            each_mass[species],
            dimension=dimension,
            box=box,
            periodic=periodic,
            obstacles=obstacles,
            seed=rng,
            **places,
            **more,
        )
    if box is not None:
        raise InputError("A lattice takes a packing_fraction or a density, found a box.")
    block = lattices.cells_for(spots, len(species)) if cells is None else lattices.cells_along(spots, cells)
    if spots.count(block) != len(species):
        raise InputError(f"The lattice has {spots.count(block)} places, found {len(species)} spheres.")
    species = rng.permutation(species)
    edges = _box.filled(kinds[species], spots.dimension, spots.box(block), **places)
    repeats = _box.periodicity(periodic, spots.dimension)
    points = spots.points(block, edges[0] / block[0])
    return cls(
        lattices.between_walls(points, edges, repeats, float(kinds.max())),
        edges,
        diameter=kinds[species],
        mass=each_mass[species],
        periodic=periodic,
        obstacles=obstacles,
        **{**more, "species": species},
    )


def _thrown(
    cls: Callable[..., S],
    diameters: np.ndarray,
    masses: np.ndarray,
    *,
    dimension: int | None,
    packing_fraction: float | None,
    density: float | None,
    box: float | Sequence[float] | None,
    periodic: bool | Sequence[bool],
    obstacles: Sequence[Obstacle],
    seed: int | np.random.Generator,
    species: np.ndarray | None = None,
    species_names: Sequence[str] = (),
    contact: ArrayLike | None = None,
) -> S:
    """Return a scene of spheres placed at random."""
    if box is not None:
        if packing_fraction is not None or density is not None:
            raise InputError("Give box or one of packing_fraction and density, found both.")
        axes = _box.axes(box)
        d = _box.dimensions(dimension if dimension is not None else 3 if axes is None else len(axes))
        edges = _box.edges(box, d, float(diameters.max()), float(diameters.min()))
    else:
        d = 3 if dimension is None else _box.dimensions(dimension)
        if packing_fraction is None and density is None:
            packing_fraction = placement.default_fraction(d)
        edges = _box.filled(diameters, d, (1.0,) * d, packing_fraction=packing_fraction, density=density)
    repeats = _box.periodicity(periodic, d)
    standing = _obstacles.checked(obstacles, edges, repeats)
    matrix = _species.contact_matrix(contact, species, diameters)
    room = Room(np.asarray(edges), np.asarray(repeats), standing)
    rng = seeds.generator(seed, "places")
    final: dict[str, Any] = {"mass": masses, "periodic": repeats, "obstacles": standing}
    fraction = _box.packing_fraction(diameters, edges)
    kinds = None
    if len(diameters) >= placement.MANY:
        kinds = np.zeros(len(diameters), dtype=np.int64)
        for given in (diameters, masses, kinds if species is None else species):
            values, which = np.unique(given, return_inverse=True)
            kinds = kinds * len(values) + which
    if matrix is None and placement.to_grow(fraction, d):
        smaller = diameters * (placement.growth_start(d) / fraction) ** (1.0 / d)
        loose = placement.random_positions(room, Contacts(smaller), rng, kinds)
        positions = above.grown(cls(loose, edges, diameter=smaller, **final), diameters, rng)
    else:
        contacts = Contacts(diameters, species, matrix)
        positions = placement.random_positions(room, contacts, rng, kinds)
    return cls(
        positions,
        edges,
        diameter=diameters,
        species=species,
        species_names=species_names,
        contact=contact,
        **final,
    )
