"""The arrays of a run: one row a component.

The paper keeps two events a component. With its delayed update the old event is (position, velocity, time)
and of the new one only (time, partner) is stored. Here the old event changes at a component's own
interactions only: a sector crossing or an advancement reads the state, it does not rewrite it, so that
neither the neighbour scheme nor a sample leaves a trace in the trajectory.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.kernel.constants import LAMBDA, NEVER

# What the clock of a run holds. Times are relative to the epoch, whose length is a power of two.
CLOCK = np.dtype([("epoch", "i8"), ("now", "f8"), ("length", "f8")])


class State(NamedTuple):
    """All components."""

    rows: Any
    """Old event and time of the new one: fields x (d), t, v (d), due; n + 1 rows, the last one a ghost that
    nobody meets.
    """
    partner: np.ndarray
    """Partner of the new event, (n,) int32: a word, or LAMBDA for an advancement or no event."""
    leave: np.ndarray
    """Time at which each component leaves its sector (or the sphere of its list), (n,) float64."""
    images: np.ndarray | None
    """Boxes crossed, (n, d) int32, or None where nobody asks."""
    clock: Any
    """One record of type CLOCK."""
    block: np.ndarray
    """Room for the rows of some candidates side by side, for two searches, (2, fields, 32) float64."""


def row_type(dimension: int) -> np.dtype:
    """Return the type of a row: 64 bytes, one cache line, in three dimensions."""
    doubles = 2 * dimension + 2
    size = 8 * doubles if doubles <= 4 else -(-8 * doubles // 32) * 32
    return np.dtype(
        {
            "names": ["x", "t", "v", "due"],
            "formats": [("f8", (dimension,)), "f8", ("f8", (dimension,)), "f8"],
            "offsets": [0, 8 * dimension, 8 * dimension + 8, 16 * dimension + 8],
            "itemsize": size,
        }
    )


def aligned(count: int, dtype) -> np.ndarray:
    """Return ``count`` zeroed items that start on a cache line."""
    dtype = np.dtype(dtype)
    raw = np.zeros(count * dtype.itemsize + 64, np.uint8)
    start = -raw.ctypes.data % 64
    return raw[start : start + count * dtype.itemsize].view(dtype)


def make_state(positions, velocities, epoch_length: float, count_images: bool) -> State:
    """Return the state at time zero, nothing scheduled yet."""
    n, dimension = positions.shape
    rows = aligned(n + 1, row_type(dimension))
    rows["x"][:n] = positions
    rows["v"][:n] = velocities
    rows["due"][:n] = NEVER
    rows["due"][n] = -NEVER
    clock = np.zeros(1, CLOCK)
    clock["length"] = epoch_length
    return State(
        rows=rows.view(np.recarray),
        partner=np.full(n, LAMBDA, np.int32),
        leave=np.full(n, NEVER),
        images=np.zeros((n, dimension), np.int32) if count_images else None,
        clock=clock.view(np.recarray),
        block=aligned(64 * rows.dtype.itemsize // 8, np.float64).reshape(2, -1, 32),
    )
