"""What is simulated: positions, box, diameter and mass, checked once and then never again."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self
from warnings import warn

import numpy as np

from carom import checks, initial, overlaps
from carom.errors import CaromWarning, InputError, OverlapError

if TYPE_CHECKING:
    import ase
    from numpy.typing import ArrayLike

    from carom.frame import Frame

#: An edge of more diameters leaves a coordinate too coarse to tell contact from overlap (see
#: overlaps.rounding).
LONGEST_EDGE = 1e9


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Scene:
    """Equal hard spheres in a periodic box of any dimension: the one place where input is checked.

    Parameters
    ----------
    positions : (n, d) array_like
        Centres [length]; they are wrapped into ``0 <= x < edge`` and kept read-only.
    box : float or d floats
        Edges of the periodic box [length]; one number makes a cube. Each must be *greater* than the diameter:
        with edge = diameter a sphere would always touch its own image.
    diameter : float
        sigma [length].
    mass : float
        m [mass].
    velocities : (n, d) array_like, optional
        Velocities [length / time]; left out, the simulation draws them (Maxwell).

    Raises
    ------
    OverlapError
        If spheres overlap by more than rounding explains, 1e-12 diameters and what coordinates as large as
        the box lose (:func:`carom.overlaps.tolerance`); the message names the pair. Spheres in contact are
        legal.
    InputError
        If anything else cannot be simulated: a wrong type or shape, NaN, no particle, an edge too small.

    Examples
    --------
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0)
    Scene(n=2, dimension=2, box=(3, 3), diameter=1, mass=1, packing_fraction=0.174533)
    """

    positions: np.ndarray
    box: tuple[float, ...]
    diameter: float
    mass: float
    velocities: np.ndarray | None

    def __init__(
        self,
        positions: ArrayLike,
        box: float | Sequence[float] | np.ndarray,
        *,
        diameter: float = 1.0,
        mass: float = 1.0,
        velocities: ArrayLike | None = None,
    ) -> None:
        diameter = checks.positive(diameter, "diameter")
        mass = checks.positive(mass, "mass")
        places = checks.array(positions, "positions", "(n, d)", ndim=2)
        n, dimension = places.shape
        if n == 0 or dimension == 0:
            raise InputError(
                f"A scene needs at least one particle and one dimension, found {n} in {dimension}."
            )
        edges = _edges(box, dimension, diameter)
        places = overlaps.wrapped(places, np.asarray(edges))
        overlap = overlaps.deepest(places / diameter, np.asarray(edges) / diameter)
        if overlap is not None:
            raise OverlapError(_overlap_message(overlap, edges, diameter, n))
        places.setflags(write=False)
        object.__setattr__(self, "positions", places)
        object.__setattr__(self, "box", edges)
        object.__setattr__(self, "diameter", diameter)
        object.__setattr__(self, "mass", mass)
        object.__setattr__(
            self, "velocities", None if velocities is None else _speeds(velocities, places.shape)
        )

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
        """Part of the volume that the spheres fill, eta."""
        return initial.packing_fraction(self.n, self.box, self.diameter)

    @property
    def diameters(self) -> np.ndarray:
        """Diameter of each component, (n,) [length]."""
        return np.full(self.n, self.diameter)

    @property
    def masses(self) -> np.ndarray:
        """Mass of each component, (n,) [mass]."""
        return np.full(self.n, self.mass)

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
        lattice = initial.cubic(_dimension(dimension))
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
        lattice = initial.dn(_dimension(dimension, low=3))
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
        lattice = initial.densest(_dimension(dimension))
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
    ) -> Self:
        """Place spheres on any :class:`carom.initial.Lattice`; arguments as :meth:`cubic`."""
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
        box = _edges(lattice.box(block, edge), lattice.dimension, sigma)
        return cls(lattice.points(block, edge), box, diameter=sigma, mass=mass)

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
        seed: int | np.random.Generator = 0,
    ) -> Self:
        """Place spheres at random, without overlap, up to densities above freezing.

        Parameters
        ----------
        n : int
            Number of spheres.
        dimension : int, optional
            d; that of the box, or 3.
        packing_fraction, density, box : optional
            At most one of the three: the part of a cube's volume filled, the number of spheres in diameter^d,
            or the edges. Without any, packing fraction 0.3 (from d = 4 on half of random close packing).
        diameter, mass : float
            As in :class:`Scene`.
        seed : int or numpy.random.Generator
            Source of randomness.

        Raises
        ------
        InputError
            If the box is too full for it (see :mod:`carom.placement`), or an argument is out of range.

        Notes
        -----
        The exact equilibrium for d = 1; for d >= 2 a start that must still be equilibrated.
        """
        from carom import placement

        n = checks.integer(n, "n", low=1, high=initial.MOST)
        sigma = checks.positive(diameter, "diameter")
        if box is not None:
            if packing_fraction is not None or density is not None:
                raise InputError("Give box or one of packing_fraction and density, found both.")
            axes = _axes(box)
            d = _dimension(dimension if dimension is not None else 3 if axes is None else len(axes))
            edges = _edges(box, d, sigma)
        else:
            d = 3 if dimension is None else _dimension(dimension)
            if packing_fraction is None and density is None:
                packing_fraction = placement.default_fraction(d)
            rho = initial.reduced_density(d, packing_fraction=packing_fraction, density=density)
            edges = _edges((n / rho) ** (1 / d) * sigma, d, sigma)
        positions = placement.random_positions(n, np.asarray(edges) / sigma, checks.generator(seed))
        return cls(positions * sigma, edges, diameter=sigma, mass=mass)

    @classmethod
    def from_frame(cls, frame: Frame) -> Self:
        """Take positions, velocities, box, diameter and mass from a frame; images and time are left behind.

        Raises
        ------
        InputError
            If its diameters or masses differ, and as :class:`Scene` does.

        Warns
        -----
        CaromWarning
            If spheres overlap by no more than single precision explains (a GSD file holds such numbers): they
            are then moved apart by as little.
        """
        diameter = _common(frame.diameters, "diameters", frame.n)
        mass = _common(frame.masses, "masses", frame.n)
        positions = _parted(frame.positions, frame.box, diameter)
        return cls(positions, frame.box, diameter=diameter, mass=mass, velocities=frame.velocities)

    @classmethod
    def from_ase(cls, atoms: ase.Atoms, *, diameter: float | None = None) -> Self:
        """Take positions, cell, masses, momenta and radii from an ``ase.Atoms``.

        Parameters
        ----------
        atoms : ase.Atoms
            In a cell with right angles along the axes. Its periodic axes are the scene's: with ``pbc`` "T T
            F" and all z equal it is a scene of disks, d = 2.
        diameter : float, optional
            Of every sphere, where ``atoms`` has no array ``radius``; 1 by default.

        Raises
        ------
        InputError
            If the cell is skew, no axis is periodic, coordinates differ along one that is not, masses or
            radii are unequal, the diameter is given twice, and as :class:`Scene` does.
        """
        if not all(hasattr(atoms, name) for name in ("positions", "cell", "pbc", "arrays", "get_masses")):
            raise InputError(f"atoms must be an ase.Atoms, found {checks.describe(atoms)}.")
        n = len(atoms)
        cell = checks.array(np.asarray(atoms.cell), "cell", "(3, 3)", ndim=2)
        periodic = np.asarray(atoms.pbc, dtype=bool)
        if not periodic.any():
            raise InputError(
                "atoms has no periodic axis (pbc is False everywhere); Carom needs at least one."
            )
        off_axis = cell - np.diag(np.diag(cell))
        if off_axis[periodic].any() or off_axis[:, periodic].any():
            raise InputError("cell must have right angles along x, y and z, found a skew or rotated one.")
        places = checks.array(atoms.positions, "positions", "(n, 3)", ndim=2)
        for axis in np.nonzero(~periodic)[0]:
            if n and np.ptp(places[:, axis]) > 0:
                raise InputError(
                    f"Coordinates differ along {'xyz'[axis]}, where pbc is False; make the axis periodic or "
                    "all of its coordinates equal (a scene of fewer dimensions)."
                )
        if "radius" in atoms.arrays:
            if diameter is not None:
                raise InputError("atoms has radii and diameter is given too; leave one of them out.")
            diameter = 2 * _common(atoms.arrays["radius"], "radius", n)
        mass = _common(atoms.get_masses(), "masses", n)
        velocities = None
        if "momenta" in atoms.arrays:
            momenta = checks.array(atoms.arrays["momenta"], "momenta", "(n, 3)", ndim=2)
            velocities = momenta[:, periodic] / mass
        return cls(
            places[:, periodic],
            np.diag(cell)[periodic],
            diameter=1.0 if diameter is None else diameter,
            mass=mass,
            velocities=velocities,
        )

    def _facts(self) -> dict[str, str]:
        facts = {
            "n": str(self.n),
            "dimension": str(self.dimension),
            "box": "(" + ", ".join(f"{x:.6g}" for x in self.box) + ("," if self.dimension == 1 else "") + ")",
            "diameter": f"{self.diameter:.6g}",
            "mass": f"{self.mass:.6g}",
            "packing_fraction": f"{self.packing_fraction:.6g}",
        }
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


def _dimension(value: Any, low: int = 1) -> int:
    return checks.integer(value, "dimension", low=low, high=initial.MOST_DIMENSIONS)


def _axes(box: Any) -> list[Any] | None:
    """Return the edges given one an axis as a list, or None if one value stands for all."""
    if isinstance(box, np.ndarray):
        return list(box) if box.ndim else None
    return list(box) if isinstance(box, Sequence) and not isinstance(box, str | bytes) else None


def _edges(box: Any, dimension: int, diameter: float) -> tuple[float, ...]:
    """Return the d edges of a box, each long enough for one sphere and short enough for a double."""
    axes = _axes(box)
    given = [box] * dimension if axes is None else axes
    if len(given) != dimension:
        raise InputError(f"box must be one edge or {dimension} (one an axis), found {len(given)}.")
    edges = tuple(checks.number(edge, "box edge") for edge in given)
    for edge in edges:
        if edge <= 0:
            raise InputError(f"box edge must be positive, found {edge:g}.")
        if edge <= diameter:
            raise InputError(
                f"box edge must be greater than the diameter ({diameter:.6g}), found {edge:.6g}: "
                "a sphere would touch its own image. Enlarge the box."
            )
        if edge > LONGEST_EDGE * diameter:
            raise InputError(
                f"box edge must be at most {LONGEST_EDGE:g} diameters, found {edge / diameter:g}: "
                "coordinates that large cannot tell contact from overlap."
            )
    return edges


def _speeds(velocities: Any, shape: tuple[int, ...]) -> np.ndarray:
    result = checks.array(velocities, "velocities", "(n, d)", ndim=2)
    if result.shape != shape:
        raise InputError(f"velocities must have the shape of positions, {shape}, found {result.shape}.")
    fastest = float(np.abs(result).max())
    if fastest > checks.MAGNITUDE:
        raise InputError(f"velocities must be at most {checks.MAGNITUDE:g}, found {fastest:g}.")
    result.setflags(write=False)
    return result


def _common(values: Any, name: str, n: int) -> float:
    """Return the value that all n components share."""
    each = checks.array(values, name, "(n,)", ndim=1)
    if each.shape != (n,) or n == 0:
        raise InputError(
            f"{name} must hold one value for each of at least one particle, found {len(each)} for {n}."
        )
    if np.ptp(each) > 0:
        raise InputError(f"{name} must all be equal, found {each.min():g} to {each.max():g}.")
    return float(each[0])


def _parted(positions: Any, box: tuple[float, ...], diameter: float) -> Any:
    """Move apart spheres that overlap by single precision only; any other input is returned as it is."""
    places = checks.array(positions, "positions", "(n, d)", ndim=2)
    if not places.size:
        return positions
    edges = _edges(box, places.shape[1], checks.positive(diameter, "diameter"))
    reduced = np.asarray(edges) / diameter
    places = overlaps.wrapped(places, np.asarray(edges)) / diameter
    overlap = overlaps.deepest(places, reduced)
    single = overlaps.rounding(reduced, float(np.finfo(np.float32).eps))
    if overlap is None or overlap.depth > single:
        return positions
    from carom import placement

    # A fluid gives way in a few steps; what does not is jammed, and stays an error.
    moved = placement.separated(places, reduced, clearance=1 + 2 * single, patience=200)
    if moved is None:
        return positions
    warn(
        f"Spheres {overlap.i} and {overlap.j} overlap by {overlap.depth:.2g} diameters, as positions of "
        "single precision do; such pairs were moved apart. Start from a float64 file (h5md, extxyz) "
        "to keep every digit.",
        CaromWarning,
        stacklevel=3,
    )
    return moved * diameter


def _overlap_message(overlap: overlaps.Overlap, box: tuple[float, ...], diameter: float, n: int) -> str:
    depth = overlap.depth * diameter
    # As many decimals as show the depth with three digits.
    digits = min(17, max(4, 3 - math.floor(math.log10(overlap.depth))))
    return (
        f"spheres {overlap.i} and {overlap.j} overlap by {depth:.3g} "
        f"(distance {overlap.distance * diameter:#.{digits}g}, contact {diameter:#.{digits}g}). "
        "Start from Scene.random(...) or a lattice, or lower packing_fraction "
        f"(now {initial.packing_fraction(n, box, diameter):.3f})."
    )
