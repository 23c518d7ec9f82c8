"""Room in cells and in lists at first: more is made where there is none left."""

from __future__ import annotations

import math

from carom.densities import unit_ball_volume
from carom.engine.neighbors.size_classes import size_classes_of
from carom.engine.system import System


def cell_capacity_of(system: System, neighbors: str, shape: tuple[int, ...], list_range: float) -> int:
    """Return how many components a cell can hold at first."""
    members = system.n / math.prod(shape)
    if system.reaches is not None and neighbors == "lists":
        members = size_classes_of(system, list_range).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    return -(-int(most + 1.0) // 8) * 8 - count if count else max(-(-int(most) // 4) * 4, 8)


def list_capacity_of(system: System, density: float, list_range: float) -> int:
    """Return how many neighbours a list can hold at first."""
    if system.reaches is not None:
        return 8
    listed = density * unit_ball_volume(system.dimension) * list_range**system.dimension
    # Most fluids never need more than this; a few longer ones are no reason for room in all of them.
    return int(listed + 1.25 * math.sqrt(listed) + 1.0)
