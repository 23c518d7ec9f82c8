"""The fields of a scene, and properties that follow from them; modules that Scene imports use only these."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, cast

import numpy as np

from carom.models import model_checks
from carom.models.drives import Drive
from carom.models.interactions.pinned import Pinned
from carom.models.obstacles import Obstacle
from carom.models.questions.contact import Impact
from carom.models.questions.interaction import Interaction
from carom.models.questions.motion import Motion
from carom.scene import box as _box


class Fields:
    """Components, box and obstacles. :class:`carom.Scene` says how they are given and checked."""

    positions: np.ndarray
    box: tuple[float, ...]
    diameter: float
    mass: float
    diameters: np.ndarray
    masses: np.ndarray
    velocities: np.ndarray | None
    spins: np.ndarray | None
    equal: bool
    species: np.ndarray | None
    species_names: tuple[str, ...]
    contact: np.ndarray | None
    periodic: tuple[bool, ...]
    obstacles: tuple[Obstacle, ...]
    restitution: float
    elastic_below: float | None
    pinned: np.ndarray | None
    interaction: Interaction
    motion: Motion
    impact: Impact
    drive: Drive | None

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
        """Number of components per volume [length^-d]."""
        return self.n / self.volume

    @property
    def packing_fraction(self) -> float:
        """Volume of the spheres over that of the box, eta; obstacles do not reduce the volume of the box."""
        part = getattr(self.motion, "packing_fraction", _box.packing_fraction)
        return float(part(self.diameters, self.box))

    @property
    def walls(self) -> bool:
        """Whether any axis has walls instead of being periodic."""
        return not all(self.periodic)

    @property
    def simple(self) -> bool:
        """Whether all are equal and elastic, in a periodic box without obstacles or a drive."""
        usual = all(self.usual(kind) for kind in model_checks.USUAL)
        return (
            usual
            and self.drive is None
            and self.equal
            and not self.walls
            and not self.obstacles
            and self.restitution == 1.0
        )

    def usual(self, kind: str) -> bool:
        """Return whether a ``kind`` of value, such as "interaction", follows from the other keywords."""
        value = getattr(self, kind)
        return type(value) is model_checks.USUAL[kind] or isinstance(value, Pinned)

    @property
    def species_count(self) -> int:
        """Number of species, K: 1 where none are given."""
        if self.species is None:
            return 1
        contacts = 0 if self.contact is None else len(self.contact)
        return max(int(self.species.max()) + 1, len(self.species_names), contacts)


S = TypeVar("S", bound=Fields)
P = ParamSpec("P")


class Maker(Generic[P]):
    """A class method that is a function of another module: it makes a scene of the class it is called on.

    Parameters
    ----------
    make : callable
        Called with the class and with the arguments of the method.
    """

    def __init__(self, make: Callable[Concatenate[Any, P], Any]):
        self.__func__ = make
        self.__doc__ = make.__doc__

    def __get__(self, scene: S | None, cls: type[S]) -> Callable[P, S]:
        """Return the function with the class as its first argument."""
        return cast("Callable[P, S]", MethodType(self.__func__, cls))
