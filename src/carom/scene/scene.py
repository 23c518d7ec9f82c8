"""The scene: components, box, walls and obstacles, which are checked only once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Never, NoReturn, Self

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import geometry_of
from carom.models import model_checks
from carom.models.contacts.restitution import Restitution, as_impact
from carom.models.interactions.hard_cores import HardCores
from carom.models.interactions.pinned import Pinned, mask as pinned_mask
from carom.models.interfaces.contact import Impact
from carom.models.interfaces.interaction import Interaction
from carom.models.interfaces.motion import Motion
from carom.models.motions.free_flight import FreeFlight
from carom.models.motions.shear import start_tilt
from carom.models.obstacles import Obstacle, faces, named_walls
from carom.scene import box as _box, checking, conversion, description, species as _species, starts
from carom.scene.fields import Fields, Maker, first_steps, is_usual
from carom.scene.keywords import refuse_unknown

if TYPE_CHECKING:
    from os import PathLike

    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive
    from carom.models.obstacles.named_walls import Walls


ARGUMENTS = (
    "positions",
    "box",
    "diameter",
    "mass",
    "velocities",
    "spins",
    "species",
    "contact",
    "walls",
    "obstacles",
    "species_names",
    "pinned",
    "interaction",
    "motion",
    "impact",
    "drive",
)
"""What :class:`Scene` takes."""


class Scene(Fields):
    """Hard spheres of 1 to 12 dimensions in a box, with walls and obstacles.

    All input is checked here.

    Parameters
    ----------
    positions : (n, d) array_like
        Centers [length]; along periodic axes they are wrapped into ``0 <= x < edge``. Kept read-only.
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
        Species of each particle, counted from 0.
    contact : (K, K) array_like, optional
        Distances at which particles of two species touch [length]: symmetric, with the species' diameters on
        the diagonal. By default contacts are additive: the mean of the two diameters.
    walls : str, True, sequence of str, or mapping of str to Wall
        Axes with walls: "y", "xy", True for all, or a list of names; from the fourth axis on they are called
        axis3, axis4, ... The other axes are periodic. An axis has two walls, at 0 and at the edge, that the
        *surfaces* cannot pass: centers stay in [radius, edge - radius]. Their names are x_low, x_high,
        y_low, ... A mapping says of them by name which properties they have, such as ``{"y_low":
        models.Wall(impact=0.9)}``; of an axis of which one wall is named, the other is plain.
    obstacles : sequence of obstacles
        Planes, balls, containers (``carom.models``), or your own. A plane or a container that gets to a wall
        of the box, at rest or while it moves, stands for that wall.
    species_names : sequence of str, optional
        Names of the species, for files and tables.
    pinned : (n,) array_like of bool, or of indices, optional
        Particles that stay where they are, as if their mass were infinite.
        Their velocities are zero, and two of them may overlap. They do not count for the temperature.
    interaction : value, optional
        How two particles act on each other; by default hard cores with these diameters and ``contact``.
    motion : value, optional
        How particles move between events; by default free flight.
    impact : float or value, optional
        What a contact of two particles loses; by default nothing. A number is the fraction of the normal
        relative velocity that remains, a ``carom.models.Restitution``. The page docs/models explains
        ``interaction``, ``motion`` and ``impact``.
    drive : value, optional
        What kicks single particles at times of its own: a thermostat, noise (``carom.models.drives``).
    **unknown
        Refused, with the right word.

    Raises
    ------
    OverlapError
        If two spheres, or a sphere and an obstacle, overlap by more than rounding explains: 1e-12 of the
        contact distance plus the rounding of coordinates as large as the box
        (``carom.geometry.overlaps.tolerance``). The message names the pair, or the particle and the obstacle.
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
        Diameter [length] and mass of each particle, read-only.
    species : (n,) int64 array or None
    species_names : tuple of str
    contact : (K, K) array or None
    walls : dict of str to Wall
        The walls by name, in their order.
    periodic : tuple of d bools
        Which axes have no walls.
    obstacles : tuple
        The obstacles, without the walls.
    pinned : (n,) bool array or None
    interaction, motion, impact : values
    drive : value or None

    Examples
    --------
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0)
    Scene(n=2, dimension=2, box=(3, 3), diameter=1, mass=1, packing_fraction=0.174533)
    >>> Scene([[0.5, 0.5], [2.0, 0.5]], box=3.0, diameter=[1.0, 0.5], walls="y")
    Scene(n=2, dimension=2, box=(3, 3), diameter=0.5 to 1, mass=1, packing_fraction=0.109083, walls=y)
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
        walls: Walls = False,
        obstacles: Sequence[Obstacle] = (),
        species_names: Sequence[str] = (),
        pinned: ArrayLike | None = None,
        interaction: Interaction | None = None,
        motion: Motion | None = None,
        impact: float | Impact | None = None,
        drive: Drive | None = None,
        **unknown: Never,
    ) -> None:
        refuse_unknown("Scene", unknown, ARGUMENTS)
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
        if isinstance(interaction, Pinned):
            pinned, interaction = interaction.which, None
        fixed = pinned_mask(pinned, n)
        checking.refuse_both("interaction", interaction, "contact", contact is not None)
        checking.refuse_pinned(fixed, interaction, motion, contact)
        matrix = _species.contact_matrix(contact, kinds, diameters)
        edges = _box.edges(box, dimension, float(diameters.max()), float(diameters.min()))
        sides = named_walls.named(walls, dimension)
        room = geometry_of(edges, sides, obstacles, start_tilt(motion, edges) if dimension > 1 else 0.0)
        standing, repeats = room.obstacles, tuple(room.periodic.tolist())
        places = room.wrapped(places)
        checking.refuse_tight(room, diameters)
        faces.refuse_hidden(standing, edges, repeats, 0.5 * float(diameters.min()))
        contacts = Contacts(diameters, kinds, matrix)
        checking.refuse_unlike(contacts)
        checking.refuse_overlap(places, room, contacts, interaction, fixed)
        places.setflags(write=False)
        vars(self).update(
            positions=places,
            box=edges,
            diameter=float(diameters.max()),
            mass=float(masses[0] if np.ptp(masses) == 0 else masses.mean()),
            diameters=diameters,
            masses=masses,
            velocities=None
            if velocities is None
            else checking.checked_velocities(velocities, places.shape, fixed),
            spins=checking.checked_spins(spins, n, dimension, impact, fixed),
            species=kinds,
            species_names=_species.names(species_names, kinds),
            contact=matrix,
            periodic=repeats,
            obstacles=tuple(obstacles),
            _walls=tuple(sides.items()),
            _standing=standing,
            pinned=fixed,
            interaction=model_checks.checked("interaction", interaction)
            or (HardCores(matrix) if fixed is None else Pinned(fixed)),
            motion=model_checks.checked("motion", motion) or FreeFlight(),
            impact=model_checks.checked("impact", as_impact(impact)) or Restitution(),
            drive=model_checks.checked("drive", drive),
        )
        values: tuple[Any, ...] = (self.interaction, self.motion, self.impact, self.drive)
        for value in values:
            if hasattr(value, "check"):
                value.check(self)
        if hasattr(self.interaction, "steps_of"):
            first_steps(self)  # refuses pairs whose energy is infinite

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed; make another: scene.replace({name}=...).")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"A Scene cannot be changed, so {name} stays.")

    def replace(self, **changes: Any) -> Self:
        """Return the same scene with some arguments of :class:`Scene` changed, checked again as a whole.

        Parameters
        ----------
        **changes
            The arguments to change, by name.

        Raises
        ------
        InputError
            If an argument is unknown, and as :class:`Scene` does.

        Examples
        --------
        >>> Scene.crystal(32, 0.3).replace(impact=0.9).impact.restitution
        0.9
        """
        refuse_unknown("A scene", changes, ARGUMENTS)
        arguments: dict[str, Any] = {name: getattr(self, name) for name in ARGUMENTS}
        arguments |= {"diameter": self.diameters, "mass": self.masses}
        arguments |= {kind: None for kind in ("interaction", "motion") if is_usual(self, kind)}
        return type(self)(**{**arguments, **changes})

    def view(
        self,
        path: str | PathLike[str] | None = None,
        *,
        obstacles: Sequence[Obstacle] | None = None,
        title: str | None = None,
    ) -> Any:
        """Return a page that shows the particles in a browser or a notebook: ``carom.view(scene, ...)``.

        Parameters
        ----------
        path : path, optional
            Where to write the page.
        obstacles : sequence of obstacles, optional
            Obstacles to draw; by default those of the scene.
        title : str, optional
            Title of the page.

        Raises
        ------
        InputError
            If the scene has more than three dimensions.
        FileError
            If the file cannot be written.
        """
        from carom.drawing.page import shown

        drawn = self._standing if obstacles is None else obstacles
        return shown([conversion.to_frame(self)], path, obstacles=drawn, title=title)

    def plot(self, path: str | PathLike[str] | None = None) -> Figure:
        """Draw the particles, to scale, in their box.

        Parameters
        ----------
        path : path, optional
            Where to save the picture.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        FileError
            If the picture cannot be saved.
        """
        from carom.drawing.particles import snapshot

        return snapshot(conversion.to_frame(self), obstacles=self._standing, path=path)

    # Constructors: at random, on a lattice, from a frame, ASE or a file, each in another module.
    random = Maker(starts.random)
    crystal = Maker(starts.crystal)
    from_frame = Maker(conversion.from_frame)
    from_ase = Maker(conversion.from_ase)
    from_file = Maker(conversion.from_file)

    def __repr__(self) -> str:
        return f"Scene({', '.join(f'{k}={v}' for k, v in description.facts(self).items())})"

    def _repr_html_(self) -> str:
        return description.table(self)
