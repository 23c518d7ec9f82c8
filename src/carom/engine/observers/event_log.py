"""The event log: every event with its time, in a buffer that the caller empties into a file."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.engine.observers.interface import is_full, record, spared


class Log(NamedTuple):
    """A buffer of events."""

    used: np.ndarray
    """How many entries are filled, (1,) int64."""
    epoch: np.ndarray
    """Epoch of each event, int64."""
    time: np.ndarray
    """Time within the epoch, float64."""
    i: np.ndarray
    """The component of lower index, int32."""
    ref: np.ndarray
    """The word of the other, or the code of an event of one component, int32."""
    impulse: np.ndarray
    """Magnitude of momentum exchanged, float64."""


def make_log(size: int) -> Log:
    """Return an empty buffer for ``size`` events."""
    return Log(
        np.zeros(1, np.int64),
        np.zeros(size, np.int64),
        np.zeros(size),
        np.zeros(size, np.int32),
        np.zeros(size, np.int32),
        np.zeros(size),
    )


@is_full.register
def _(observer: Log):
    return observer.used[0] == len(observer.time)


@record.register
def _(observer: Log, clock, i, ref, impulse):
    k = observer.used[0]
    observer.epoch[k] = clock.epoch
    observer.time[k] = clock.now
    observer.i[k] = i
    observer.ref[k] = ref
    observer.impulse[k] = impulse
    observer.used[0] = k + 1


@spared.register
def _(observer: Log):
    return Log._fields
