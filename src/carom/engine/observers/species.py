"""Collisions and virial of every pair of species."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.engine.observers.interface import count_pair, spared
from carom.models.questions.memory import copy_state


class BySpecies(NamedTuple):
    """What collisions add up to for every pair of species."""

    kinds: np.ndarray
    """Species, (n + 1,) int64: the array of the cores, where they have one."""
    collisions: np.ndarray
    """(K, K) int64, in the rows of the smaller index."""
    virial: np.ndarray
    """(K, K) float64, likewise."""


def make_by_species(kinds: np.ndarray) -> BySpecies:
    """Return empty sums for components of the species ``kinds``, (n + 1,)."""
    count = int(kinds.max()) + 1
    return BySpecies(kinds, np.zeros((count, count), np.int64), np.zeros((count, count)))


@count_pair.register
def _(observer: BySpecies, i, j, virial):
    a = min(observer.kinds[i], observer.kinds[j])
    b = max(observer.kinds[i], observer.kinds[j])
    observer.collisions[a, b] += 1
    observer.virial[a, b] += virial


@spared.register
def _(observer: BySpecies):
    return ("kinds",)


@copy_state.register
def _(model: BySpecies, before, instant, passed, slower):
    model.collisions[:] = before.collisions
    model.virial[:] = np.ldexp(before.virial, slower)
