"""Collisions and virial of every pair of species."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from carom.compiling.registry import answering
from carom.engine.observers import interface
from carom.models.questions.memory import kept


@answering(interface)
class BySpecies(NamedTuple):
    """What collisions add up to for every pair of species."""

    kinds: np.ndarray  # species, (n + 1,) int64: the array of the cores, where they have one
    collisions: Annotated[np.ndarray, kept()]  # (K, K) int64, in the rows of the smaller index
    virial: Annotated[np.ndarray, kept(-1)]  # (K, K) float64, likewise

    def count_pair(self, i, j, virial):
        a = min(self.kinds[i], self.kinds[j])
        b = max(self.kinds[i], self.kinds[j])
        self.collisions[a, b] += 1
        self.virial[a, b] += virial


def make_by_species(kinds: np.ndarray) -> BySpecies:
    """Return empty sums for components of the species ``kinds``, (n + 1,)."""
    count = int(kinds.max()) + 1
    return BySpecies(kinds, np.zeros((count, count), np.int64), np.zeros((count, count)))
