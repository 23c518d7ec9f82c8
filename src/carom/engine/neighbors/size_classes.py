"""Components by size: the bounds of each, the levels they are sorted into, and room for their lists."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from carom.densities import unit_ball_volume
from carom.engine.system import System


class SizeClasses(NamedTuple):
    """Components by size: a factor of two a level."""

    levels: np.ndarray  # level of each component, (n,) int
    reaches: list  # the largest bound in each
    shapes: list  # cells of each along each axis
    members: float  # components in a cell, in the fullest level


def spans_of(system: System, list_range: float) -> list[float]:
    """Return the lengths that reference points are fractions of."""
    return [
        edge if wraps else edge + list_range for edge, wraps in zip(system.box, system.periodic, strict=True)
    ]


def shape_of(spans, side: float, stretch) -> tuple[int, ...]:
    """Return how many cells, no narrower than ``side`` times the ``stretch`` of each axis, fit along it."""
    return tuple(max(int(span / (side * each)), 1) for span, each in zip(spans, stretch, strict=True))


def bounds_of(system: System, list_range: float) -> np.ndarray:
    """Return the radii of the bounds, (n,): sizes and margins."""
    assert system.reaches is not None
    return system.reaches + 0.5 * (list_range - system.diameter) * system.paces


def size_classes_of(system: System, list_range: float) -> SizeClasses:
    """Sort components of several sizes into levels."""
    bound = bounds_of(system, list_range)
    octaves, levels = np.unique(np.floor(np.log2(bound.max() / bound)), return_inverse=True)
    reaches = [float(bound[levels == k].max()) for k in range(len(octaves))]
    spans = spans_of(system, list_range)
    shapes = [shape_of(spans, 2.0 * each, system.listed_stretch) for each in reaches]
    members = [np.count_nonzero(levels == k) / math.prod(shapes[k]) for k in range(len(octaves))]
    return SizeClasses(levels, reaches, shapes, max(members))


def cells_around(levels: SizeClasses, spans, stretch) -> list:
    """Return how many cells to look to either side: for one of a level, in the grid of another, by axis."""
    # A hair more than the sum of two bounds, so that rounding does not lose a cell.
    hair = 1.0 + 2.0**-30
    return [
        [
            [
                math.ceil((one + other) * hair * size / span * each)
                for span, size, each in zip(spans, shape, stretch, strict=True)
            ]
            for other, shape in zip(levels.reaches, levels.shapes, strict=True)
        ]
        for one in levels.reaches
    ]


def starts_of(bound: np.ndarray, system: System, extra: int) -> np.ndarray:
    """Return where the lists begin, each with room for the neighbours expected, and ``extra`` more."""
    dimension = system.dimension
    radii, inverse, numbers = np.unique(bound, return_inverse=True, return_counts=True)
    if len(radii) > 64:
        edges = np.quantile(bound, np.arange(1, 65) / 64.0)
        inverse = np.minimum(np.searchsorted(edges, bound), 63)
        radii, numbers = edges, np.bincount(inverse, minlength=64)
    density = unit_ball_volume(dimension) / math.prod(system.box)
    listed = density * ((radii[:, None] + radii[None, :]) ** dimension) @ numbers
    capacities = np.ceil(listed + 2.0 * np.sqrt(listed)).astype(np.int64) + extra
    capacities = np.minimum(capacities, max(system.n - 1, 1))
    return np.concatenate([[0], np.cumsum(capacities[inverse])]).astype(np.int64)
