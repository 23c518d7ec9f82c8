"""How the time of a contact is computed in a scene: the answer that :mod:`carom.engine.search` takes."""

from __future__ import annotations

import math
from typing import Any

from carom.engine.neighbors.all_pairs import AlongCurves
from carom.engine.neighbors.plan import NeighborPlan
from carom.engine.search import FarSteps, FromCache, FromRows
from carom.engine.system import System
from carom.models.mathematics.contact import MOST_DIAMETERS
from carom.models.questions.steps import step_core_square

MOST_FLOWN = 8.0
"""Diameters that two may fly relative to each other from the moment from which their contact is computed: the
square of their distance is rounded, and the contact is off by some 32 roundings.
"""

SLIGHT = 2.0**-10
"""Diameters below which contacts are not computed from such a moment: the box leaves no room for it."""

ALIKE = 2.0**-4
"""Part of the smallest diameter that a distance of contact may be for this to hold for it, too: it is then
off by less than a scene tolerates. Where one is less, the flight is measured by that.
"""


def timing_of(
    scheme: NeighborPlan, system: System, neighbors, pair
) -> FromRows | FarSteps | FromCache | AlongCurves | None:
    """Return how the time of a contact is computed."""
    if scheme.kind == "all":
        return FromCache(neighbors.from_time)
    if scheme.kind == "pairs":
        return AlongCurves(scheme.span)
    if system.stepped:
        core = _smallest_core(system.interaction, pair, system)
        return FarSteps() if scheme.list_range > MOST_DIAMETERS * core else None
    # Half a box away, pairs would be taken for other images.
    growing = 1.0 if system.rates is None else 2.0
    free_space = 0.49 * system.narrowest / max(system.stretch) - growing * system.diameter
    size = system.smallest if system.nearest >= ALIKE * system.smallest else system.nearest
    ahead = min(MOST_FLOWN * size, free_space)
    return FromRows(ahead**2) if ahead >= SLIGHT * size else None


def _smallest_core(interaction: Any, pair, system: System) -> float:
    """Return the diameter of the smallest hard core, circles not counted; infinity without one."""
    count, _ = interaction.steps(system.particles)
    squares = [float(step_core_square(pair, step)) for step in range(count)]
    return math.sqrt(min((square for square in squares if square > 0.0), default=math.inf))
