"""The end of a run at a contact with an obstacle: the cycle returns before anything else happens."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import optional
from carom.engine.constants import OBSTACLE
from carom.engine.tallies import log_full, record


class StopAtHit(NamedTuple):
    """What stands in place of the log, and passes on to it: it counts contacts with some obstacles."""

    log: Any
    """The log, or None."""
    wanted: np.ndarray
    """Whether contacts with each obstacle count, by the engine's numbers, bool."""
    left: np.ndarray
    """Contacts that are still to come, (1,) int64."""


@optional
def stopped(log):
    """Return whether the contact that ends the run has happened."""
    return False


@stopped.register
def _(log: StopAtHit):
    return log.left[0] <= 0


@log_full.register
def _(log: StopAtHit):
    return log_full(log.log)


@record.register
def _(log: StopAtHit, clock, i, ref, impulse):
    record(log.log, clock, i, ref, impulse)
    number = OBSTACLE - ref
    if 0 <= number < len(log.wanted) and log.wanted[number]:
        log.left[0] -= 1
