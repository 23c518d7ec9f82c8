"""What the kernel has to know of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Contents:
    """What the kernel has to know of a scene, in its own unit of time (:mod:`carom.units`).

    Attributes
    ----------
    n : int
        Components.
    box : tuple of d floats
        Edges [length].
    periodic : tuple of d bools
        Which axes are periodic; the others have walls.
    diameter : float
        The largest distance of contact between two components, now [length].
    mass : float
        The common mass, where there is one.
    radii, masses : (n,) float64 arrays, optional
        Of each component, where they differ or grow.
    kinds : (n,) int64 array, optional
        Species of each component, 0 to K - 1.
    contact : (K, K) float64 array, optional
        Distances of contact between species, where they are not the sums of the radii.
    rates : (n,) float64 array, optional
        Radius gained a time.
    obstacles : tuple of NamedTuples
        Kernel models of the obstacles.
    restitution, threshold : float
        Normal speed after over before a contact, and the speed below which a contact is elastic.
    images : bool
        Whether to count the boxes that each component crosses.
    single : bool
        Whether positions, velocities and times are kept in single precision.
    """

    n: int
    box: tuple[float, ...]
    periodic: tuple[bool, ...]
    diameter: float
    mass: float
    radii: np.ndarray | None = None
    masses: np.ndarray | None = None
    kinds: np.ndarray | None = None
    contact: np.ndarray | None = None
    rates: np.ndarray | None = None
    obstacles: tuple = field(default=())
    restitution: float = 1.0
    threshold: float = 0.0
    images: bool = True
    single: bool = False

    @property
    def dimension(self) -> int:
        """Number of dimensions."""
        return len(self.box)

    @property
    def packing_fraction(self) -> float:
        """Part of the box that is filled."""
        powers = self.n * self.diameter**self.dimension
        if self.radii is not None:
            powers = float(np.sum((2.0 * self.radii) ** self.dimension))
        return powers * ball_volume(self.dimension) / 2.0**self.dimension / math.prod(self.box)

    @property
    def reaches(self) -> np.ndarray | None:
        """Radii whose sums are no smaller than any distance of contact, (n,), or None where all are equal."""
        if self.radii is None or self.contact is None or self.kinds is None:
            return self.radii
        core = np.zeros(len(self.contact))
        core[self.kinds] = self.radii
        # An empty species has no radius, and nobody touches it.
        occur = np.ix_(*[np.unique(self.kinds)] * 2)
        sums = core[:, None] + core[None, :]
        return self.radii * max(1.0, float((self.contact[occur] / sums[occur]).max()))

    @property
    def paces(self) -> np.ndarray:
        """Square roots of thermal speeds in units of their mean, (n,): how margins are shared out.

        A light component uses up its margin sooner, in proportion to ``v / margin``; of all margins that add
        up to the same, these are used up most seldom.
        """
        if self.masses is None:
            return np.ones(self.n)
        paces = (self.masses / self.masses.mean()) ** -0.25
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


def ball_volume(dimension: int) -> float:
    """Return the volume of a ball of radius one."""
    return math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1)
