"""Hard cores: two components touch at a contact distance, and exchange momentum along the line of centres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from carom.models.mathematics.contact import contact_time_known, elastic, first_contact
from carom.models.questions.interaction import contact_time, core_square, interaction_time, jump, mass, radius
from carom.models.questions.particles import Particles, lanes


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
                particles.with_ghost(particles.species, np.int64),
                np.ascontiguousarray(self.contact, np.float64).ravel() ** 2,
                len(self.contact),
                particles.with_ghost(particles.radii),
                particles.with_ghost(particles.masses),
            )
        if particles.equal:
            size, weight = float(particles.radii[0]), float(particles.masses[0])
            return EqualCores((2.0 * size) ** 2, size, weight)
        return UnequalCores(particles.with_ghost(particles.radii), particles.with_ghost(particles.masses))


class EqualCores(NamedTuple):
    """Hard cores of one diameter and one mass."""

    square: float
    """Diameter squared [length^2]."""
    core: float
    """Radius [length]."""
    weight: float
    """Mass of each component."""


@interaction_time.register
def _(pair: EqualCores, i, j, rr, rv, vv, now):
    return first_contact(rr - pair.square, rv, vv)


@contact_time.register
def _(pair: EqualCores, i, j, rr, rv, vv, now):
    return contact_time_known(rr - pair.square, rv, vv)


@jump.register
def _(pair: EqualCores, i, j, rr, rv, now):
    # The distance found, not the diameter: the energy is then kept to rounding even where c was not quite
    # zero.
    factor = rv / rr
    return factor, factor, -pair.weight * rv


@core_square.register
def _(pair: EqualCores, i, j, now):
    return pair.square


@radius.register
def _(pair: EqualCores, i, now):
    return pair.core


@mass.register
def _(pair: EqualCores, i):
    return pair.weight


@lanes("radii")
class UnequalCores(NamedTuple):
    """Hard cores that touch at the sum of their radii."""

    radii: np.ndarray
    """(n + 1,) float64 [length]."""
    masses: np.ndarray
    """(n + 1,) float64."""


@interaction_time.register
def _(pair: UnequalCores, i, j, rr, rv, vv, now):
    contact = pair.radii[i] + pair.radii[j]
    return first_contact(rr - contact * contact, rv, vv)


@contact_time.register
def _(pair: UnequalCores, i, j, rr, rv, vv, now):
    return contact_time_known(rr - core_square(pair, i, j, now), rv, vv)


@jump.register
def _(pair: UnequalCores, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


@core_square.register
def _(pair: UnequalCores, i, j, now):
    contact = pair.radii[i] + pair.radii[j]
    return contact * contact


@lanes("kinds")
class SpeciesCores(NamedTuple):
    """Hard cores with a contact distance for every pair of species (non-additive)."""

    kinds: np.ndarray
    """Species, (n + 1,) int64."""
    squares: np.ndarray
    """Contact distances squared, (K * K,) float64 [length^2]."""
    species: int
    """K."""
    radii: np.ndarray
    """Radii at obstacles, (n + 1,) float64 [length]."""
    masses: np.ndarray
    """(n + 1,) float64."""


@interaction_time.register
def _(pair: SpeciesCores, i, j, rr, rv, vv, now):
    return first_contact(rr - pair.squares[pair.kinds[i] * pair.species + pair.kinds[j]], rv, vv)


@contact_time.register
def _(pair: SpeciesCores, i, j, rr, rv, vv, now):
    return contact_time_known(rr - core_square(pair, i, j, now), rv, vv)


@jump.register
def _(pair: SpeciesCores, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


@core_square.register
def _(pair: SpeciesCores, i, j, now):
    return pair.squares[pair.kinds[i] * pair.species + pair.kinds[j]]
