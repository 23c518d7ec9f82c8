"""Sums over processed events, and the log that they are written to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import optional

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
    ref: np.ndarray
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


@optional
def log_full(log):
    """Return whether the log has no room for the next collision."""
    return False


@log_full.register
def _(log: Log):
    return log.used[0] == len(log.time)


@optional
def record(log, clock, i, ref, impulse):
    """Write a collision to the log."""
    return


@record.register
def _(log: Log, clock, i, ref, impulse):
    k = log.used[0]
    log.epoch[k] = clock.epoch
    log.time[k] = clock.now
    log.i[k] = i
    log.ref[k] = ref
    log.impulse[k] = impulse
    log.used[0] = k + 1
