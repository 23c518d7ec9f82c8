"""How the time of a contact is computed in a scene: the answer that :mod:`carom.engine.search` takes."""

from __future__ import annotations

import math
from typing import Any

from carom.engine.neighbors.choice import Scheme
from carom.engine.neighbors.pairs import AlongCurves
from carom.engine.requirements import Contents
from carom.engine.search import FarSteps, NearSight, RowSight
from carom.models.contact import FAR
from carom.models.interface import step_core_square

AHEAD = 8.0
"""Diameters that two may fly relative to each other from the moment from which their contact is computed: the
square of their distance is rounded, and the contact is off by some 32 roundings.
"""

SLIGHT = 2.0**-10
"""Diameters below which contacts are not computed from such a moment: the box leaves no room for it."""

ALIKE = 2.0**-4
"""Part of the smallest diameter that a distance of contact may be for this to hold for it, too: it is then
off by less than a scene tolerates. Where one is less, the flight is measured by that.
"""


def sight_of(
    scheme: Scheme, contents: Contents, neighbors, pair
) -> RowSight | FarSteps | NearSight | AlongCurves | None:
    """Return how the time of a contact is computed."""
    if scheme.kind == "all":
        return NearSight(neighbors.near)
    if scheme.kind == "pairs":
        return AlongCurves(scheme.span)
    if contents.stepped:
        core = _smallest_core(contents.interaction, pair, contents)
        return FarSteps() if scheme.reach > FAR * core else None
    # Half a box away, pairs would be taken for other images.
    growing = 1.0 if contents.rates is None else 2.0
    room = 0.49 * contents.narrowest - growing * contents.diameter
    size = contents.smallest if contents.nearest >= ALIKE * contents.smallest else contents.nearest
    ahead = min(AHEAD * size, room)
    return RowSight(ahead**2) if ahead >= SLIGHT * size else None


def _smallest_core(interaction: Any, pair, contents: Contents) -> float:
    """Return the diameter of the smallest hard core, which need not be a component's; infinity without one.

    Circles of units are no cores.
    """
    count, _ = interaction.steps(contents.particles)
    squares = [float(step_core_square(pair, step)) for step in range(count)]
    return math.sqrt(min((square for square in squares if square > 0.0), default=math.inf))
