"""Hard cores: two components touch at a contact distance, and exchange momentum along the line of centers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.particles import Particles, lanes
from carom.models.mathematics.contact import contact_time_known, elastic, first_contact


@dataclass(frozen=True)
class HardCores:
    """Hard cores that touch at the mean of their diameters, or at a distance for every pair of species.

    Parameters
    ----------
    contact : (K, K) array, optional
        Distances at which two species touch [length], symmetric.
    """

    contact: np.ndarray | None = None

    by_radii = True
    """No two act on each other from further apart than their radii, or ``contact``, say."""

    def reach(self, scene: Any) -> float:
        """Return the largest distance of contact [length], of the species that occur."""
        if self.contact is None or scene.species is None:
            return float(scene.diameter)
        occur = np.unique(scene.species)
        return float(self.contact[np.ix_(occur, occur)].max())

    def model(self, particles: Particles) -> EqualCores | UnequalCores | SpeciesCores:
        """Return the model that the engine compiles: the simplest one that suffices."""
        if self.contact is not None:
            return SpeciesCores(
                particles.with_padding(particles.species, np.int64),
                np.ascontiguousarray(self.contact, np.float64).ravel() ** 2,
                len(self.contact),
                particles.with_padding(particles.radii),
                particles.with_padding(particles.masses),
            )
        if particles.equal:
            size, weight = float(particles.radii[0]), float(particles.masses[0])
            return EqualCores((2.0 * size) ** 2, size, weight)
        return UnequalCores(particles.with_padding(particles.radii), particles.with_padding(particles.masses))


class Cores(PairModel):
    """Hard cores that meet at the distance whose square is ``core_square``."""

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - self.core_square(i, j, now), rv, vv)

    def contact_time(self, i, j, rr, rv, vv, now):
        return contact_time_known(rr - self.core_square(i, j, now), rv, vv)

    def jump(self, i, j, rr, rv, now):
        return elastic(self, i, j, rr, rv)


class EqualCores(Cores):
    """Hard cores of one diameter and one mass."""

    square: float  # diameter squared [length^2]
    core: float  # radius [length]
    weight: float  # mass of each component

    def jump(self, i, j, rr, rv, now):
        # The distance found, not the diameter: the energy is then kept to rounding even where c was not quite
        # zero.
        factor = rv / rr
        return factor, factor, -self.weight * rv

    def core_square(self, i, j, now):
        return self.square

    def radius_of(self, i, now):
        return self.core

    def mass_of(self, i):
        return self.weight


@lanes("radii")
class UnequalCores(Cores):
    """Hard cores that touch at the sum of their radii."""

    radii: np.ndarray  # (n + 1,) float64 [length]
    masses: np.ndarray  # (n + 1,) float64

    def core_square(self, i, j, now):
        contact = self.radii[i] + self.radii[j]
        return contact * contact


@lanes("species")
class SpeciesCores(Cores):
    """Hard cores with a contact distance for every pair of species (non-additive)."""

    species: np.ndarray  # (n + 1,) int64
    squares: np.ndarray  # contact distances squared, (K * K,) float64 [length^2]
    species_count: int  # K
    radii: np.ndarray  # radii at obstacles, (n + 1,) float64 [length]
    masses: np.ndarray  # (n + 1,) float64

    def core_square(self, i, j, now):
        return self.squares[self.species[i] * self.species_count + self.species[j]]
