"""Walls of the box: hard, at 0 and at the edge of every axis that is not periodic.

Their names are x_low, x_high, y_low, ..., and axis3_low from the fourth axis on. An obstacle may stand for a
wall, which is then none, or lie in the plane of one (``faces``).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

from carom.texts import axis_name

ROUNDING_MARGIN = 2.0**-40
"""Part of the longest edge by which a wall stands back where it is compared with what lies in its plane: more
than rounding leaves of a place.
"""


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


class Walls(NamedTuple):
    """Hard walls along the axes that are not periodic, where no obstacle stands for one."""

    lows: tuple  # where the lower wall of each axis stands, or would [length]
    highs: tuple  # the same of the upper walls
    stands: tuple  # 1 for a wall that stands, else 0: the lower and the upper one, axis after axis
    behind: Any = None
    """The same walls, but a hair back where an obstacle lies in their plane, or None if none does: it is met
    first where both are met at once.
    """


def cushions(
    box: Sequence[float],
    periodic: Sequence[bool],
    replaced: Collection[tuple[int, int]] = (),
    yielding: Collection[tuple[int, int]] = (),
) -> Walls | None:
    """Return what the engine compiles for the walls of a box, or None where there are none.

    An obstacle stands for the walls ``replaced``, and lies in the plane of those ``yielding``: (axis, 0 for
    the lower wall or 1 for the upper one).
    """
    edges, walled = tuple(map(float, box)), {*sides(periodic)} - {*replaced}
    if not walled:
        return None
    every = [(axis, side) for axis in range(len(edges)) for side in (0, 1)]
    stands = tuple(int(wall in walled) for wall in every)
    behind = None
    if yielding:
        hair = ROUNDING_MARGIN * max(edges)
        low, high = ([hair * ((axis, side) in yielding) for axis in range(len(edges))] for side in (0, 1))
        behind = Walls(tuple(-way for way in low), tuple(map(sum, zip(edges, high, strict=True))), stands)
    return Walls((0.0,) * len(edges), edges, stands, behind)
