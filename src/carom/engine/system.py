"""The facts of a scene that the engine needs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from carom.densities import unit_ball_volume
from carom.models import model_checks
from carom.models.interfaces.contact import Impact
from carom.models.interfaces.interaction import Interaction
from carom.models.interfaces.motion import Motion
from carom.models.interfaces.particles import Particles
from carom.models.motions.shear import LISTED_STRAIN, Shear
from carom.units import TimeUnit


class Components(Protocol):
    """What the engine reads of a scene as it stands there."""

    box: tuple[float, ...]  # edges [length]
    periodic: tuple[bool, ...]  # the other axes have walls
    masses: np.ndarray  # (n,)
    species: np.ndarray | None  # (n,) int64, 0 to K - 1
    contact: np.ndarray | None  # (K, K) [length], where not the sums of the radii
    spins: np.ndarray | None  # (n, 1) or (n, 3) at the start, of rough particles [1 / time]
    pinned: np.ndarray | None  # (n,) bool
    drive: Any  # kicks single components (``carom.models.drives``)
    mass: float  # the common one

    @property
    def n(self) -> int:
        """Number of components."""


@dataclass(frozen=True)
class System:
    """A scene as a run has it: what is in force now, in the engine's unit of time, and what was chosen."""

    scene: Components
    unit: TimeUnit  # of time (:mod:`carom.units`)
    interaction: Interaction
    motion: Motion
    impact: Impact
    diameter: float  # the largest distance of contact now [length]
    walls: Any = None
    radii: np.ndarray | None = None  # (n,), where they or the masses differ, or grow
    rates: np.ndarray | None = None  # (n,), radius gained a time
    obstacles: tuple = ()  # kernel models, and values of those that are live
    still: tuple[bool, ...] = ()  # axes along which momentum is conserved; none if empty
    driven_speed: float = 0.0  # given by motion, or by what moves, to components that rest
    images: bool = True  # count the boxes that each component crosses
    single: bool = False  # positions, velocities and times in single precision
    currents: bool = False  # add up currents of momentum and heat
    flights: bool = False  # histograms of free flights and normal speeds
    observers: tuple = ()  # the user's own; the run adds up in their arrays

    @property
    def obstacle_models(self) -> tuple:
        """What the engine compiles of the obstacles: their models, or what those that are live make."""
        particles = self.particles
        return tuple(each.live(particles) if hasattr(each, "live") else each for each in self.obstacles)

    @property
    def n(self) -> int:
        """Number of components."""
        return self.scene.n

    @property
    def box(self) -> tuple[float, ...]:
        """Edges [length]."""
        return self.scene.box

    @property
    def periodic(self) -> tuple[bool, ...]:
        """Which axes have no walls."""
        return self.scene.periodic

    @property
    def dimension(self) -> int:
        """Number of dimensions."""
        return len(self.box)

    @property
    def elastic(self) -> bool:
        """Whether no contact loses energy."""
        return bool(getattr(self.impact, "elastic", False))

    @property
    def conserves_energy(self) -> bool:
        """Whether contacts keep the energy, which may go to the rotation and come back."""
        return self.elastic or bool(getattr(self.impact, "conserves_energy", False))

    @property
    def straight(self) -> bool:
        """Whether components move along straight lines, uniformly, between two events."""
        return bool(getattr(self.motion, "straight", True))

    @property
    def stretch(self) -> tuple[float, ...]:
        """How much longer a vector may be along each axis of a lattice that tilts than it is."""
        return self.motion.stretch(self.box) if isinstance(self.motion, Shear) else (1.0,) * self.dimension

    @property
    def listed_stretch(self) -> tuple[float, ...]:
        """The same for as long as lists of neighbors hold."""
        if not isinstance(self.motion, Shear):
            return (1.0,) * self.dimension
        return self.motion.stretch(self.box, LISTED_STRAIN)

    @property
    def drift_apart(self) -> float:
        """By what factor the stream may move two components apart for as long as lists hold, at most."""
        return 1.0 + LISTED_STRAIN if isinstance(self.motion, Shear) else 1.0

    @property
    def listable(self) -> bool:
        """Whether components fly straight relative to reference points of lists, which a stream may carry."""
        return self.straight or isinstance(self.motion, Shear)

    @property
    def bounded(self) -> bool:
        """Whether the acceleration of components between two events has a bound, which lists can use."""
        return model_checks.answers("bend", self.motion.model(self.particles))

    @property
    def stepped(self) -> bool:
        """Whether pairs have steps (:mod:`carom.engine.pair_steps`)."""
        return hasattr(self.interaction, "steps")

    @property
    def plunge(self) -> float:
        """Speed that a pair of the lightest gains in its deepest well [length / time]; 0 without one."""
        if not self.stepped:
            return 0.0
        deepest = float(self.pair.energy.min())
        return math.sqrt(4.0 * max(-deepest, 0.0) / float(self.particles.masses.min()))

    @property
    def curved(self) -> bool:
        """Whether two components do not even fly straight relative to each other."""
        return bool(getattr(self.motion, "curved", False))

    @property
    def threshold(self) -> float:
        """Normal speed below which contacts are elastic; 0 where there is no such."""
        return float(self.unit.to_kernel(getattr(self.impact, "elastic_below", None) or 0.0, -1))

    @cached_property
    def particles(self) -> Particles:
        """The components, for values that make models."""
        scene, equal = self.scene, self.radii is None
        radii = np.broadcast_to(0.5 * self.diameter, scene.n) if self.radii is None else self.radii
        masses = np.broadcast_to(scene.mass, scene.n) if equal else scene.masses
        return Particles(scene.box, radii, masses, scene.species, self.rates, equal, self.unit)

    @cached_property
    def pair(self) -> Any:
        """The model of the interaction, to be asked: a run makes its own, which may remember something."""
        return self.interaction.model(self.particles)

    @property
    def by_radii(self) -> bool:
        """Whether pairs act up to ``contact`` or the sum of radii only; otherwise all up to ``diameter``."""
        return bool(getattr(self.interaction, "by_radii", False))

    @property
    def packing_fraction(self) -> float:
        """Part of the box that is filled."""
        powers = self.n * self.diameter**self.dimension
        if self.radii is not None:
            powers = float(np.sum((2.0 * self.radii) ** self.dimension))
        return powers * unit_ball_volume(self.dimension) / 2.0**self.dimension / math.prod(self.box)

    @property
    def reaches(self) -> np.ndarray | None:
        """Radii whose sums are no smaller than any distance of contact, (n,), or None where all are equal."""
        if not self.by_radii:
            return None
        species, contact = self.scene.species, self.scene.contact
        if self.radii is None or contact is None or species is None:
            return self.radii
        core = np.zeros(len(contact))
        core[species] = self.radii
        # An empty species has no radius, and nobody touches it.
        occur = np.ix_(*[np.unique(species)] * 2)
        sums = core[:, None] + core[None, :]
        return self.radii * max(1.0, float((contact[occur] / sums[occur]).max()))

    @property
    def paces(self) -> np.ndarray:
        """Square roots of thermal speeds over their mean, (n,): the ratios of the margins.

        Margins are used up at a rate ``v / margin``: of all with the same sum, these need the fewest
        renewals.
        """
        masses = self.scene.masses
        if self.radii is None:
            return np.ones(len(masses))
        paces = (masses / masses.mean()) ** -0.25
        return np.clip(paces / paces.mean(), 1.0 / 8.0, 8.0)

    @property
    def narrowest(self) -> float:
        """The shortest edge along which images are met [length]; infinite if there is none."""
        edges = [edge for edge, wraps in zip(self.box, self.periodic, strict=True) if wraps]
        return min(edges, default=math.inf)

    @property
    def smallest(self) -> float:
        """The smallest diameter [length]."""
        return self.diameter if self.radii is None else 2.0 * float(self.radii.min())

    @property
    def smallest_contact(self) -> float:
        """The smallest distance of contact [length]: that of two of the smallest, or one of ``contact``."""
        species, contact = self.scene.species, self.scene.contact
        if contact is None or species is None:
            return self.smallest
        occur = np.unique(species)
        return min(self.smallest, float(contact[np.ix_(occur, occur)].min()))
