"""The box: its edges, which of its axes are periodic, and how full of spheres it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom import checks, densities
from carom.arithmetic import power
from carom.errors import InputError
from carom.scene import lattices

#: Longest edge, in diameters. In a longer one coordinates are too coarse to tell contact from overlap (see
#: overlaps.rounding).
LONGEST_EDGE = 1e9


def dimensions(value: Any, low: int = 1) -> int:
    """Return the number of dimensions, checked."""
    return checks.integer(value, "dimension", low=low, high=lattices.MOST_DIMENSIONS)


def axes(box: Any) -> list[Any] | None:
    """Return edges as a list if one is given for each axis, or None if one value stands for all."""
    if isinstance(box, np.ndarray):
        return list(box) if box.ndim else None
    return list(box) if isinstance(box, Sequence) and not isinstance(box, str | bytes) else None


def edges(box: Any, dimension: int, largest: float, smallest: float) -> tuple[float, ...]:
    """Return the d edges of a box, each long enough for one sphere and short enough for a double."""
    each = axes(box)
    given = [box] * dimension if each is None else each
    if len(given) != dimension:
        raise InputError(f"box must be one edge or {dimension} (one an axis), found {len(given)}.")
    result = tuple(checks.number(edge, "box edge") for edge in given)
    for edge in result:
        if edge <= 0:
            raise InputError(f"box edge must be positive, found {edge:g}.")
        if edge <= largest:
            raise InputError(
                f"box edge must be greater than the diameter ({largest:.6g}), found {edge:.6g}: "
                "a sphere would touch its own image, or both walls. Enlarge the box."
            )
        if edge > LONGEST_EDGE * smallest:
            raise InputError(
                f"box edge must be at most {LONGEST_EDGE:g} diameters, found {edge / smallest:g}: "
                "coordinates that large cannot tell contact from overlap."
            )
    return result


def filled(
    diameters: np.ndarray,
    dimension: int,
    shape: tuple[float, ...],
    *,
    packing_fraction: float | None,
    density: float | None,
) -> tuple[float, ...]:
    """Return the edges of a box of a shape in which these spheres have a packing fraction or density."""
    sigma, n = float(diameters.max()), len(diameters)
    # Mean volume of a sphere over the volume of the largest one.
    filling = 1.0 if np.ptp(diameters) == 0 else float(np.sum(power(diameters / sigma, dimension))) / n
    if density is None:
        rho = densities.reduced_density(dimension, packing_fraction=packing_fraction) / filling
    else:
        rho = checks.number(density, "density", low=0, open_low=True)
        densities.reduced_density(dimension, packing_fraction=packing_fraction, density=rho * filling)
    scale = (n / (rho * math.prod(shape))) ** (1 / dimension) * sigma
    return edges(tuple(scale * x for x in shape), dimension, sigma, float(diameters.min()))


def periodicity(given: Any, dimension: int) -> tuple[bool, ...]:
    """Return which axes are periodic, from one boolean or one for each axis."""
    several = axes(given)
    each = [given] * dimension if several is None else several
    if len(each) != dimension:
        raise InputError(f"periodic must be one boolean or {dimension} (one an axis), found {len(each)}.")
    for value in each:
        if not isinstance(value, bool | np.bool_):
            raise InputError(f"periodic must be true or false, found {checks.describe(value)}.")
    return tuple(bool(value) for value in each)


def packing_fraction(diameters: np.ndarray, box: Sequence[float]) -> float:
    """Return the part of the box that the spheres fill."""
    if np.ptp(diameters) == 0:
        return densities.packing_fraction(len(diameters), box, float(diameters[0]))
    sigma = float(diameters.max())
    volume = math.fsum(power(diameters / sigma, len(box)))
    return densities.sphere_volume(len(box)) * volume * math.prod(sigma / edge for edge in box)
