"""What a part knows of itself, what parts tell each other, and the calendar that holds both."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.atomics import store
from carom.compiling.registry import inner
from carom.engine.windows.slabs import PATCHES, layer_of

MAIL = 256
"""Messages that may be on their way to a part from one side; a power of two."""

PAST = 128
"""Events that a part, and a border, remember; a power of two."""

TIME, LATEST, WHOSE, PLACE = 0, 1, 2, 3
"""Of an event that is remembered: its time, the latest of this and of those before, its part, its layers."""

NOTES = 64
"""Events in a zone that a part announces."""

BUSY, FAR = 4, 8
"""What ``locked`` has in addition while an event is processed, and if it is far away from all borders: what
it touches is the part's own, and concerns nobody else.
"""

LINE = 8
"""Words of a cache line."""

DESK = np.dtype(
    [
        ("me", "i8"),
        ("parts", "i8"),
        ("axis", "i8"),
        ("lead", "f8"),
        ("patience", "i8"),
        ("locked", "i8"),
        ("refused", "i8"),
        ("passed", "i8"),
        ("late", "i8"),
        ("latest", "f8"),
        ("told", "f8"),
        ("said", "i8"),
        ("until", "f8"),
        ("seen", "f8"),
        ("sight", "f8"),
        ("fresh", "i8"),
        ("frontier", "i8"),
        ("unnoted", "f8"),
        ("noted", "i8", (2,)),
        ("written", "i8", (2,)),
        ("read", "i8", (2,)),
        ("unread", "f8", (2,)),
    ]
)
"""What one part knows of itself.

``me``: its number of ``parts``; ``axis``: as in ``Slabs``; ``lead``: widths of a bucket that it
may be ahead of others; ``patience``: refusals after which it lets another thread have the core; ``locked``:
borders that it holds; ``refused``: how often in a row; ``passed``: events noted, ``latest`` the time of the
latest, ``late``: how many came after a later one; ``told`` and ``sight``: what it has announced, ``said``: in
which bucket; ``until``: the end of the window; ``fresh``: it has read messages and not said so;
``frontier``: last bucket looked into, and ``seen`` its end; ``unnoted``: time of an event that it had no room
for. Of each side: ``noted`` events; messages ``written`` and ``read``; the time of the earliest that may be
``unread``.
"""


class Board(NamedTuple):
    """What parts tell each other; each writes on cache lines of its own."""

    clocks: np.ndarray
    """Of each part: nothing is due before this time, and nothing that it has not announced before that one,
    (parts, 8) float64.
    """
    inbox: np.ndarray
    """Messages sent to each part from below and from above, and whether all are to stop, (parts, 8) int64."""
    taken: np.ndarray
    """Messages that each part has read, (parts, 8) int64."""
    mail: np.ndarray
    """The messages: components that are due, (parts, 2, MAIL) int32."""
    locks: np.ndarray
    """Whether somebody holds the border below each part, and the events in its zone, (parts, 8) int64."""
    past: np.ndarray
    """The last of them, (parts, PAST, 8 or more) float64: a cache line each."""
    due: np.ndarray
    """Earliest event announced in each patch of both borders, (parts, 2, PATCHES) float64."""


class PartCalendar(NamedTuple):
    """The calendar of a part: the first five as those of a ``Calendar``."""

    control: Any
    buckets: np.ndarray
    lines: np.ndarray
    due: np.ndarray
    who: np.ndarray
    neighbors: Any
    """The neighbour scheme, which says where components are."""
    desk: Any
    """One record of type DESK."""
    board: Board
    mask: np.ndarray
    """What each layer is to the part, (layers,) uint8."""
    along: np.ndarray
    """Two axes along which borders are divided into patches, (2,) int64."""
    patches: np.ndarray
    """Into how many, along each of them, (2,) int64."""
    rows: np.ndarray
    """The row of patches that each layer along each of them is in, (2, layers) int64."""
    layers: np.ndarray
    """Layers along each axis, (d,) int64."""
    near: np.ndarray
    """Layers between two events up to which they may touch the same, (d,) int64."""
    past: np.ndarray
    """The last events, (PAST, 8 or more) float64."""
    notes: np.ndarray
    """Times of the events announced on each side, (2, NOTES) float64."""
    where: np.ndarray
    """Their patches, (2, NOTES) int64."""
    flags: np.ndarray
    """Whether a bucket may hold one, (buckets,) uint8."""


@inner
def mask_of(calendar, i):
    """Return what the layer of component i is to this part."""
    return np.int64(calendar.mask[layer_of(calendar.neighbors, i, calendar.desk[0].axis)])


@inner
def row_of(calendar, i, k):
    """Return the row of patches that component i is in, along the k-th axis of a border."""
    return calendar.rows[k, layer_of(calendar.neighbors, i, calendar.along[k])]


@inner
def patch_at(calendar, side, part, row, column):
    """Return where the board has what a part announces in a patch of its border on a side."""
    return (2 * part + side) * PATCHES + row * calendar.patches[1] + column


@inner
def beside(desk, side):
    """Return the part below (side 0) or above (1)."""
    other = desk.me + 2 * side - 1
    return other + desk.parts if other < 0 else (other - desk.parts if other >= desk.parts else other)


@inner
def slot_of(desk, side):
    """Return which messages are those from or to the part on a side: of two parts, all are from below."""
    return np.int64(0 if desk.parts == 2 else side)


@inner
def border(desk, side):
    """Return where the lock of the border on a side is."""
    return np.int64(LINE) * np.int64(desk.me if side == 0 else beside(desk, np.int64(1)))


@inner
def stop_all(calendar):
    """Tell all parts that the window is lost."""
    for part in range(calendar.desk[0].parts):
        store(calendar.board.inbox, LINE * part + 2, np.int64(1))
