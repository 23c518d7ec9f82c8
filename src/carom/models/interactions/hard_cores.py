"""Hard cores: two components touch at a contact distance, and exchange momentum along the line of centers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import answering
from carom.models.mathematics.contact import contact_time_known, elastic, first_contact
from carom.models.questions import interaction
from carom.models.questions.interaction import contact_time, core_square, interaction_time, jump
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


def _meeting(pair, i, j, rr, rv, vv, now):
    return first_contact(rr - core_square(pair, i, j, now), rv, vv)


def _known_meeting(pair, i, j, rr, rv, vv, now):
    return contact_time_known(rr - core_square(pair, i, j, now), rv, vv)


def touching(kind: Any) -> Any:
    """Let cores of a type that answers ``core_square`` meet at that distance: a class decorator."""
    interaction_time.register(kind)(_meeting)
    contact_time.register(kind)(_known_meeting)
    return kind


@answering(interaction)
@touching
class EqualCores(NamedTuple):
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

    def radius(self, i, now):
        return self.core

    def mass(self, i):
        return self.weight


@answering(interaction)
@touching
@lanes("radii")
class UnequalCores(NamedTuple):
    """Hard cores that touch at the sum of their radii."""

    radii: np.ndarray  # (n + 1,) float64 [length]
    masses: np.ndarray  # (n + 1,) float64

    def core_square(self, i, j, now):
        contact = self.radii[i] + self.radii[j]
        return contact * contact


@answering(interaction)
@touching
@lanes("kinds")
class SpeciesCores(NamedTuple):
    """Hard cores with a contact distance for every pair of species (non-additive)."""

    kinds: np.ndarray  # species, (n + 1,) int64
    squares: np.ndarray  # contact distances squared, (K * K,) float64 [length^2]
    species: int  # K
    radii: np.ndarray  # radii at obstacles, (n + 1,) float64 [length]
    masses: np.ndarray  # (n + 1,) float64

    def core_square(self, i, j, now):
        return self.squares[self.kinds[i] * self.species + self.kinds[j]]


@jump.register
def _(pair: UnequalCores | SpeciesCores, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)
