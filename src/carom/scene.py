"""What is simulated: components, box, walls and obstacles, checked once and then never again."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np

from carom import box as _box
from carom import checks, conversion, initial, overlaps
from carom import obstacles as _obstacles
from carom import species as _species
from carom.errors import InputError, OverlapError
from carom.obstacles import Obstacle
from carom.overlaps import Room
from carom.species import Contacts

if TYPE_CHECKING:
    import ase
    from numpy.typing import ArrayLike

    from carom.frame import Frame


class Scene:
    """Hard spheres of any dimension in a box, with walls and obstacles: the one place where input is checked.

    Parameters
    ----------
    positions : (n, d) array_like
        Centres [length]; along periodic axes they are wrapped into ``0 <= x < edge``. Kept read-only.
    box : float or d floats
        Edges of the box [length]; one number makes a cube. Each must be *greater* than the largest diameter:
        with edge = diameter a sphere would always touch its own image, or both walls.
    diameter : float or (n,) array_like
        sigma, of all or of each [length].
    mass : float or (n,) array_like
        m, of all or of each [mass].
    velocities : (n, d) array_like, optional
        Velocities [length / time]; left out, the simulation draws them (Maxwell).
    species : (n,) array_like of int, optional
        Which species each component is, from 0.
    contact : (K, K) array_like, optional
        Distances at which components of two species touch [length]: symmetric, the species' diameters on its
        diagonal. Left out, contacts are additive: the mean of the two diameters.
    periodic : bool or d bools
        False gives an axis two hard walls, at 0 and at the edge, that the *surfaces* cannot pass: centres
        stay in [radius, edge - radius].
    obstacles : sequence of obstacles
        Planes, balls, containers (:mod:`carom.obstacles`), or one's own.
    restitution : float
        Part of the normal relative velocity that is left after a collision, in (0, 1]; 1 is elastic.
    elastic_below : float, optional
        Normal relative speed below which a collision is elastic [length / time]. It keeps inelastic spheres
        from colliding infinitely often in a finite time, so it must be positive where restitution < 1. Left
        out, the simulation takes 1e-3 of the thermal speed sqrt(kT / m).
    species_names : sequence of str, optional
        Names of the species, for files and tables.

    Raises
    ------
    OverlapError
        If spheres overlap, or one an obstacle, by more than rounding explains: 1e-12 of the contact distance,
        and what coordinates as large as the box lose (:func:`carom.overlaps.tolerance`). The message names
        the pair, or the component and the obstacle. Contact is legal.
    InputError
        If anything else cannot be simulated: a wrong type or shape, NaN, no particle, an edge too small.

    Attributes
    ----------
    diameter : float
        The common diameter; the largest where they differ.
    mass : float
        The common mass; the mean where they differ.
    diameters, masses : (n,) arrays
        Of each component, read-only.
    equal : bool
        Whether all have one diameter and one mass, without a contact matrix.
    species : (n,) int64 array or None
    species_names : tuple of str
    contact : (K, K) array or None
    periodic : tuple of d bools
    obstacles : tuple
        Without the walls of the axes.
    restitution : float
    elastic_below : float or None
        None where the simulation is to choose it; 0 where collisions are elastic.

    Examples
    --------
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0)
    Scene(n=2, dimension=2, box=(3, 3), diameter=1, mass=1, packing_fraction=0.174533)
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0, diameter=[1.0, 0.5], periodic=[True, False])
    Scene(n=2, dimension=2, box=(3, 3), diameter=0.5 to 1, mass=1, packing_fraction=0.109083, walls=axis 1)
    """

    positions: np.ndarray
    box: tuple[float, ...]
    diameter: float
    mass: float
    diameters: np.ndarray
    masses: np.ndarray
    velocities: np.ndarray | None
    equal: bool
    species: np.ndarray | None
    species_names: tuple[str, ...]
    contact: np.ndarray | None
    periodic: tuple[bool, ...]
    obstacles: tuple[Obstacle, ...]
    restitution: float
    elastic_below: float | None

    def __init__(
        self,
        positions: ArrayLike,
        box: float | Sequence[float] | np.ndarray,
        *,
        diameter: float | ArrayLike = 1.0,
        mass: float | ArrayLike = 1.0,
        velocities: ArrayLike | None = None,
        species: ArrayLike | None = None,
        contact: ArrayLike | None = None,
        periodic: bool | Sequence[bool] | np.ndarray = True,
        obstacles: Sequence[Obstacle] = (),
        restitution: float = 1.0,
        elastic_below: float | None = None,
        species_names: Sequence[str] = (),
    ) -> None:
        places = checks.array(positions, "positions", "(n, d)", ndim=2)
        n, dimension = places.shape
        if n == 0 or dimension == 0:
            raise InputError(
                f"A scene needs at least one particle and one dimension, found {n} in {dimension}."
            )
        diameters = _species.per_component(diameter, "diameter", n)
        masses = _species.per_component(mass, "mass", n)
        kinds = _species.labels(species, n)
        matrix = _species.contact_matrix(contact, kinds, diameters)
        edges = _box.edges(box, dimension, float(diameters.max()), float(diameters.min()))
        repeats = _box.periodicity(periodic, dimension)
        standing = _obstacles.checked(obstacles, edges, repeats)
        room = Room(np.asarray(edges), np.asarray(repeats), standing)
        places = room.wrapped(places)
        _refuse_overlap(places, room, Contacts(diameters, kinds, matrix))
        places.setflags(write=False)
        one_diameter, one_mass = np.ptp(diameters) == 0, np.ptp(masses) == 0
        elasticity = _restitution(restitution, elastic_below)
        vars(self).update(
            positions=places,
            box=edges,
            diameter=float(diameters.max()),
            mass=float(masses[0] if one_mass else masses.mean()),
            diameters=diameters,
            masses=masses,
            velocities=None if velocities is None else _speeds(velocities, places.shape),
            equal=bool(one_diameter and one_mass and matrix is None),
            species=kinds,
            species_names=_species.names(species_names, kinds),
            contact=matrix,
            periodic=repeats,
            obstacles=standing,
            restitution=elasticity[0],
            elastic_below=elasticity[1],
        )

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed; make another: scene.with_({name}=...).")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed, so {name} stays.")

    def with_(self, **changes: Any) -> Self:
        """Return the same scene with some arguments of :class:`Scene` changed, checked again as a whole.

        Raises
        ------
        InputError
            If an argument is unknown, and as :class:`Scene` does.

        Examples
        --------
        >>> Scene.fcc(2, packing_fraction=0.3).with_(restitution=0.9).restitution
        0.9
        """
        arguments: dict[str, Any] = {
            "positions": self.positions,
            "box": self.box,
            "diameter": self.diameters,
            "mass": self.masses,
            "velocities": self.velocities,
            "species": self.species,
            "contact": self.contact,
            "periodic": self.periodic,
            "obstacles": self.obstacles,
            "restitution": self.restitution,
            "elastic_below": self.elastic_below,
            "species_names": self.species_names,
        }
        for name in changes:
            if name not in arguments:
                raise InputError(f"A scene has no {name}; known are {', '.join(arguments)}.")
        if "restitution" in changes and "elastic_below" not in changes:
            arguments["elastic_below"] = None
        return type(self)(**{**arguments, **changes})

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Return the scene as arrays, and values that JSON holds, by name; for :meth:`from_arrays`."""
        arrays = {"positions": self.positions}
        attributes: dict[str, Any] = {
            "box": list(self.box),
            "periodic": list(self.periodic),
            "obstacles": [_obstacles.to_json(o) for o in self.obstacles],
            "restitution": self.restitution,
            "elastic_below": self.elastic_below,
            "species_names": list(self.species_names),
        }
        for name, values in (("diameter", self.diameters), ("mass", self.masses)):
            if np.ptp(values) == 0:
                attributes[name] = float(values[0])
            else:
                arrays[name] = values
        for name in ("velocities", "species", "contact"):
            if getattr(self, name) is not None:
                arrays[name] = getattr(self, name)
        return arrays, attributes

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, np.ndarray],
        attributes: Mapping[str, Any],
        *,
        obstacles: Sequence[Obstacle] | None = None,
    ) -> Self:
        """Return the scene that :meth:`to_arrays` took apart, bit for bit.

        Parameters
        ----------
        arrays, attributes : mappings
            What it returned; other names among the arrays are left alone.
        obstacles : sequence of obstacles, optional
            Needed where some are of a class of one's own, which no file holds: all of them, in order.

        Raises
        ------
        InputError
            If something is missing or damaged, or an obstacle of one's own is not given.
        """
        try:
            kept = attributes["obstacles"]
            if obstacles is None:
                obstacles = tuple(_obstacles.from_json(each) for each in kept)
            elif len(obstacles) != len(kept):
                raise InputError(f"The scene has {len(kept)} obstacles, found {len(obstacles)}.")
            return cls(
                arrays["positions"],
                tuple(attributes["box"]),
                diameter=arrays["diameter"] if "diameter" in arrays else attributes["diameter"],
                mass=arrays["mass"] if "mass" in arrays else attributes["mass"],
                velocities=arrays.get("velocities"),
                species=arrays.get("species"),
                contact=arrays.get("contact"),
                periodic=tuple(attributes["periodic"]),
                obstacles=obstacles,
                restitution=attributes["restitution"],
                elastic_below=attributes["elastic_below"] if attributes["restitution"] < 1 else None,
                species_names=tuple(attributes["species_names"]),
            )
        except (KeyError, TypeError) as problem:
            raise InputError(f"These arrays and attributes are no scene: {problem}.") from None

    @property
    def n(self) -> int:
        """Number of components."""
        return self.positions.shape[0]

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return len(self.box)

    @property
    def volume(self) -> float:
        """Volume of the box [length^d]."""
        return math.prod(self.box)

    @property
    def number_density(self) -> float:
        """Components a volume [length^-d]."""
        return self.n / self.volume

    @property
    def packing_fraction(self) -> float:
        """Volume of the spheres over that of the box, eta; what obstacles take is not subtracted."""
        return _box.packing_fraction(self.diameters, self.box)

    @property
    def walls(self) -> bool:
        """Whether any axis has walls instead of being periodic."""
        return not all(self.periodic)

    @property
    def simple(self) -> bool:
        """Whether all are equal and elastic, and alone in a periodic box: what theory knows most about."""
        return self.equal and not self.walls and not self.obstacles and self.restitution == 1.0

    @property
    def species_count(self) -> int:
        """Number of species, K: 1 where none are given."""
        if self.species is None:
            return 1
        contacts = 0 if self.contact is None else len(self.contact)
        return max(int(self.species.max()) + 1, len(self.species_names), contacts)

    @classmethod
    def cubic(
        cls,
        cells: int | Sequence[int],
        dimension: int = 3,
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
    ) -> Self:
        """Place spheres on the simple cubic lattice, one a cell.

        Parameters
        ----------
        cells : int or d ints
            Cells along each axis; the box is that many cells long.
        dimension : int
            d.
        packing_fraction, density : float
            Exactly one of the two: the part of the volume filled, or the number of spheres in diameter^d.
        diameter, mass : float
            As in :class:`Scene`.

        Raises
        ------
        InputError
            If the spheres would overlap, or an argument is out of range.
        """
        lattice = initial.cubic(_box.dimensions(dimension))
        return cls.on(
            lattice,
            cells,
            packing_fraction=packing_fraction,
            density=density,
            diameter=diameter,
            mass=mass,
        )

    @classmethod
    def fcc(
        cls,
        cells: int | Sequence[int],
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
    ) -> Self:
        """Place spheres on the face-centred cubic lattice (d = 3), four a cell; as :meth:`cubic`."""
        return cls.on(
            initial.dn(3),
            cells,
            packing_fraction=packing_fraction,
            density=density,
            diameter=diameter,
            mass=mass,
        )

    @classmethod
    def triangular(
        cls,
        cells: int | Sequence[int],
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
    ) -> Self:
        """Place disks on the triangular lattice (d = 2), two a cell of edges a and sqrt(3) a.

        One number of cells counts those along x; along y as many are taken as make the box most nearly a
        square. The other arguments are those of :meth:`cubic`.
        """
        return cls.on(
            initial.triangular(),
            cells,
            packing_fraction=packing_fraction,
            density=density,
            diameter=diameter,
            mass=mass,
        )

    @classmethod
    def dn(
        cls,
        cells: int | Sequence[int],
        dimension: int,
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
    ) -> Self:
        """Place spheres on the lattice D_n (d >= 3), 2^(d-1) a cell; arguments as :meth:`cubic`."""
        lattice = initial.dn(_box.dimensions(dimension, low=3))
        return cls.on(
            lattice,
            cells,
            packing_fraction=packing_fraction,
            density=density,
            diameter=diameter,
            mass=mass,
        )

    @classmethod
    def lattice(
        cls,
        cells: int | Sequence[int],
        dimension: int = 3,
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
    ) -> Self:
        """Place spheres on a dense lattice: a row, triangular, fcc, D_n (d = 1, 2, 3, more)."""
        lattice = initial.densest(_box.dimensions(dimension))
        return cls.on(
            lattice,
            cells,
            packing_fraction=packing_fraction,
            density=density,
            diameter=diameter,
            mass=mass,
        )

    @classmethod
    def on(
        cls,
        lattice: initial.Lattice,
        cells: int | Sequence[int],
        *,
        packing_fraction: float | None = None,
        density: float | None = None,
        diameter: float = 1.0,
        mass: float = 1.0,
        periodic: bool | Sequence[bool] = True,
        obstacles: Sequence[Obstacle] = (),
    ) -> Self:
        """Place spheres on any :class:`carom.initial.Lattice`; arguments as :meth:`cubic` and :class:`Scene`.

        Along axes with walls the lattice is compressed as far as the spheres at the walls need it.
        """
        sigma = checks.positive(diameter, "diameter")
        # The densest packing of all first: beyond it no other lattice helps.
        for limit, where in ((None, "any packing"), (lattice.limit, f"a {lattice.name} lattice")):
            rho = initial.reduced_density(
                lattice.dimension,
                packing_fraction=packing_fraction,
                density=density,
                limit=limit,
                where=where,
            )
        block = initial.cells_along(lattice, cells)
        edge = lattice.edge(rho) * sigma
        box = _box.edges(lattice.box(block, edge), lattice.dimension, sigma, sigma)
        repeats = _box.periodicity(periodic, lattice.dimension)
        places = initial.between_walls(lattice.points(block, edge), box, repeats, sigma)
        return cls(places, box, diameter=sigma, mass=mass, periodic=repeats, obstacles=obstacles)

    @classmethod
    def random(
        cls,
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
    ) -> Self:
        """Place equal spheres at random, without overlap, up to 0.95 of random close packing.

        Parameters
        ----------
        n : int
            Number of spheres.
        dimension : int, optional
            d; that of the box, or 3.
        packing_fraction, density, box : optional
            At most one of the three: the part of a cube's volume filled, the number of spheres in diameter^d,
            or the edges. Without any, packing fraction 0.3 (from d = 4 on half of random close packing).
        diameter, mass, periodic, obstacles
            As in :class:`Scene`.
        seed : int or numpy.random.Generator
            Source of randomness.

        Raises
        ------
        InputError
            If the box is too full for it (see :mod:`carom.placement`), or an argument is out of range.

        Notes
        -----
        The exact equilibrium for d = 1; for d >= 2 a start that must still be equilibrated. Beyond 0.85 of
        random close packing, and for many spheres, they are placed smaller and then grow while they move
        (:mod:`carom.dense`).
        """
        n = checks.integer(n, "n", low=1, high=initial.MOST)
        sigma = checks.positive(diameter, "diameter")
        return cls._thrown(
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

    @classmethod
    def mixture(
        cls,
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
        lattice: initial.Lattice | str | None = None,
        cells: int | Sequence[int] | None = None,
        periodic: bool | Sequence[bool] = True,
        obstacles: Sequence[Obstacle] = (),
        seed: int | np.random.Generator = 0,
    ) -> Self:
        """Place a mixture of species: at random without overlap, or in random order on a lattice.

        Parameters
        ----------
        counts : sequence of K ints, optional
            How many of each species; or ``n`` and ``fractions``.
        n : int, optional
            How many in all; on a lattice with ``cells`` it may be left out.
        fractions : sequence of K floats, optional
            Ratios of the numbers of each species, of any sum. They are rounded to whole numbers.
        diameters, masses : sequences of K floats
            Of each species [length], [mass]; masses are 1 where left out.
        names : sequence of K str, optional
            Of the species.
        contact, periodic, obstacles
            As in :class:`Scene`.
        dimension : int, optional
            d; that of the box or the lattice, or 3.
        packing_fraction, density, box : optional
            At most one of the three, as in :meth:`random`; a density is the number of spheres in a volume of
            the *largest* diameter to the power d.
        lattice : str or carom.initial.Lattice, optional
            "cubic", "fcc", "triangular" or "dn"; needs a packing fraction or a density at which the largest
            fit side by side.
        cells : int or d ints, optional
            Cells of the lattice along each axis; left out, those that hold all spheres.
        seed : int or numpy.random.Generator
            Source of randomness.

        Raises
        ------
        InputError
            If the box is too full, or an argument is missing or out of range.

        Examples
        --------
        >>> scene = Scene.mixture(n=100, fractions=[1, 3], diameters=[1.0, 0.5], names=["large", "small"])
        >>> scene
        Scene(n=100, dimension=3, ..., diameter=0.5 to 1, mass=1, ..., species=large 25, small 75)
        """
        rng = checks.generator(seed)
        kinds = np.asarray([checks.positive(x, "diameters") for x in _species.listed(diameters, "diameters")])
        weights = [1.0] * len(kinds) if masses is None else _species.listed(masses, "masses")
        each_mass = np.asarray([checks.positive(x, "masses") for x in weights])
        spots = None if lattice is None else initial.named(lattice, dimension)
        if spots is not None and cells is not None and counts is None and n is None:
            n = spots.count(initial.cells_along(spots, cells))
        numbers = _species.counts_from(counts, n, fractions, initial.MOST)
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
            return cls._thrown(
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
        block = initial.cells_for(spots, len(species)) if cells is None else initial.cells_along(spots, cells)
        if spots.count(block) != len(species):
            raise InputError(f"The lattice has {spots.count(block)} places, found {len(species)} spheres.")
        species = rng.permutation(species)
        edges = _box.filled(kinds[species], spots.dimension, spots.box(block), **places)
        repeats = _box.periodicity(periodic, spots.dimension)
        points = spots.points(block, edges[0] / block[0])
        return cls(
            initial.between_walls(points, edges, repeats, float(kinds.max())),
            edges,
            diameter=kinds[species],
            mass=each_mass[species],
            periodic=periodic,
            obstacles=obstacles,
            **{**more, "species": species},
        )

    @classmethod
    def _thrown(
        cls,
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
    ) -> Self:
        """Return a scene of spheres placed at random."""
        from carom import dense, placement

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
        rng = checks.generator(seed)
        final: dict[str, Any] = {"mass": masses, "periodic": repeats, "obstacles": standing}
        fraction = _box.packing_fraction(diameters, edges)
        kinds = None
        if len(diameters) >= placement.MANY:
            kinds = np.zeros(len(diameters), dtype=np.int64)
            for given in (diameters, masses, kinds if species is None else species):
                values, which = np.unique(given, return_inverse=True)
                kinds = kinds * len(values) + which
        if matrix is None and dense.wanted(len(diameters), fraction, d):
            smaller = diameters * (dense.start_fraction(d) / fraction) ** (1.0 / d)
            loose = placement.random_positions(room, Contacts(smaller), rng, kinds)
            positions = dense.grown(cls(loose, edges, diameter=smaller, **final), diameters, rng)
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

    @classmethod
    def from_frame(
        cls, frame: Frame, *, contact: ArrayLike | None = None, obstacles: Sequence[Obstacle] = ()
    ) -> Self:
        """Take everything from a frame but its images and time.

        Parameters
        ----------
        frame : Frame
            Its axes that are not periodic get walls.
        contact, obstacles
            As in :class:`Scene`; a frame does not hold them.

        Raises
        ------
        InputError
            As :class:`Scene` does.

        Warns
        -----
        CaromWarning
            If spheres overlap by no more than single precision explains (a GSD file holds such numbers): they
            are then moved apart by as little.
        """
        arguments = conversion.of_frame(frame) | {"contact": contact, "obstacles": obstacles}
        if frame.positions.size:
            sizes = _species.per_component(arguments["diameter"], "diameter", frame.n)
            edges = _box.edges(frame.box, frame.dimension, float(sizes.max()), float(sizes.min()))
            arguments["positions"] = conversion.parted(
                arguments, edges, _box.periodicity(frame.periodic, frame.dimension)
            )
        return cls(**arguments)

    @classmethod
    def from_ase(cls, atoms: ase.Atoms, *, diameter: float | None = None, walls: bool = False) -> Self:
        """Take positions, cell, masses, momenta, radii and kinds from an ``ase.Atoms``.

        Parameters
        ----------
        atoms : ase.Atoms
            In a cell with right angles along the axes. Its periodic axes are the scene's: with ``pbc`` "T T
            F" and all z equal it is a scene of disks, d = 2. Different chemical symbols become species of
            these names.
        diameter : float, optional
            Of every sphere, where ``atoms`` has no array ``radius``; 1 by default.
        walls : bool
            Whether axes that are not periodic, but along which coordinates differ, become axes with walls at
            the faces of the cell; else they are refused.

        Raises
        ------
        InputError
            If the cell is skew, no axis is periodic, coordinates differ along one that is not, the diameter
            is given twice, and as :class:`Scene` does.
        """
        return cls(**conversion.of_atoms(atoms, diameter, walls))

    def _facts(self) -> dict[str, str]:
        facts = {
            "n": str(self.n),
            "dimension": str(self.dimension),
            "box": "(" + ", ".join(f"{x:.6g}" for x in self.box) + ("," if self.dimension == 1 else "") + ")",
            "diameter": _span(self.diameters),
            "mass": _span(self.masses),
            "packing_fraction": f"{self.packing_fraction:.6g}",
        }
        if self.species is not None:
            counts = np.bincount(self.species, minlength=self.species_count)
            names = self.species_names or [str(k) for k in range(len(counts))]
            facts["species"] = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
        if self.contact is not None:
            facts["contact"] = "by species"
        if self.walls:
            axes = [str(axis) for axis, repeats in enumerate(self.periodic) if not repeats]
            facts["walls"] = f"axis {', '.join(axes)}"
        if self.obstacles:
            facts["obstacles"] = ", ".join(obstacle.name for obstacle in self.obstacles)
        if self.restitution < 1:
            facts["restitution"] = f"{self.restitution:.6g}"
        if self.velocities is not None:
            facts["velocities"] = "given"
        return facts

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v}' for k, v in self._facts().items())})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th>{html.escape(k.replace('_', ' '))}</th><td>{html.escape(v)}</td></tr>"
            for k, v in self._facts().items()
        )
        return f"<table><caption>carom.Scene</caption>{rows}</table>"


def _restitution(restitution: Any, elastic_below: Any) -> tuple[float, float | None]:
    """Return both, checked: a threshold of zero where collisions are elastic anyway, None for the default."""
    part = checks.number(restitution, "restitution", low=0, high=1, open_low=True)
    if elastic_below is None:
        return part, 0.0 if part == 1 else None
    speed = checks.number(elastic_below, "elastic_below", low=0, high=checks.FASTEST)
    if part == 1 and speed > 0:
        raise InputError("elastic_below has no meaning where restitution is 1; remove it.")
    if part < 1 and speed == 0:
        raise InputError(
            "elastic_below must be positive where restitution is below 1: else spheres collide infinitely "
            "often in a finite time. Leave it out for 1e-3 of the thermal speed."
        )
    return part, speed


def _speeds(velocities: Any, shape: tuple[int, ...]) -> np.ndarray:
    result = checks.array(velocities, "velocities", "(n, d)", ndim=2)
    if result.shape != shape:
        raise InputError(f"velocities must have the shape of positions, {shape}, found {result.shape}.")
    fastest = float(np.abs(result).max())
    if fastest > checks.FASTEST:
        raise InputError(f"velocities must be at most {checks.FASTEST:g}, found {fastest:g}.")
    result.setflags(write=False)
    return result


def _span(values: np.ndarray) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


def _refuse_overlap(places: np.ndarray, room: Room, contacts: Contacts) -> None:
    """Raise OverlapError where two spheres overlap, or one an obstacle or a wall."""
    inside = overlaps.intruder(places, room, 0.5 * contacts.diameters)
    if inside is not None:
        i, obstacle, depth = inside
        raise OverlapError(
            f"sphere {i} is inside an obstacle, {obstacle.name}, by {depth:.3g} (diameter "
            f"{contacts.diameters[i]:.6g}, center {', '.join(f'{x:.6g}' for x in places[i])}). Move it out."
        )
    overlap = overlaps.deepest(places, room, contacts)
    if overlap is None:
        return
    # As many decimals as show the depth with three digits.
    digits = min(17, max(4, 3 - math.floor(math.log10(overlap.depth / overlap.contact))))
    start = "Scene.random(...)" if len(contacts.classes) == 1 else "Scene.mixture(...)"
    raise OverlapError(
        f"spheres {overlap.i} and {overlap.j} overlap by {overlap.depth:.3g} "
        f"(distance {overlap.distance:#.{digits}g}, contact {overlap.contact:#.{digits}g}). "
        f"Start from {start} or a lattice, or lower packing_fraction "
        f"(now {_box.packing_fraction(contacts.diameters, tuple(room.box)):.3f})."
    )
