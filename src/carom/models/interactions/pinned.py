"""Pinned components: hard cores that stay where they are, as if their mass were infinite. Two may overlap.

They model a porous medium, a Lorentz gas of many scatterers, or a glass with some frozen particles. Sectors
and lists find them, so that a thousand cost no more than a thousand moving ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.interactions.hard_cores import Cores
from carom.models.interfaces.memory import kept
from carom.models.interfaces.particles import Particles, lanes
from carom.models.mathematics.contact import shares


def mask(given: Any, n: int) -> np.ndarray | None:
    """Return which of ``n`` are pinned, (n,) bool, read-only, from bools or indices; None if none."""
    if given is None:
        return None
    values = np.asarray(given)
    if values.dtype == bool and values.shape == (n,):
        result = values.copy()
    elif values.dtype.kind in "iu" and values.ndim == 1 and values.size:
        if values.min() < 0 or values.max() >= n:
            wrong = int(values.min() if values.min() < 0 else values.max())
            raise InputError(f"pinned must name components from 0 to {n - 1}, found {wrong}.")
        result = np.zeros(n, bool)
        result[values] = True
    elif values.size == 0:
        return None
    else:
        raise InputError(
            f"pinned must be {n} bools, one a component, or the indices of those that are; found "
            f"{checks.describe(given)}."
        )
    if result.all():
        raise InputError("All components are pinned, and nothing can move: leave one free.")
    result.setflags(write=False)
    return result if result.any() else None


@dataclass(frozen=True, eq=False)
class Pinned:
    """Hard cores, some of which stay where they are: ``which``, (n,) bool."""

    which: np.ndarray

    by_radii = True
    """No two act on each other from further apart than their radii, or ``contact``, say."""

    def reach(self, scene: Any) -> float:
        """Return the largest distance of contact [length]."""
        return float(scene.diameter)

    def model(self, particles: Particles) -> PinnedCores:
        """Return the model that the engine compiles."""
        inverse = np.where(self.which, 0.0, 1.0 / particles.masses)
        return PinnedCores(
            particles.with_padding(particles.radii),
            particles.with_padding(inverse),
            particles.with_padding(particles.masses),
            np.zeros(len(inverse) + 1),
        )


@lanes("radii")
class PinnedCores(Cores):
    """Hard cores of which some have infinite mass."""

    radii: np.ndarray  # (n + 1,) float64 [length]
    inverse: np.ndarray  # one over the mass, 0 where a component is pinned, (n + 1,) float64
    masses: np.ndarray  # (n + 1,) float64
    impulse: Annotated[np.ndarray, kept(-1)]
    """Momentum that each component took up along the normals of its contacts, (n + 1,) float64."""

    def jump(self, i, j, rr, rv, now):
        ours, theirs = self.inverse[i], self.inverse[j]
        a, b = shares(theirs, ours, rr, 2.0 * rv)
        return a, b, -2.0 * rv / (ours + theirs)

    def record_impulse(self, i, j, momentum):
        self.impulse[i] += momentum
        self.impulse[j] += momentum

    def core_square(self, i, j, now):
        contact = self.radii[i] + self.radii[j]
        return contact * contact
