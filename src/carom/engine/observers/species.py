"""Collisions and virial of every pair of species."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import answering
from carom.engine.observers import interface
from carom.models.questions import memory


@answering(interface, memory)
class BySpecies(NamedTuple):
    """What collisions add up to for every pair of species."""

    kinds: np.ndarray
    """Species, (n + 1,) int64: the array of the cores, where they have one."""
    collisions: np.ndarray
    """(K, K) int64, in the rows of the smaller index."""
    virial: np.ndarray
    """(K, K) float64, likewise."""

    def count_pair(self, i, j, virial):
        a = min(self.kinds[i], self.kinds[j])
        b = max(self.kinds[i], self.kinds[j])
        self.collisions[a, b] += 1
        self.virial[a, b] += virial

    def spared(self):
        return ("kinds",)

    def copy_state(self, before, instant, passed, slower):
        self.collisions[:] = before.collisions
        self.virial[:] = np.ldexp(before.virial, slower)


def make_by_species(kinds: np.ndarray) -> BySpecies:
    """Return empty sums for components of the species ``kinds``, (n + 1,)."""
    count = int(kinds.max()) + 1
    return BySpecies(kinds, np.zeros((count, count), np.int64), np.zeros((count, count)))
