"""Walls of the box: hard, at 0 and at the edge of every axis that is not periodic.

An obstacle may stand for a wall, which is then none, or lie in the plane of one (``faces``).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import answering, inner
from carom.models.mathematics.parabolas import first_landing
from carom.models.obstacles.wall_names import sides
from carom.models.questions import walls
from carom.models.questions.particles import NEVER
from carom.models.questions.walls import wall_meeting

ROUNDING_MARGIN = 2.0**-40
"""Part of the longest edge by which a wall stands back where it is compared with what lies in its plane: more
than rounding leaves of a place.
"""


@answering(walls)
class Walls(NamedTuple):
    """Hard walls along the axes that are not periodic, where no obstacle stands for one."""

    lows: tuple  # where the lower wall of each axis stands, or would [length]
    highs: tuple  # the same of the upper walls
    stands: tuple  # 1 for a wall that stands, else 0: the lower and the upper one, axis after axis
    behind: Any = None
    """The same walls, but a hair back where an obstacle lies in their plane, or None if none does: it is met
    first where both are met at once.
    """

    def soonest_wall(self, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.lows)):
            upper = np.int64(v[axis] > 0.0)
            approach = abs(v[axis]) + growth
            ahead = self.stands[2 * axis + 1] if upper else self.stands[2 * axis]
            if ahead != 0 and approach > 0.0:
                gap = self.highs[axis] - x[axis] - radius if upper else x[axis] - self.lows[axis] - radius
                t = max(gap / approach, 0.0)
                if t < best:
                    best = t
                    number = 2 * axis + upper
            back = growth - abs(v[axis])
            other = self.stands[2 * axis] if upper else self.stands[2 * axis + 1]
            if growth > 0.0 and back > 0.0 and other != 0:  # it may be reached by growth
                gap = x[axis] - self.lows[axis] - radius if upper else self.highs[axis] - x[axis] - radius
                t = max(gap / back, 0.0)
                if t < best:
                    best = t
                    number = 2 * axis + 1 - upper
        return best, number

    def landing_on_wall(self, g, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.lows)):
            if self.stands[2 * axis] != 0:
                t = first_landing(x[axis] - self.lows[axis] - radius, v[axis] - growth, g[axis])
                if t < best:
                    best = t
                    number = np.int64(2 * axis)
            if self.stands[2 * axis + 1] != 0:
                t = first_landing(self.highs[axis] - x[axis] - radius, -v[axis] - growth, -g[axis])
                if t < best:
                    best = t
                    number = np.int64(2 * axis + 1)
        return best, number

    def wall_normal(self, number, axis):
        if number >> 1 != axis:
            return 0.0
        return 1.0 if number & 1 == 0 else -1.0

    def yields(self, motion, x, v, radius, growth, t):
        return _comes_before(self.behind, motion, x, v, radius, growth, t)


@inner
def _comes_before(behind, motion, x, v, radius, growth, t):
    """Return whether a contact after a time ``t`` comes no later than one with the walls that stand back."""
    if behind is None:
        return False
    time_behind, _ = wall_meeting(motion, behind, x, v, radius, growth)
    return t < NEVER and t <= time_behind


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
