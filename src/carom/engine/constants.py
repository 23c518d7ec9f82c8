"""What an event may be instead of a collision, why the cycle returns, and the tally that sums events up."""

from __future__ import annotations

import numpy as np

LAMBDA = -1
"""Partner of an advancement: nobody (the paper's Lambda)."""

OBSTACLE = -2  # partner of a component that meets obstacle k is ``OBSTACLE - k`` (the paper's N + k)

TIMER_EVENT = -(1 << 30)
"""Partner of a component that has an event of its own: a unit that decides, or one that a drive kicks."""

# Why the cycle returned.
REACHED_TIME = 0
REACHED_COLLISIONS = 1
SPENT = 2
IDLE = 3
NEEDS_HEAP = 4
NEEDS_NEIGHBORS = 5
NEEDS_LOG = 6
REACHED_HIT = 7
NEEDS_EVENTS = 8

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

POWERS = {"virial": -1}  # which sums have the dimension ``time**power``
