"""Collisions of every pair of species."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.interface import Observer
from carom.models.questions.memory import kept


class BySpecies(Observer):
    """How many collisions every pair of species had."""

    kinds: np.ndarray  # species, (n + 1,) int64: the array of the cores, where they have one
    collisions: Annotated[np.ndarray, kept()]  # (K, K) int64, in the rows of the smaller index

    def count_pair(self, i, j, virial):
        a = min(self.kinds[i], self.kinds[j])
        b = max(self.kinds[i], self.kinds[j])
        self.collisions[a, b] += 1


def make_by_species(kinds: np.ndarray) -> BySpecies:
    """Return counts of zero for components of the species ``kinds``, (n + 1,)."""
    count = int(kinds.max()) + 1
    return BySpecies(kinds, np.zeros((count, count), np.int64))
