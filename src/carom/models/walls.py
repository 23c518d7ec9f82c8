"""Walls of the box: hard, at 0 and at the edge of every axis that is not periodic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from carom.models.interface import NEVER, soonest_wall, wall_normal


class Cushions(NamedTuple):
    """Hard walls at 0 and at the edge along the axes that are not periodic."""

    edges: tuple
    """Edges of the box [length]."""
    walled: tuple
    """1 for an axis with walls, 0 for a periodic one."""


def cushions(box: Sequence[float], periodic: Sequence[bool]) -> Cushions | None:
    """Return what the engine compiles for the walls of a box, or None where all axes are periodic."""
    if all(periodic):
        return None
    return Cushions(tuple(map(float, box)), tuple(int(not wraps) for wraps in periodic))


@soonest_wall.register
def _(walls: None, x, v, radius, growth):
    return NEVER, np.int64(-1)


@soonest_wall.register
def _(walls: Cushions, x, v, radius, growth):
    best = NEVER
    number = np.int64(-1)
    for axis in range(len(walls.edges)):
        if walls.walled[axis] != 0:
            upper = np.int64(v[axis] > 0.0)
            approach = abs(v[axis]) + growth
            gap = walls.edges[axis] - x[axis] - radius if upper else x[axis] - radius
            t = max(gap / approach, 0.0) if approach > 0.0 else NEVER
            if growth > 0.0:  # the wall behind may be reached by growth
                back = growth - abs(v[axis])
                gap = x[axis] - radius if upper else walls.edges[axis] - x[axis] - radius
                if back > 0.0 and max(gap / back, 0.0) < t:
                    t = max(gap / back, 0.0)
                    upper = 1 - upper
            if t < best:
                best = t
                number = 2 * axis + upper
    return best, number


@wall_normal.register
def _(walls: None, number, axis):
    return 0.0


@wall_normal.register
def _(walls: Cushions, number, axis):
    if number >> 1 != axis:
        return 0.0
    return 1.0 if number & 1 == 0 else -1.0
