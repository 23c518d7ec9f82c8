"""The fields of a scene, and properties that follow from them; modules that Scene imports use only these."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MethodType
from typing import Any, ClassVar, Concatenate, Generic, ParamSpec, TypeVar, cast

import numpy as np

from carom.geometry.overlaps import Geometry
from carom.models import model_checks
from carom.models.drives import Drive
from carom.models.interactions.pinned import Pinned
from carom.models.interfaces.contact import Impact
from carom.models.interfaces.interaction import Interaction
from carom.models.interfaces.motion import Motion
from carom.models.motions.shear import start_tilt
from carom.models.obstacles import Obstacle, Wall
from carom.models.obstacles.with_properties import Dressed
from carom.scene import box as _box


class Fields:
    """Particles, box and obstacles. :class:`carom.Scene` says how they are given and checked."""

    positions: np.ndarray
    box: tuple[float, ...]
    diameter: float
    mass: float
    diameters: np.ndarray
    masses: np.ndarray
    velocities: np.ndarray | None
    spins: np.ndarray | None
    species: np.ndarray | None
    species_names: tuple[str, ...]
    contact: np.ndarray | None
    periodic: tuple[bool, ...]
    obstacles: tuple[Obstacle, ...]
    _walls: tuple[tuple[str, Wall], ...]
    _standing: tuple[Obstacle, ...]
    pinned: np.ndarray | None
    interaction: Interaction
    motion: Motion
    impact: Impact
    drive: Drive | None

    _grown: ClassVar[Callable[..., tuple[np.ndarray | None, float]]]
    """Positions after growth to larger diameters, by ``simulation.moves.growth``, which lies above."""

    @property
    def n(self) -> int:
        """Number of particles."""
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
        """Number of particles per volume [length^-d]."""
        return self.n / self.volume

    @property
    def packing_fraction(self) -> float:
        """Volume of the spheres over that of the box, eta; obstacles do not reduce the volume of the box."""
        part = getattr(self.motion, "packing_fraction", _box.packing_fraction)
        return float(part(self.diameters, self.box))

    @property
    def walls(self) -> dict[str, Wall]:
        """The walls of the box by name, in their order; those without properties are plain."""
        return dict(self._walls)


def standing(scene: Fields) -> tuple[Obstacle, ...]:
    """Return walls with properties, then the obstacles, within their surfaces and motions."""
    return scene._standing


def geometry_at_start(scene: Fields) -> Geometry:
    """Return where the components of a scene start, without its obstacles."""
    tilt = start_tilt(scene.motion, scene.box)
    return Geometry(np.asarray(scene.box), np.asarray(scene.periodic), tilt=tilt)


def is_usual(scene: Fields, kind: str) -> bool:
    """Tell whether a ``kind`` of value, such as "interaction", follows from the other keywords."""
    value = getattr(scene, kind)
    return type(value) is model_checks.USUAL[kind] or isinstance(value, Pinned)


def is_elastic(scene: Fields) -> bool:
    """Tell whether no contact of two particles loses energy."""
    return is_usual(scene, "impact") and bool(getattr(scene.impact, "elastic", False))


def is_equal(scene: Fields) -> bool:
    """Tell whether all particles have one diameter and one mass, without a contact matrix or pinned ones."""
    alike = np.ptp(scene.diameters) == 0 and np.ptp(scene.masses) == 0
    return bool(alike and scene.contact is None and scene.pinned is None)


def is_simple(scene: Fields) -> bool:
    """Tell whether all are equal hard cores, elastic, in a periodic box without obstacles or a drive."""
    usual = all(is_usual(scene, kind) for kind in model_checks.USUAL) and is_elastic(scene)
    return usual and scene.drive is None and is_equal(scene) and all(scene.periodic) and not standing(scene)


def own_models(scene: Fields) -> tuple[set[str], list[int]]:
    """Return which kinds of models of a scene, and which obstacles or their paths, are the user's own."""
    kinds = {kind for kind in model_checks.METHODS if model_checks.is_own(getattr(scene, kind))}
    parts = [(each.obstacle, each.path) if isinstance(each, Dressed) else (each,) for each in standing(scene)]
    return kinds, [k for k, each in enumerate(parts) if any(map(model_checks.is_own, each))]


S = TypeVar("S", bound=Fields)
P = ParamSpec("P")


class Maker(Generic[P]):
    """A class method that is a function of another module: it makes a scene of the class it is called on."""

    def __init__(self, make: Callable[Concatenate[Any, P], Any]):
        self.__func__ = make
        self.__doc__ = make.__doc__

    def __get__(self, scene: S | None, cls: type[S]) -> Callable[P, S]:
        """Return the function with the class as its first argument."""
        return cast("Callable[P, S]", MethodType(self.__func__, cls))


def first_steps(scene: Fields) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (m, 2) within reach, and the step of each (m,)."""
    interaction = scene.interaction
    within = float(interaction.reach(scene)) * (1.0 + 2.0**-30)
    room = geometry_at_start(scene)
    found: Any = room.near(room.wrapped(scene.positions), within) if scene.n > 1 else []
    pairs = np.sort(np.asarray(found, np.int64).reshape(-1, 2), axis=1)
    pairs = pairs[room.distances(scene.positions, pairs) < within]
    if hasattr(interaction, "bonded"):  # refused where they are further apart
        pairs = np.unique(np.concatenate([pairs, interaction.bonded()[0]]), axis=0)
    distances = room.distances(scene.positions, pairs)
    steps = interaction.steps_of(pairs, distances, scene.species, scene.diameter)  # type: ignore[attr-defined]
    return pairs, steps
