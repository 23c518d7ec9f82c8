"""The event log: every event with its time, in a buffer that the caller empties into a file."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import ROOM


class Log(Observer):
    """A buffer of events."""

    used: Annotated[np.ndarray, ROOM]  # how many entries are filled, (1,) int64
    epoch: Annotated[np.ndarray, ROOM]  # epoch of each event, int64
    time: Annotated[np.ndarray, ROOM]  # time within the epoch, float64
    i: Annotated[np.ndarray, ROOM]  # the component of lower index, int32
    ref: Annotated[np.ndarray, ROOM]  # the other, or the code of an event of one component, int32
    impulse: Annotated[np.ndarray, ROOM]  # magnitude of momentum exchanged, float64

    def is_full(self):
        return self.used[0] == len(self.time)

    def record(self, clock, i, ref, impulse):
        k = self.used[0]
        self.epoch[k] = clock.epoch
        self.time[k] = clock.now
        self.i[k] = i
        self.ref[k] = ref
        self.impulse[k] = impulse
        self.used[0] = k + 1


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
