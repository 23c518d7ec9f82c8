"""Room in cells and in lists at first: more is made where there is none left."""

from __future__ import annotations

import math

from carom.densities import unit_ball_volume
from carom.engine.neighbors.levels import levels_of
from carom.engine.requirements import Contents


def room_in_cells(contents: Contents, neighbors: str, shape: tuple[int, ...], reach: float) -> int:
    """Return how many components a cell can hold at first."""
    members = contents.n / math.prod(shape)
    if contents.reaches is not None and neighbors == "lists":
        members = levels_of(contents, reach).members
    # Rows of whole registers. Sectors keep their count there, too, and one that overflows has all built anew.
    count = int(neighbors == "sectors")
    most = members + (4.0 if count else 2.0) * math.sqrt(members) + count
    return -(-int(most + 1.0) // 8) * 8 - count if count else max(-(-int(most) // 4) * 4, 8)


def room_in_lists(contents: Contents, density: float, reach: float) -> int:
    """Return how many neighbours a list can hold at first."""
    if contents.reaches is not None:
        return 8
    listed = density * unit_ball_volume(contents.dimension) * reach**contents.dimension
    # Most fluids never need more than this; a few longer ones are no reason for room in all of them.
    return int(listed + 1.25 * math.sqrt(listed) + 1.0)
