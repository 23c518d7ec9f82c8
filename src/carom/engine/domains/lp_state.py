"""What a process knows of itself, what processes tell each other, and the calendar that holds both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.instructions import store
from carom.engine.domains.decomposition import PATCHES

MOST_MESSAGES = 256
"""Messages that may be on their way to a process from one side; a power of two."""

HISTORY_LENGTH = 128
"""Events that a process, and a border, remember; a power of two."""

TIME, LATEST, WHOSE, PLACE = 0, 1, 2, 3
"""Of an event that is remembered: its time, the latest of this and of those before, its process, its layers.
"""

MOST_ANNOUNCED = 64  # events in a zone that a process announces

PROCESSING, INTERIOR = 4, 8
"""What ``held_borders`` has in addition while an event is processed, and if it is far away from all borders:
what it touches is the process's own, and concerns nobody else.
"""

LINE = 8  # words of a cache line

LP_STATE = np.dtype(
    [
        ("me", "i8"),
        ("processes", "i8"),
        ("axis", "i8"),
        ("time_window", "f8"),
        ("spins_before_yield", "i8"),
        ("held_borders", "i8"),
        ("waits", "i8"),
        ("processed", "i8"),
        ("stragglers", "i8"),
        ("local_time", "f8"),
        ("announced_time", "f8"),
        ("announced_bucket", "i8"),
        ("window_end", "f8"),
        ("scanned_time", "f8"),
        ("announced_horizon", "f8"),
        ("unacknowledged", "i8"),
        ("scanned_bucket", "i8"),
        ("first_unannounced", "f8"),
        ("announced_counts", "i8", (2,)),
        ("written", "i8", (2,)),
        ("read", "i8", (2,)),
        ("unread", "f8", (2,)),
    ]
)
"""What one process knows of itself.

``me``: its number of ``processes``; ``axis``: as in ``Slabs``; ``time_window``: widths of a bucket that it
may be ahead of others; ``spins_before_yield``: refusals after which it lets another thread have the core;
``held_borders``: borders that it holds; ``waits``: how often in a row; ``processed``: events noted,
``local_time`` the time of the latest, ``stragglers``: how many came after a later one; ``announced_time`` and
``announced_horizon``: what it has announced, ``announced_bucket``: in which bucket; ``window_end``: the end
of the window; ``unacknowledged``: it has read messages and not said so; ``scanned_bucket``: last bucket
looked into, and ``scanned_time`` its end; ``first_unannounced``: time of an event that it had no room for. Of
each side: ``announced_counts`` events; messages ``written`` and ``read``; the time of the earliest that may
be ``unread``.
"""


class Channels(NamedTuple):
    """What processes tell each other; each writes on cache lines of its own."""

    published_time: np.ndarray
    """Of each process: nothing is due before this time, its safe time, and nothing that it has not announced
    before that one, (processes, 8) float64.
    """
    sent_count: np.ndarray
    """Messages sent to each process from below and from above, and whether all are to stop, (processes, 8)
    int64.
    """
    acknowledged: np.ndarray
    """Messages that each process has read, (processes, 8) int64."""
    messages: np.ndarray
    """The messages: components that are due, (processes, 2, MOST_MESSAGES) int32."""
    border_locks: np.ndarray
    """Whether somebody holds the border below each process, and the events in its zone, (processes, 8) int64.
    """
    history: np.ndarray
    """The last events in each of these zones, (processes, HISTORY_LENGTH, 8 or more) float64: a cache line
    each.
    """
    event_time: np.ndarray
    """Earliest event announced in each patch of both borders, (processes, 2, PATCHES) float64."""


def mask_of(calendar, i):
    """Return what the layer of component i is to this process."""
    return calendar.mask[calendar.neighbors.layer_of(i, calendar.lp[0].axis)]


def row_of(calendar, i, k):
    """Return the row of patches that component i is in, along the k-th axis of a border."""
    return calendar.rows[k, calendar.neighbors.layer_of(i, calendar.along[k])]


def patch_at(calendar, side, process, patch_row, column):
    """Return the place of what a process announces in a patch of its border on a side."""
    return (2 * process + side) * PATCHES + patch_row * calendar.patches[1] + column


def beside(lp, side):
    """Return the process below (side 0) or above (1)."""
    other = lp.me + 2 * side - 1
    return other + lp.processes if other < 0 else (other - lp.processes if other >= lp.processes else other)


def slot_of(lp, side):
    """Return which messages are those from or to the process on a side: of two, all are from below."""
    return 0 if lp.processes == 2 else side


def border(lp, side):
    """Return where the lock of the border on a side is."""
    return LINE * (lp.me if side == 0 else beside(lp, 1))


def abort_window(calendar):
    """Tell all processes that the window is rolled back."""
    for process in range(calendar.lp[0].processes):
        store(calendar.channels.sent_count, LINE * process + 2, 1)


def unlock(calendar):
    """Let others have the borders that this process holds."""
    lp = calendar.lp[0]
    for side in range(2):
        if lp.held_borders & (side + 1) != 0:
            store(calendar.channels.border_locks, border(lp, side), 0)
    lp.held_borders = 0
