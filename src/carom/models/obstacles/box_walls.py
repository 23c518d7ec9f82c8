"""Walls of the box: hard, at 0 and at the edge of every axis that is not periodic.

An obstacle may stand for a wall, which is then none, or lie in the plane of one (``faces``).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import answering
from carom.models.mathematics.parabolas import first_landing
from carom.models.obstacles.wall_names import sides
from carom.models.questions import walls
from carom.models.questions.particles import NEVER
from carom.models.questions.walls import landing_on_wall, soonest_wall, wall_meeting, wall_normal

ROUNDING_MARGIN = 2.0**-40
"""Part of the longest edge by which a wall stands back where it is compared with what lies in its plane: more
than rounding leaves of a place.
"""


@answering(walls)
class Cushions(NamedTuple):
    """Hard walls at 0 and at the edge along the axes that are not periodic."""

    edges: tuple  # edges of the box [length]
    walled: tuple  # 1 for an axis with walls, 0 for a periodic one

    def soonest_wall(self, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.edges)):
            if self.walled[axis] != 0:
                upper = np.int64(v[axis] > 0.0)
                approach = abs(v[axis]) + growth
                gap = self.edges[axis] - x[axis] - radius if upper else x[axis] - radius
                t = max(gap / approach, 0.0) if approach > 0.0 else NEVER
                if growth > 0.0:  # the wall behind may be reached by growth
                    back = growth - abs(v[axis])
                    gap = x[axis] - radius if upper else self.edges[axis] - x[axis] - radius
                    if back > 0.0 and max(gap / back, 0.0) < t:
                        t = max(gap / back, 0.0)
                        upper = 1 - upper
                if t < best:
                    best = t
                    number = 2 * axis + upper
        return best, number

    def landing_on_wall(self, g, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.edges)):
            if self.walled[axis] != 0:
                low = first_landing(x[axis] - radius, v[axis] - growth, g[axis])
                high = first_landing(self.edges[axis] - x[axis] - radius, -v[axis] - growth, -g[axis])
                if min(low, high) < best:
                    best = min(low, high)
                    number = np.int64(2 * axis + (high < low))
        return best, number


@answering(walls)
class Faces(NamedTuple):
    """Hard walls where no obstacle stands for one."""

    lows: tuple  # where the lower wall of each axis stands, or would [length]
    highs: tuple  # the same of the upper walls
    lower: tuple  # 1 for an axis with a lower wall, else 0
    upper: tuple  # the same of the upper walls

    def soonest_wall(self, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.lows)):
            low = growth - v[axis]
            high = growth + v[axis]
            if self.lower[axis] != 0 and low > 0.0:
                t = max((x[axis] - self.lows[axis] - radius) / low, 0.0)
                if t < best:
                    best = t
                    number = np.int64(2 * axis)
            if self.upper[axis] != 0 and high > 0.0:
                t = max((self.highs[axis] - x[axis] - radius) / high, 0.0)
                if t < best:
                    best = t
                    number = np.int64(2 * axis + 1)
        return best, number

    def landing_on_wall(self, g, x, v, radius, growth):
        best = NEVER
        number = np.int64(-1)
        for axis in range(len(self.lows)):
            if self.lower[axis] != 0:
                t = first_landing(x[axis] - self.lows[axis] - radius, v[axis] - growth, g[axis])
                if t < best:
                    best = t
                    number = np.int64(2 * axis)
            if self.upper[axis] != 0:
                t = first_landing(self.highs[axis] - x[axis] - radius, -v[axis] - growth, -g[axis])
                if t < best:
                    best = t
                    number = np.int64(2 * axis + 1)
        return best, number


@answering(walls)
class Yielding(NamedTuple):
    """Walls, in the plane of some of which an obstacle lies: it is met first where both are met at once."""

    walls: Faces
    behind: Faces  # the same, but those walls stand back by a hair

    def soonest_wall(self, x, v, radius, growth):
        return soonest_wall(self.walls, x, v, radius, growth)

    def landing_on_wall(self, g, x, v, radius, growth):
        return landing_on_wall(self.walls, g, x, v, radius, growth)

    def yields(self, motion, x, v, radius, growth, t):
        time_behind, _ = wall_meeting(motion, self.behind, x, v, radius, growth)
        return t < NEVER and t <= time_behind


def cushions(
    box: Sequence[float],
    periodic: Sequence[bool],
    replaced: Collection[tuple[int, int]] = (),
    yielding: Collection[tuple[int, int]] = (),
) -> Any:
    """Return what the engine compiles for the walls of a box, or None where there are none.

    An obstacle stands for the walls ``replaced``, and lies in the plane of those ``yielding``: (axis, 0 for
    the lower wall or 1 for the upper one).
    """
    edges, walled = tuple(map(float, box)), {*sides(periodic)} - {*replaced}
    if not walled:
        return None
    if not replaced and not yielding:
        return Cushions(edges, tuple(int(not wraps) for wraps in periodic))
    axes = range(len(edges))
    lower, upper = (tuple(int((axis, side) in walled) for axis in axes) for side in (0, 1))
    walls = Faces((0.0,) * len(edges), edges, lower, upper)
    if not yielding:
        return walls
    hair = ROUNDING_MARGIN * max(edges)
    back = [[hair * ((axis, side) in yielding) for axis in axes] for side in (0, 1)]
    lows, highs = tuple(-way for way in back[0]), tuple(map(sum, zip(edges, back[1], strict=True)))
    return Yielding(walls, Faces(lows, highs, lower, upper))


def _upright(kind: type) -> None:
    """Register the normals of walls that stand across the axes."""

    @wall_normal.register(kind)
    def _(walls, number, axis):
        if number >> 1 != axis:
            return 0.0
        return 1.0 if number & 1 == 0 else -1.0


_upright(Cushions)
_upright(Faces)
_upright(Yielding)
