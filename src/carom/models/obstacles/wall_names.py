"""Names of axes and of the walls of the box.

They are x_low, x_high, y_low, ..., and axis3_low from the fourth axis on.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from carom.texts import axis_name


def axis_names(dimension: int) -> list[str]:
    """Return the names of all axes."""
    return [axis_name(axis) for axis in range(dimension)]


def wall_name(axis: int, side: int) -> str:
    """Return the name of a wall: its axis, and low for ``side`` 0, high for 1."""
    return f"{axis_name(axis)}_{('low', 'high')[side]}"


def sides(periodic: Sequence[bool]) -> list[tuple[int, int]]:
    """Return the walls of the box in their order: the axis of each, and 0 for a lower, 1 for an upper one."""
    return [(axis, side) for axis, wraps in enumerate(periodic) if not wraps for side in (0, 1)]


def place_of(name: str) -> tuple[int, int] | None:
    """Return axis and side of the wall of a name, in any dimension; None if it is no such name."""
    found = re.fullmatch(r"(x|y|z|axis([1-9][0-9]*))_(low|high)", name)
    if found is None or (found[2] is not None and int(found[2]) < 3):
        return None
    axis = "xyz".index(found[1]) if found[2] is None else int(found[2])
    return axis, int(found[3] == "high")
