"""Collisions of every pair of species."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import kept


class BySpecies(Observer):
    """How many collisions every pair of species had."""

    species: np.ndarray  # (n + 1,) int64: the array of the cores, where they have one
    collisions: Annotated[np.ndarray, kept()]  # (K, K) int64, in the rows of the smaller index

    def count_pair(self, i, j, virial):
        a = min(self.species[i], self.species[j])
        b = max(self.species[i], self.species[j])
        self.collisions[a, b] += 1


def make_by_species(species: np.ndarray) -> BySpecies:
    """Return counts of zero for components of ``species``, (n + 1,)."""
    count = int(species.max()) + 1
    return BySpecies(species, np.zeros((count, count), np.int64))
