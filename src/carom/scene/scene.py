"""The scene: components, box, walls and obstacles, which are checked only once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn, Self

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import model_checks
from carom.models import obstacles as _obstacles
from carom.models.contacts.restitution import Restitution
from carom.models.files import parameters, tables, to_tables
from carom.models.interactions.hard_cores import HardCores
from carom.models.interactions.pinned import Pinned
from carom.models.interactions.pinned import mask as pinned_mask
from carom.models.motions.free_flight import FreeFlight
from carom.models.motions.shear import Shear
from carom.models.obstacles import Obstacle, faces
from carom.models.questions.contact import Impact
from carom.models.questions.interaction import Interaction
from carom.models.questions.motion import Motion
from carom.scene import box as _box
from carom.scene import checking, conversion, description, starts
from carom.scene import species as _species
from carom.scene.fields import Fields, Maker
from carom.scene.first_steps import first_steps
from carom.scene.overlaps import Room
from carom.scene.species import Contacts

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive


class Scene(Fields):
    """Hard spheres of 1 to 12 dimensions in a box, with walls and obstacles.

    All input is checked here.

    Parameters
    ----------
    positions : (n, d) array_like
        Centres [length]; along periodic axes they are wrapped into ``0 <= x < edge``. Kept read-only.
    box : float or d floats
        Edges of the box [length]; one number makes a cube. Each must be *greater* than the largest diameter:
        with edge = diameter a sphere would always touch its own image, or both walls.
    diameter : float or (n,) array_like
        Diameter sigma, one for all or one for each [length].
    mass : float or (n,) array_like
        Mass m, one for all or one for each [mass].
    velocities : (n, d) array_like, optional
        Velocities [length / time]; by default the simulation draws them (Maxwell).
    spins : (n,) or (n, 3) array_like, optional
        Angular velocities of rough particles, a number each in the plane, a vector in space; by default they
        do not spin [1 / time]. Only with ``impact=carom.models.Rough(...)``.
    species : (n,) array_like of int, optional
        Species of each component, counted from 0.
    contact : (K, K) array_like, optional
        Distances at which components of two species touch [length]: symmetric, with the species' diameters on
        the diagonal. By default contacts are additive: the mean of the two diameters.
    periodic : bool or d bools
        False gives an axis two hard walls, at 0 and at the edge, that the *surfaces* cannot pass: centres
        stay in [radius, edge - radius].
    obstacles : sequence of obstacles
        Planes, balls, containers (``carom.models.obstacles``), or your own. A plane or a container that
        gets to a wall of the box, at rest or while it moves, stands for that wall.
    restitution : float
        Fraction of the normal relative velocity that remains after a collision, in (0, 1]; 1 is elastic.
    elastic_below : float, optional
        Normal relative speed below which a collision is elastic [length / time]. It keeps inelastic spheres
        from colliding infinitely often in a finite time, so it must be positive where restitution < 1. The
        default is 1e-3 of the thermal speed sqrt(kT / m), see ``carom.models.Restitution``.
    species_names : sequence of str, optional
        Names of the species, for files and tables.
    pinned : (n,) array_like of bool, or of indices, optional
        Components that stay where they are, as if their mass were infinite.
        Their velocities are zero, and two of them may overlap. They do not count for the temperature.
    interaction : value, optional
        How two components act on each other; by default hard cores with these diameters and ``contact``.
    motion : value, optional
        How components move between events; by default free flight.
    impact : value, optional
        What a contact of two components loses; by default it follows from ``restitution``. The page
        docs/models explains ``interaction``, ``motion`` and ``impact``.
    drive : value, optional
        What kicks single components at times of its own: a thermostat, noise (``carom.models.drives``).

    Raises
    ------
    OverlapError
        If two spheres, or a sphere and an obstacle, overlap by more than rounding explains: 1e-12 of the
        contact distance plus the rounding of coordinates as large as the box
        (``carom.scene.overlaps.tolerance``). The message names the pair, or the component and the obstacle.
        Contact is allowed.
    InputError
        If anything else cannot be simulated: a wrong type or shape, NaN, no particle, more than 12
        dimensions, an edge too small.

    Attributes
    ----------
    diameter : float
        The common diameter; the largest where they differ.
    mass : float
        The common mass; the mean where they differ.
    diameters, masses : (n,) arrays
        Diameter [length] and mass of each component, read-only.
    equal : bool
        Whether all components have one diameter and one mass, without a contact matrix.
    species : (n,) int64 array or None
    species_names : tuple of str
    contact : (K, K) array or None
    periodic : tuple of d bools
    obstacles : tuple
        The obstacles, without the walls of the axes.
    restitution : float
    pinned : (n,) bool array or None
    elastic_below : float or None
        None if the simulation chooses it; 0 if collisions are elastic.
    interaction, motion, impact : values
    drive : value or None

    Examples
    --------
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0)
    Scene(n=2, dimension=2, box=(3, 3), diameter=1, mass=1, packing_fraction=0.174533)
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0, diameter=[1.0, 0.5], periodic=[True, False])
    Scene(n=2, dimension=2, box=(3, 3), diameter=0.5 to 1, mass=1, packing_fraction=0.109083, walls=axis 1)
    """

    def __init__(
        self,
        positions: ArrayLike,
        box: float | Sequence[float] | np.ndarray,
        *,
        diameter: float | ArrayLike = 1.0,
        mass: float | ArrayLike = 1.0,
        velocities: ArrayLike | None = None,
        spins: ArrayLike | None = None,
        species: ArrayLike | None = None,
        contact: ArrayLike | None = None,
        periodic: bool | Sequence[bool] | np.ndarray = True,
        obstacles: Sequence[Obstacle] = (),
        restitution: float = 1.0,
        elastic_below: float | None = None,
        species_names: Sequence[str] = (),
        pinned: ArrayLike | None = None,
        interaction: Interaction | None = None,
        motion: Motion | None = None,
        impact: Impact | None = None,
        drive: Drive | None = None,
    ) -> None:
        places = checks.array(positions, "positions", "(n, d)", ndim=2)
        n, dimension = places.shape
        if n == 0 or dimension == 0:
            raise InputError(
                f"A scene needs at least one particle and one dimension, found {n} in {dimension}."
            )
        _box.dimensions(dimension)
        diameters = _species.per_component(diameter, "diameter", n)
        masses = _species.per_component(mass, "mass", n)
        kinds = _species.labels(species, n)
        if isinstance(interaction, HardCores):  # the same as the keyword
            contact, interaction = interaction.contact, None
        if type(impact) is Restitution:
            restitution, elastic_below, impact = impact.restitution, impact.elastic_below, None
        if isinstance(interaction, Pinned):
            pinned, interaction = interaction.which, None
        elasticity = Restitution(restitution, elastic_below)
        fixed = pinned_mask(pinned, n)
        checking.refuse_both("interaction", interaction, "contact", contact is not None)
        checking.refuse_both("impact", impact, "restitution", elasticity.restitution < 1.0)
        checking.refuse_pinned(fixed, interaction, motion, contact)
        matrix = _species.contact_matrix(contact, kinds, diameters)
        edges = _box.edges(box, dimension, float(diameters.max()), float(diameters.min()))
        repeats = _box.periodicity(periodic, dimension)
        standing = _obstacles.checked(obstacles, edges, repeats)
        tilt = motion.tilt if isinstance(motion, Shear) and dimension > 1 else 0.0
        room = Room(np.asarray(edges), np.asarray(repeats), standing, tilt)
        places = room.wrapped(places)
        checking.refuse_tight(room, diameters)
        faces.refuse_hidden(standing, edges, repeats, 0.5 * float(diameters.min()))
        contacts = Contacts(diameters, kinds, matrix)
        checking.refuse_unlike(contacts)
        checking.refuse_overlap(places, room, contacts, interaction, fixed)
        places.setflags(write=False)
        one_diameter, one_mass = np.ptp(diameters) == 0, np.ptp(masses) == 0
        vars(self).update(
            positions=places,
            box=edges,
            diameter=float(diameters.max()),
            mass=float(masses[0] if one_mass else masses.mean()),
            diameters=diameters,
            masses=masses,
            velocities=None if velocities is None else checking.speeds(velocities, places.shape, fixed),
            spins=None if spins is None else checking.checked_spins(spins, n, dimension, impact, fixed),
            equal=bool(one_diameter and one_mass and matrix is None and fixed is None),
            species=kinds,
            species_names=_species.names(species_names, kinds),
            contact=matrix,
            periodic=repeats,
            obstacles=standing,
            restitution=elasticity.restitution,
            elastic_below=elasticity.elastic_below,
            pinned=fixed,
            interaction=model_checks.checked("interaction", interaction)
            or (HardCores(matrix) if fixed is None else Pinned(fixed)),
            motion=model_checks.checked("motion", motion) or FreeFlight(),
            impact=model_checks.checked("impact", impact) or elasticity,
            drive=model_checks.checked("drive", drive),
        )
        values: tuple[Any, ...] = (self.interaction, self.motion, self.impact, self.drive)
        for value in values:
            if hasattr(value, "check"):
                value.check(self)
        if hasattr(self.interaction, "steps_of"):
            first_steps(self)  # refuses pairs whose energy is infinite

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed; make another: scene.with_({name}=...).")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed, so {name} stays.")

    def with_(self, **changes: Any) -> Self:
        """Return the same scene with some arguments of :class:`Scene` changed, checked again as a whole.

        Parameters
        ----------
        **changes
            The arguments to change, by name. A new ``restitution`` resets ``elastic_below`` to its default.

        Raises
        ------
        InputError
            If an argument is unknown, and as :class:`Scene` does.

        Examples
        --------
        >>> Scene.crystal(32, 0.3).with_(restitution=0.9).restitution
        0.9
        """
        arguments: dict[str, Any] = {
            "positions": self.positions,
            "box": self.box,
            "diameter": self.diameters,
            "mass": self.masses,
            "velocities": self.velocities,
            "spins": self.spins,
            "species": self.species,
            "contact": self.contact,
            "periodic": self.periodic,
            "obstacles": self.obstacles,
            "restitution": self.restitution,
            "elastic_below": self.elastic_below,
            "species_names": self.species_names,
            "pinned": self.pinned,
            "drive": self.drive,
            **{kind: None if self.usual(kind) else getattr(self, kind) for kind in model_checks.USUAL},
        }
        for name in changes:
            if name not in arguments:
                raise InputError(f"A scene has no {name}; known are {', '.join(arguments)}.")
        if "restitution" in changes and "elastic_below" not in changes:
            arguments["elastic_below"] = None
        return type(self)(**{**arguments, **changes})

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Return the scene as arrays and as values that JSON holds, by name, for :meth:`from_arrays`."""
        arrays = {"positions": self.positions}
        attributes: dict[str, Any] = {
            "box": list(self.box),
            "periodic": list(self.periodic),
            "obstacles": [to_tables.obstacle_to_table(o) for o in self.obstacles],
            "restitution": self.restitution,
            "elastic_below": self.elastic_below,
            "species_names": list(self.species_names),
        }
        for kind in model_checks.USUAL:
            if not self.usual(kind):  # files hold no code
                value = getattr(self, kind)
                attributes[kind] = value.to_table() if to_tables.holds(value) else parameters.kept(value)
        if self.drive is not None:
            holds = to_tables.holds(self.drive)
            attributes["drive"] = (
                to_tables.to_table(self.drive, "drive") if holds else parameters.kept(self.drive)
            )
        for name, values in (("diameter", self.diameters), ("mass", self.masses)):
            if np.ptp(values) == 0:
                attributes[name] = float(values[0])
            else:
                arrays[name] = values
        for name in ("velocities", "spins", "species", "contact"):
            if getattr(self, name) is not None:
                arrays[name] = getattr(self, name)
        if self.pinned is not None:
            arrays["pinned"] = np.flatnonzero(self.pinned)
        return arrays, attributes

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, np.ndarray],
        attributes: Mapping[str, Any],
        *,
        obstacles: Sequence[Obstacle] | None = None,
        interaction: Interaction | None = None,
        motion: Motion | None = None,
        impact: Impact | None = None,
        drive: Drive | None = None,
    ) -> Self:
        """Return the scene that :meth:`to_arrays` took apart, bit for bit.

        Parameters
        ----------
        arrays, attributes : mappings
            What :meth:`to_arrays` returned; other arrays are ignored.
        obstacles : sequence of obstacles, optional
            All obstacles, in order; needed if one is of your own class, because a file holds no code.
        interaction, motion, impact, drive : values, optional
            Needed if one is of your own class.

        Raises
        ------
        InputError
            If something is missing or damaged, an obstacle of your own class is not given, or two thermal
            surfaces have one seed, as in files of older versions.
        """
        try:
            kept = attributes["obstacles"]
            tables.refuse_one_seed(kept)
            if obstacles is None:
                obstacles = tuple(tables.obstacle_from_table(each) for each in kept)
            elif len(obstacles) != len(kept):
                raise InputError(f"The scene has {len(kept)} obstacles, found {len(obstacles)}.")
            return cls(
                arrays["positions"],
                tuple(attributes["box"]),
                diameter=arrays["diameter"] if "diameter" in arrays else attributes["diameter"],
                mass=arrays["mass"] if "mass" in arrays else attributes["mass"],
                velocities=arrays.get("velocities"),
                spins=arrays.get("spins"),
                species=arrays.get("species"),
                contact=arrays.get("contact"),
                periodic=tuple(attributes["periodic"]),
                obstacles=obstacles,
                restitution=attributes["restitution"],
                elastic_below=attributes["elastic_below"] if attributes["restitution"] < 1 else None,
                species_names=tuple(attributes["species_names"]),
                pinned=arrays.get("pinned"),
                interaction=model_checks.recalled("interaction", attributes.get("interaction"), interaction),
                motion=model_checks.recalled("motion", attributes.get("motion"), motion),
                impact=model_checks.recalled("impact", attributes.get("impact"), impact),
                drive=model_checks.recalled("drive", attributes.get("drive"), drive),
            )
        except (KeyError, TypeError) as problem:
            raise InputError(f"These arrays and attributes are no scene: {problem}.") from None

    # Constructors: at random, on a lattice, from a frame or from ASE. Each is a function of another module.
    random = Maker(starts.random)
    crystal = Maker(starts.crystal)
    from_frame = Maker(conversion.from_frame)
    from_ase = Maker(conversion.from_ase)

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v}' for k, v in description.facts(self).items())})"

    def _repr_html_(self) -> str:
        return description.table(self)
