"""The arrays of a run: one row a component.

The old event (position, velocity, time) changes at a component's own interactions only; of the new one,
(time, partner) is stored. Sector crossings and samples do not rewrite it, and so never affect the trajectory.
"""

from __future__ import annotations

import contextlib
import mmap
from typing import Any, NamedTuple

import numpy as np

from carom.engine.constants import LAMBDA
from carom.models.interfaces.particles import NEVER

# What the clock of a run holds. Times are relative to the epoch, whose length is a power of two.
CLOCK = np.dtype([("epoch", "i8"), ("now", "f8"), ("length", "f8")])


class State(NamedTuple):
    """All components."""

    rows: Any
    """Old event, fields x (d), t, v (d), and ``event_time`` of the new one; n + 1 rows, the last one padding
    that nobody meets.
    """
    partner: np.ndarray
    """Partner of the new event, (n,) int32: a ref, or LAMBDA for an advancement or no event."""
    crossing_time: np.ndarray
    """Time of each one's transit: it leaves its sector (or the sphere of its list), (n,) float64."""
    images: np.ndarray | None
    """Boxes crossed, (n, d) int32, or None where nobody asks."""
    clock: Any
    """One record of type CLOCK."""


def row_type(dimension: int, number: type = np.float64) -> np.dtype:
    """Return the type of a row in double or single precision: 64 (a cache line) or 32 bytes in space."""
    width = np.dtype(number).itemsize
    columns = -(-(2 * dimension + 2) // 4) * 4
    return np.dtype(
        {
            "names": ["x", "t", "v", "event_time"],
            "formats": [(number, (dimension,)), number, (number, (dimension,)), number],
            "offsets": [0, width * dimension, width * (dimension + 1), width * (2 * dimension + 1)],
            "itemsize": width * columns,
        }
    )


END = np.dtype(
    {"names": ["crossing_time", "partner"], "formats": ["f8", "i4"], "offsets": [48, 56], "itemsize": 64}
)
"""The rest of a row in the plane, in double precision: an event touches fewer lines."""

HUGE_PAGE = 2**21
"""Bytes of a huge page: one address to translate instead of 512."""

HUGE_FROM = 2**20
"""Bytes of an array from which it is on huge pages. NumPy asks for these from 4 MB on."""


def aligned(count: int, dtype) -> np.ndarray:
    """Return ``count`` zeroed items on cache lines of their own: what another thread writes is on others.

    Large arrays are on huge pages, where the system has them: the processor knows too few small ones.
    """
    dtype = np.dtype(dtype)
    size = -(-count * dtype.itemsize // 64) * 64
    if size >= HUGE_FROM and hasattr(mmap, "MADV_HUGEPAGE"):
        whole = mmap.mmap(-1, -(-size // HUGE_PAGE) * HUGE_PAGE + HUGE_PAGE)
        with contextlib.suppress(OSError):  # a system without huge pages
            whole.madvise(mmap.MADV_HUGEPAGE)
        raw, line = np.frombuffer(whole, np.uint8), HUGE_PAGE
    else:
        raw, line = np.zeros(size + 64, np.uint8), 64
    start = -raw.ctypes.data % line
    return raw[start : start + count * dtype.itemsize].view(dtype)


def filled(shape: int | tuple[int, ...], value: float, dtype) -> np.ndarray:
    """Return an array of one value, as :func:`aligned`."""
    array = aligned(int(np.prod(shape)), dtype).reshape(shape)
    if value != 0:
        array[...] = value
    return array


def make_state(positions, velocities, epoch_length: float, count_images: bool, number: type) -> State:
    """Return the initial state, nothing scheduled yet; rows hold numbers of the type given."""
    n, dimension = positions.shape
    kind = row_type(dimension, number)
    rows = aligned(n + 1, kind)
    rows["x"][:n] = positions
    rows["v"][:n] = velocities
    rows["event_time"][:n] = NEVER
    rows["event_time"][n] = -NEVER
    if dimension == 2 and kind.itemsize == END.itemsize:
        ends = rows[:n].view(END)
        partner, crossing_time = ends["partner"], ends["crossing_time"]
    else:
        partner, crossing_time = aligned(n, np.int32), aligned(n, np.float64)
    partner[:], crossing_time[:] = LAMBDA, NEVER
    clock = np.zeros(1, CLOCK)
    clock["length"] = epoch_length
    return State(
        rows=rows.view(np.recarray),
        partner=partner,
        crossing_time=crossing_time,
        images=np.zeros((n, dimension), np.int32) if count_images else None,
        clock=clock.view(np.recarray),
    )
