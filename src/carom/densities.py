"""Packing fractions and densities of spheres in any dimension."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError

#: Packing fraction of the densest known packing of equal spheres in d dimensions (d = 1, 2, 3, 8 proven;
#: lattices Z, A2, D3, D4, D5, E6, E7, E8). Conway and Sloane, Sphere Packings, Lattices and Groups, table
#: 1.2.
CLOSEST_PACKING = {
    1: 1.0,
    2: math.pi / math.sqrt(12),
    3: math.pi / math.sqrt(18),
    4: math.pi**2 / 16,
    5: math.pi**2 / (15 * math.sqrt(2)),
    6: math.pi**3 / (48 * math.sqrt(3)),
    7: math.pi**3 / 105,
    8: math.pi**4 / 384,
}


def unit_ball_volume(dimension: int) -> float:
    """Return the volume of the ball of radius 1 in ``dimension`` dimensions, pi^(d/2) / Gamma(d/2 + 1)."""
    return math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1)


def sphere_volume(dimension: int) -> float:
    """Return the volume v_d of the sphere of *diameter* 1: the packing fraction at unit reduced density."""
    return unit_ball_volume(dimension) / 2**dimension


def sphere_area(dimension: int, radius: float) -> float:
    """Return the surface area of a sphere with a ``radius`` in ``dimension`` d [length^(d-1)]."""
    return dimension * unit_ball_volume(dimension) * radius ** (dimension - 1)


def packing_fraction(n: int, box: Sequence[float], diameter: float = 1.0) -> float:
    """Return the fraction of a box (edges [length]) that ``n`` spheres of one diameter [length] fill."""
    return n * sphere_volume(len(box)) * math.prod(diameter / edge for edge in box)


def reduced_density(
    dimension: int,
    *,
    packing_fraction: Any = None,
    density: Any = None,
    limit: float | None = None,
    where: str = "any packing",
) -> float:
    """Return the spheres per diameter^d, from packing fraction or density, at most that of a ``limit``."""
    if (packing_fraction is None) == (density is None):
        found = "neither" if density is None else "both"
        raise InputError(f"Give exactly one of packing_fraction and density, found {found}.")
    volume = sphere_volume(dimension)
    if packing_fraction is not None:
        fraction = checks.number(packing_fraction, "packing_fraction", low=0, open_low=True)
        given, result = f"packing_fraction {fraction:.6g}", fraction / volume
    else:
        result = checks.number(density, "density", low=0, open_low=True)
        fraction = result * volume
        given = f"density {result:.6g} (packing fraction {fraction:.6g})"
    if limit is None:
        limit = CLOSEST_PACKING.get(dimension, 1.0)
    # The limits are irrational numbers; exceeding them by a few roundings is no denser packing.
    if fraction > limit * (1 + 8 * np.finfo(float).eps):
        raise InputError(
            f"{given} is beyond the densest that {where} of equal spheres in {dimension} "
            f"dimension{'s' * (dimension > 1)} can reach, {limit:.6f}. Lower it."
        )
    return result
