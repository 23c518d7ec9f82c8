"""The side of a sector, without regard to how far components fly."""

from __future__ import annotations

from carom.engine.requirements import Contents

SECTOR = 0.88
"""Side of a sector in spacings ``(V / n)^(1/d)``, where a diameter is less (docs/performance)."""

HAIR = 2.0**-40
"""Part of a diameter that a sector is wider than that, to absorb the rounding of its faces."""

WIDEST, MOST_SECTORS = 2.0**17, 2.0**20
"""Diameters that a sector is wide, at most: from two of them away a graze of 1e-5 diameters can be told from
a miss. More than so many sectors are not worth it.
"""


def sector_of(contents: Contents, spacing: float) -> tuple[float, float]:
    """Return the side of a sector, and how wide one may be at most, unless there were too many [length]."""
    box, diameter = contents.box, contents.diameter
    sight = max(WIDEST * contents.smallest, max(box) / MOST_SECTORS ** (1.0 / contents.dimension))
    side = max(diameter * (1.0 + HAIR), min(SECTOR * spacing, max(box), sight))
    if contents.rates is not None:
        side = max(side, 1.05 * diameter)
    return side, sight
