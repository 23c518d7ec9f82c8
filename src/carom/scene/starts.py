"""Ways to begin: ``Scene.random`` and ``Scene.crystal``, of one species or of several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks, densities, seeds
from carom.errors import InputError
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import geometry_of
from carom.models.motions.shear import start_tilt
from carom.models.obstacles import named_walls
from carom.scene import box as _box, lattices, placement, species as _species
from carom.scene.fields import S
from carom.scene.keywords import refuse_unknown
from carom.scene.species import Species

if TYPE_CHECKING:
    from typing import Unpack

    from numpy.typing import ArrayLike

    from carom.scene.keywords import Keywords


TRIED = 10_000  # spheres that are grown again and again in all, where few of them jam

MOST_TRIES = 40  # the same in random starts


@dataclass(frozen=True)
class _Contents:
    """What is placed: a value a component."""

    diameters: np.ndarray
    masses: np.ndarray
    species: np.ndarray | None
    names: tuple[str, ...]


def random(
    cls: Callable[..., S],
    n: int | None = None,
    packing_fraction: float | None = None,
    dimension: int | None = None,
    *,
    density: float | None = None,
    box: float | Sequence[float] | None = None,
    species: Sequence[Species] | None = None,
    diameter: float | ArrayLike = 1.0,
    mass: float | ArrayLike = 1.0,
    seed: int | np.random.Generator = 1,
    **keywords: Unpack[Keywords],
) -> S:
    """Place spheres at random, without overlap, up to near jamming.

    Parameters
    ----------
    n : int
        Number of spheres; may be left out where each species has a ``count``, or each sphere a diameter.
    packing_fraction : float, optional
        Fraction of a cube's volume that is filled; by default 0.3, and from d = 4 on half of random close
        packing.
    dimension : int, optional
        d; by default that of the box, or 3.
    density : float, optional
        Instead, the number of spheres per diameter^d (of the largest).
    box : float or d floats, optional
        Instead, the edges [length].
    species : sequence of :class:`carom.Species`, optional
        A mixture: each species has a ``fraction`` of the n, or a ``count``.
    diameter, mass : float or (n,) array_like
        Without species, one for all or one for each, as from ``carom.sizes`` [length], [mass].
    seed : int or numpy.random.Generator
        Source of randomness.
    **keywords
        Keywords of :class:`carom.Scene`: ``walls``, ``obstacles``, ``contact``, ``pinned``, ``interaction``,
        ``motion``, ``impact``, ``drive``.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        If the box is too full (see ``carom.scene.placement``), or an argument is unknown or out of range.

    Notes
    -----
    For d = 1 the result is an exact equilibrium configuration. For d >= 2 points are thrown, and spheres that
    overlap are moved apart until they just clear; above 0.85 of random close packing smaller spheres are
    placed so, which then grow while they move (``carom.simulation.moves.growth``). Either start is valid, but
    no sample of equilibrium: many pairs nearly touch, so that g(r) at contact is many times that of the
    fluid. Run :meth:`carom.Simulation.equilibrate` before anything is measured.

    Examples
    --------
    >>> from carom import Scene, Species
    >>> Scene.random(1000, 0.4).n
    1000
    >>> small = Species("small", fraction=0.75, diameter=0.5)
    >>> Scene.random(100, species=[Species("large", fraction=0.25), small])
    Scene(n=100, dimension=3, ..., diameter=0.5 to 1, mass=1, ..., species=large 25, small 75)
    """
    refuse_unknown("Scene.random", keywords, signature(random).parameters)
    rng = seeds.generator(seed, "places")
    what = _contents(n, species, diameter, mass)
    walls, obstacles = keywords.pop("walls", False), keywords.pop("obstacles", ())
    if box is not None:
        if packing_fraction is not None or density is not None:
            raise InputError("Give box or one of packing_fraction and density, found both.")
        axes = _box.axes(box)
        d = _box.dimensions(dimension if dimension is not None else 3 if axes is None else len(axes))
        edges = _box.edges(box, d, float(what.diameters.max()), float(what.diameters.min()))
    else:
        d = 3 if dimension is None else _box.dimensions(dimension)
        if packing_fraction is None and density is None:
            packing_fraction = placement.default_fraction(d)
        edges = _box.filled(what.diameters, d, (1.0,) * d, packing_fraction=packing_fraction, density=density)
    tilt = start_tilt(keywords.get("motion"), edges) if d > 1 else 0.0
    room = geometry_of(edges, named_walls.named(walls, d), obstacles, tilt)
    matrix = _species.contact_matrix(keywords.get("contact"), what.species, what.diameters)
    final: dict[str, Any] = {"mass": what.masses, "walls": walls, "obstacles": obstacles}
    fraction = _box.packing_fraction(what.diameters, edges)
    kinds = _exchangeable(what) if len(what.diameters) >= placement.MANY else None
    if matrix is None and not tilt and placement.to_grow(fraction, d):
        smaller = what.diameters * (placement.growth_start(d) / fraction) ** (1.0 / d)

        def grow() -> tuple[np.ndarray | None, float]:
            loose = placement.random_positions(room, Contacts(smaller), rng, kinds)
            start: Any = cls(loose, edges, diameter=smaller, **final)
            found: tuple[np.ndarray | None, float] = start._grown(what.diameters, rng)
            return found

        positions = _first_that_does_not_jam(grow, fraction, len(smaller))
    else:
        contacts = Contacts(what.diameters, what.species, matrix)
        positions = placement.random_positions(room, contacts, rng, kinds)
    return cls(
        positions,
        edges,
        diameter=what.diameters,
        species=what.species,
        species_names=what.names,
        **final,
        **keywords,
    )


def crystal(
    cls: Callable[..., S],
    n: int | None = None,
    packing_fraction: float | None = None,
    dimension: int | None = None,
    *,
    density: float | None = None,
    lattice: lattices.Lattice | str | None = None,
    cells: int | Sequence[int] | None = None,
    nearest: bool = False,
    species: Sequence[Species] | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
    seed: int | np.random.Generator = 1,
    **keywords: Unpack[Keywords],
) -> S:
    """Place spheres on a lattice.

    Parameters
    ----------
    n : int
        Number of spheres, which must fill a block with equal cells along every axis; or give ``cells``.
    packing_fraction : float
        Fraction of the volume that is filled.
    dimension : int, optional
        d; by default that of the lattice, or 3.
    density : float
        Instead, the number of spheres per diameter^d (of the largest).
    lattice : str or Lattice, optional
        "fcc", "triangular", "cubic" or "dn"; by default the densest of the dimension: a row, triangular, fcc,
        D_n.
    cells : int or d ints, optional
        Cells along each axis, in place of n. One number counts those along the first axis; the others are
        chosen so that the box is nearly a cube.
    nearest : bool
        Take the count nearest to ``n`` that fills a block; a warning says which, if it is another one.
    species : sequence of :class:`carom.Species`, optional
        A mixture, in random order on the lattice, on which the largest must fit side by side.
    diameter, mass : float
        Of spheres that are all equal [length], [mass].
    seed : int or numpy.random.Generator
        Source of the order of species.
    **keywords
        Keywords of :class:`carom.Scene`, as for :meth:`carom.Scene.random`. Along axes with walls the lattice
        is compressed to make room for the spheres at the walls.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        If no block has n spheres; the message names the counts that do. If spheres would overlap, or an
        argument is unknown or out of range.

    Examples
    --------
    >>> from carom import Scene
    >>> Scene.crystal(500, 0.6)
    Scene(n=500, dimension=3, box=(7.58471, 7.58471, 7.58471), diameter=1, mass=1, packing_fraction=0.6)
    """
    refuse_unknown("Scene.crystal", keywords, signature(crystal).parameters)
    if lattice is None:
        spots = lattices.densest(_box.dimensions(3 if dimension is None else dimension))
    else:
        spots = lattices.named(lattice, dimension)
    if cells is None:
        if n is None and species is not None:
            n = sum(each.count or 0 for each in species) or None
        if n is None:
            raise InputError("Scene.crystal needs n, or cells; found neither.")
        block = lattices.cells_for(spots, n, nearest)
    else:
        block = lattices.cells_along(spots, cells)
        if n is not None and checks.integer(n, "n", low=1) != spots.count(block):
            raise InputError(f"n is {n}, and these cells have {spots.count(block)} places: leave one out.")
    sizes = checks.positive(diameter, "diameter"), checks.positive(mass, "mass")
    what = _contents(spots.count(block), species, *sizes)
    if what.species is not None:
        order = seeds.generator(seed, "places").permutation(len(what.species))
        what = _Contents(what.diameters[order], what.masses[order], what.species[order], what.names)
    largest = float(what.diameters.max())
    if species is None:
        # The limit of any packing comes first: above it no other lattice helps.
        for limit, where in ((None, "any packing"), (spots.limit, f"a {spots.name} lattice")):
            rho = densities.reduced_density(
                spots.dimension, packing_fraction=packing_fraction, density=density, limit=limit, where=where
            )
        edge = spots.edge(rho) * largest
        edges = _box.edges(spots.box(block, edge), spots.dimension, largest, largest)
    else:
        given = {"packing_fraction": packing_fraction, "density": density}
        edges = _box.filled(what.diameters, spots.dimension, spots.box(block), **given)
        edge = edges[0] / block[0]
    walls = keywords.pop("walls", False)
    repeats = named_walls.periodic_axes(named_walls.named(walls, spots.dimension), spots.dimension)
    return cls(
        lattices.between_walls(spots.points(block, edge), edges, repeats, largest),
        edges,
        diameter=what.diameters if what.species is not None else largest,
        mass=what.masses,
        species=what.species,
        species_names=what.names,
        walls=walls,
        **keywords,
    )


def _first_that_does_not_jam(
    grow: Callable[[], tuple[np.ndarray | None, float]], fraction: float, n: int
) -> np.ndarray:
    """Return positions of the first growth that reaches a packing fraction; few spheres may need several."""
    tries = min(max(TRIED // n, 1), MOST_TRIES)
    best = 0.0
    for _ in range(tries):
        positions, reached = grow()
        if positions is not None:
            return positions
        best = max(best, reached)
    raise InputError(
        f"The spheres jam at packing fraction {best:.4g}, the highest of {tries} random starts, and "
        f"{fraction:.4g} is asked for. Lower packing_fraction, begin with Scene.crystal and melt it, or "
        "compress with carom.pack, which also says how dense they get."
    )


def _contents(n: Any, species: Any, diameter: Any, mass: Any) -> _Contents:
    """Return what is to be placed, from a number of equal spheres or from species."""
    if species is None:
        if n is None and checks.several(diameter):
            n = len(diameter)
        if n is None:
            raise InputError("Give n, the number of spheres, or species with a count each; found neither.")
        count = checks.integer(n, "n", low=1, high=lattices.MOST)
        sizes = _species.per_component(diameter, "diameter", count)
        return _Contents(sizes, _species.per_component(mass, "mass", count), None, ())
    each = _species.checked_species(species)
    counted = each[0].count is not None
    numbers = _species.counts_from(
        [one.count for one in each] if counted else None,
        n,
        None if counted else [one.fraction for one in each],
        lattices.MOST,
    )
    kinds = np.repeat(np.arange(len(each)), numbers)
    if not kinds.size:
        raise InputError("A mixture needs at least one component, found none.")
    names = tuple(str(k) if one.name is None else one.name for k, one in enumerate(each))
    return _Contents(
        np.array([one.diameter for one in each])[kinds],
        np.array([one.mass for one in each])[kinds],
        kinds,
        names if any(one.name for one in each) else (),
    )


def _exchangeable(what: _Contents) -> np.ndarray:
    """Return equal numbers for components that are alike, (n,) int64."""
    kinds = np.zeros(len(what.diameters), dtype=np.int64)
    for given in (what.diameters, what.masses, kinds if what.species is None else what.species):
        values, which = np.unique(given, return_inverse=True)
        kinds = kinds * len(values) + which
    return kinds
