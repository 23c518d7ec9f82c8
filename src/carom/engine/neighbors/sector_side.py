"""The side of a sector, without regard to how far components fly."""

from __future__ import annotations

from carom.engine.system import System

SECTOR = 0.88  # side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/benchmarks)

ROUNDING_MARGIN = 2.0**-40
"""Part of a diameter that a sector is wider than that, to absorb the rounding of its faces."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""


def sector_of(system: System, spacing: float) -> tuple[float, float]:
    """Return the side of a sector, and how wide one may be at most, unless there were too many [length]."""
    box, diameter = system.box, system.diameter
    widest_side = max(WIDEST * system.smallest, max(box) / MOST_SECTORS ** (1.0 / system.dimension))
    side = max(diameter * (1.0 + ROUNDING_MARGIN), min(SECTOR * spacing, max(box), widest_side))
    if system.rates is not None:
        side = max(side, 1.05 * diameter)
    return side, widest_side
