"""The end of a run at a contact with an obstacle: the cycle returns before anything else happens."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.engine.constants import OBSTACLE
from carom.engine.observers.interface import ends_run, record


class StopAtHit(NamedTuple):
    """A counter of contacts with some obstacles, in the chain for the length of a run alone."""

    wanted: np.ndarray
    """Whether contacts with each obstacle count, by the engine's numbers, bool."""
    left: np.ndarray
    """Contacts that are still to come, (1,) int64."""


@ends_run.register
def _(observer: StopAtHit):
    return observer.left[0] <= 0


@record.register
def _(observer: StopAtHit, clock, i, ref, impulse):
    number = OBSTACLE - ref
    if 0 <= number < len(observer.wanted) and observer.wanted[number]:
        observer.left[0] -= 1
