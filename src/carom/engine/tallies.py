"""Sums over processed events, and the log that they are written to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import required

TALLY = np.dtype(
    [
        ("collisions", "i8"),
        ("advancements", "i8"),
        ("transits", "i8"),
        ("clamped", "i8"),
        ("returns", "i8"),
        ("virial", "f8"),
        ("depth", "f8"),
    ]
)


class BySpecies(NamedTuple):
    """What collisions add up to for every pair of species."""

    kinds: np.ndarray
    """Species, (n + 1,) int64: the array of the cores, where they have one."""
    collisions: np.ndarray
    """(K, K) int64, in the rows of the smaller index."""
    virial: np.ndarray
    """(K, K) float64, likewise."""


@required
def count_pair(by_species, i, j, virial):
    """Add a collision to its pair of species."""


@count_pair.register
def _(by_species: None, i, j, virial):
    return None


@count_pair.register
def _(by_species: BySpecies, i, j, virial):
    a = min(by_species.kinds[i], by_species.kinds[j])
    b = max(by_species.kinds[i], by_species.kinds[j])
    by_species.collisions[a, b] += 1
    by_species.virial[a, b] += virial


class Log(NamedTuple):
    """A buffer of collisions, emptied into a file by the caller."""

    used: np.ndarray
    """How many entries are filled, (1,) int64."""
    epoch: np.ndarray
    """Epoch of each collision, int64."""
    time: np.ndarray
    """Time within the epoch, float64."""
    i: np.ndarray
    """The component of lower index, int32."""
    word: np.ndarray
    """The word of the other, or ``OBSTACLE - k``, int32."""
    impulse: np.ndarray
    """Magnitude of the momentum exchanged, float64."""


def make_log(size: int) -> Log:
    """Return an empty buffer for ``size`` collisions."""
    return Log(
        np.zeros(1, np.int64),
        np.zeros(size, np.int64),
        np.zeros(size),
        np.zeros(size, np.int32),
        np.zeros(size, np.int32),
        np.zeros(size),
    )


@required
def log_full(log):
    """Return whether the log has no room for the next collision."""


@log_full.register
def _(log: None):
    return False


@log_full.register
def _(log: Log):
    return log.used[0] == len(log.time)


@required
def record(log, clock, i, word, impulse):
    """Write a collision to the log."""


@record.register
def _(log: None, clock, i, word, impulse):
    return None


@record.register
def _(log: Log, clock, i, word, impulse):
    k = log.used[0]
    log.epoch[k] = clock.epoch
    log.time[k] = clock.now
    log.i[k] = i
    log.word[k] = word
    log.impulse[k] = impulse
    log.used[0] = k + 1
