"""The neighbor scheme of a run, empty, and the boundary that goes with it."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.engine.boundary import NearestImage, SectorImage
from carom.engine.neighbors.all_pairs import make_everybody, make_pairs
from carom.engine.neighbors.bounds import EqualBounds, UnequalBounds
from carom.engine.neighbors.grid import make_grid, make_tilt_window
from carom.engine.neighbors.lists import NeighborLists, make_lists
from carom.engine.neighbors.plan import NeighborPlan
from carom.engine.neighbors.sectors import Sectors, make_sectors
from carom.engine.neighbors.sizes import (
    SECTOR_MARGIN,
    bounds_of,
    cells_around,
    shape_of,
    size_classes_of,
    spans_of,
    starts_of,
)
from carom.engine.pair_steps import SteppedImage, make_steps
from carom.engine.system import System

SLACK = 1.0 - 2.0**-20
"""Flights end this fraction of the margin, or of the slack, early, so that rounding cannot hide a contact
behind the end of a list, or two sectors away.
"""


def edges_of(system: System) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the edges of the box, and their inverses."""
    edges = tuple(float(edge) for edge in system.box)
    # Along an axis with walls nothing is an image of anything: an inverse of zero rounds to no box at all.
    inverse = tuple(1.0 / edge if wraps else 0.0 for edge, wraps in zip(edges, system.periodic, strict=True))
    return edges, inverse


def images_in(sectors: Sectors, system: System) -> SectorImage:
    """Return the boundary of a small box, in which an image is the one seen in a sector."""
    edges, inverse = edges_of(system)
    return SectorImage(
        # What is seen through a wall is so far away that a wall is met before it.
        tuple(edge if wraps else 4.0 * edge for edge, wraps in zip(edges, system.periodic, strict=True)),
        inverse,
        sectors.shape,
        sectors.cell,
        sectors.wraps,
        sectors.digits,
        (len(sectors.digits) - 1).bit_length(),
    )


def build_neighbors(scheme: NeighborPlan, system: System, pair, motion):
    """Return the empty neighbor scheme and the boundary that goes with it."""
    edges, inverse = edges_of(system)
    if scheme.kind == "lists":
        lists = _build_lists(scheme, system, pair, motion)
        if lists.steps is not None:
            return lists, SteppedImage(edges, inverse, lists.steps.bits)
        return lists, NearestImage(edges, inverse)
    if scheme.kind == "all":
        number = np.float32 if system.single else np.float64
        everybody = make_everybody(system.n, edges, system.diameter, scheme.span, number)
        return everybody, NearestImage(edges, inverse)
    if scheme.kind == "pairs":
        return make_pairs(system.n, scheme.span), NearestImage(edges, inverse)
    slacks = slacks_of(scheme, system)
    extra_slack = _extra_slack(scheme, system, slacks)
    sectors = make_sectors(system.n, edges, scheme.shape, scheme.cell_capacity, slacks, extra_slack)
    if _is_wide(scheme, system):
        return sectors, NearestImage(edges, inverse)
    return sectors, images_in(sectors, system)


def _is_wide(scheme: NeighborPlan, system: System) -> bool:
    """Tell whether two neighboring sectors hold no two components half a box apart."""
    return all(size >= 4 or not wraps for size, wraps in zip(scheme.shape, system.periodic, strict=True))


def slacks_of(scheme: NeighborPlan, system: System) -> list[float]:
    """Return how far a component may be beyond its sector along each axis [length].

    Two that touch are in neighboring sectors if a sector is a diameter and two slacks wide. Growth needs
    that room; beyond a wall of the box there is nothing. Small components have more (:func:`_extra_slack`).
    """
    slacks = [0.0] * system.dimension
    if _is_wide(scheme, system) and system.rates is None:
        for axis, (edge, size) in enumerate(zip(system.box, scheme.shape, strict=True)):
            if system.periodic[axis]:
                contact = system.diameter * system.stretch[axis]
                free = 0.5 * (edge / size - contact * (1.0 + SECTOR_MARGIN))
                # The images of neighbors must be told apart as before.
                slacks[axis] = max(SLACK * min(free, 0.25 * edge - edge / size), 0.0)
    return slacks


def _extra_slack(scheme: NeighborPlan, system: System, slacks: list[float]) -> np.ndarray | None:
    """Return how much more slack each has than the largest, as its radius is smaller, (n + 1,); or None."""
    radii = system.radii
    if not system.by_radii or radii is None or system.scene.contact is not None or system.rates is not None:
        return None
    most_free = [
        0.25 * edge - edge / size - slack
        for edge, size, slack in zip(system.box, scheme.shape, slacks, strict=True)
        if slack > 0.0
    ]
    extra_slack = np.minimum(0.5 * system.diameter - radii, min(most_free, default=0.0))
    return system.particles.with_padding(SLACK * extra_slack, np.float32)


def _build_lists(scheme: NeighborPlan, system: System, pair, motion) -> NeighborLists:
    """Return empty lists."""
    n, dimension = system.n, system.dimension
    sizes = system.reaches
    # Reference points beyond a wall are no neighbors: a stretched axis keeps its two ends apart.
    spans = spans_of(system, scheme.list_range)
    if sizes is None:
        skin = 0.5 * (scheme.list_range - system.diameter)
        bounds: Any = EqualBounds(scheme.list_range**2, skin * SLACK, scheme.capacity)
        longest, refs = scheme.capacity, n * scheme.capacity
        shapes = [shape_of(spans, scheme.list_range, system.listed_stretch)]
        around = [[[1] * dimension]]
    else:
        bound = bounds_of(system, scheme.list_range)
        levels = size_classes_of(system, scheme.list_range)
        shapes = levels.shapes
        around = cells_around(levels, spans, system.listed_stretch)
        starts = starts_of(bound, system, scheme.capacity)
        longest, refs = int(np.diff(starts).max()), int(starts[-1])
        padded = system.particles.with_padding(bound)
        marks = system.particles.with_padding(levels.levels, np.uint8)
        largest = np.array(levels.reaches)
        rest = starts, marks, len(shapes), largest
        if system.rates is None:
            bounds = UnequalBounds(padded, system.particles.with_padding(bound - sizes) * SLACK, *rest)
        else:
            bounds = UnequalBounds(padded, padded, *rest, pair.radii, pair.rates, SLACK)
    pair_steps = make_steps(system.interaction, system.particles)
    grid = make_grid(shapes, around)
    window = make_tilt_window(motion)
    return make_lists(n, spans, bounds, grid, scheme.cell_capacity, refs, longest, pair_steps, window)
