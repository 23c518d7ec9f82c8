"""The neighbour scheme of a run, empty, and the boundary that goes with it."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.engine.images import NearestImage, SectorImage
from carom.engine.neighbors.bounds import EqualBounds, GrowingBounds, UnequalBounds
from carom.engine.neighbors.choice import Scheme
from carom.engine.neighbors.everybody import make_everybody
from carom.engine.neighbors.grid import make_grid
from carom.engine.neighbors.levels import bounds_of, cells_around, levels_of, shape_of, spans_of, starts_of
from carom.engine.neighbors.lists import Lists, make_lists
from carom.engine.neighbors.pairs import make_pairs
from carom.engine.neighbors.sectors import make_sectors
from carom.engine.neighbors.sides import HAIR
from carom.engine.pair_steps import SteppedImage, make_steps
from carom.engine.requirements import Contents

SLACK = 1.0 - 2.0**-20
"""Flights end this fraction of the margin, or of the slack, early, so that rounding cannot hide a contact
behind the end of a list, or two sectors away.
"""


def build_neighbors(scheme: Scheme, contents: Contents, pair):
    """Return the empty neighbour scheme and the boundary that goes with it."""
    edges = tuple(float(edge) for edge in contents.box)
    # Along an axis with walls nothing is an image of anything: an inverse of zero rounds to no box at all.
    inverse = tuple(
        1.0 / edge if wraps else 0.0 for edge, wraps in zip(edges, contents.periodic, strict=True)
    )
    if scheme.kind == "lists":
        lists = _build_lists(scheme, contents, pair)
        if lists.steps is not None:
            return lists, SteppedImage(edges, inverse, lists.steps.bits)
        return lists, NearestImage(edges, inverse)
    if scheme.kind == "all":
        number = np.float32 if contents.single else np.float64
        everybody = make_everybody(contents.n, edges, contents.diameter, scheme.span, number)
        return everybody, NearestImage(edges, inverse)
    if scheme.kind == "pairs":
        return make_pairs(contents.n, scheme.span), NearestImage(edges, inverse)
    slacks = slacks_of(scheme, contents)
    spare = _spare(scheme, contents, slacks)
    sectors = make_sectors(contents.n, edges, scheme.shape, scheme.cell_capacity, slacks, spare)
    if _is_wide(scheme, contents):
        return sectors, NearestImage(edges, inverse)
    return sectors, SectorImage(
        # What is seen through a wall is so far away that a wall is met before it.
        tuple(edge if wraps else 4.0 * edge for edge, wraps in zip(edges, contents.periodic, strict=True)),
        inverse,
        sectors.shape,
        sectors.place,
        sectors.turn,
        sectors.digits,
        (len(sectors.digits) - 1).bit_length(),
    )


def _is_wide(scheme: Scheme, contents: Contents) -> bool:
    """Tell whether two neighbouring sectors hold no two components half a box apart."""
    return all(size >= 4 or not wraps for size, wraps in zip(scheme.shape, contents.periodic, strict=True))


def slacks_of(scheme: Scheme, contents: Contents) -> list[float]:
    """Return how far a component may be beyond its sector along each axis [length].

    Two that touch are in neighbouring sectors as long as a sector is a diameter and two slacks wide.
    Components that grow need that room, and beyond a wall of the box there is nothing. Small ones have more
    (:func:`_spare`).
    """
    slacks = [0.0] * contents.dimension
    if _is_wide(scheme, contents) and contents.rates is None:
        for axis, (edge, size) in enumerate(zip(contents.box, scheme.shape, strict=True)):
            if contents.periodic[axis]:
                room = 0.5 * (edge / size - contents.diameter * (1.0 + HAIR))
                # The images of neighbours must be told apart as before.
                slacks[axis] = max(SLACK * min(room, 0.25 * edge - edge / size), 0.0)
    return slacks


def _spare(scheme: Scheme, contents: Contents, slacks: list[float]) -> np.ndarray | None:
    """Return how much more slack each component has than the largest, (n + 1,) [length], or None where all
    have the same: by as much as its radius is smaller.
    """
    radii = contents.radii
    if not contents.by_radii or radii is None or contents.contact is not None or contents.rates is not None:
        return None
    rooms = [
        0.25 * edge - edge / size - slack
        for edge, size, slack in zip(contents.box, scheme.shape, slacks, strict=True)
        if slack > 0.0
    ]
    spare = np.minimum(0.5 * contents.diameter - radii, min(rooms, default=0.0))
    return contents.particles.with_ghost(SLACK * spare, np.float32)


def _build_lists(scheme: Scheme, contents: Contents, pair) -> Lists:
    """Return empty lists."""
    n, dimension = contents.n, contents.dimension
    sizes = contents.reaches
    # Reference points beyond a wall are no neighbours: a stretched axis keeps its two ends apart.
    spans = spans_of(contents, scheme.reach)
    if sizes is None:
        margin = 0.5 * (scheme.reach - contents.diameter)
        bounds: Any = EqualBounds(scheme.reach**2, margin * SLACK, scheme.capacity)
        longest, words = scheme.capacity, n * scheme.capacity
        shapes = [shape_of(spans, scheme.reach)]
        around = [[[1] * dimension]]
    else:
        bound = bounds_of(contents, scheme.reach)
        levels = levels_of(contents, scheme.reach)
        shapes = levels.shapes
        around = cells_around(levels, spans)
        starts = starts_of(bound, contents, scheme.capacity)
        longest, words = int(np.diff(starts).max()), int(starts[-1])
        ghostly = contents.particles.with_ghost(bound)
        marks = contents.particles.with_ghost(levels.levels, np.uint8)
        largest = np.array(levels.reaches)
        if contents.rates is not None:
            bounds = GrowingBounds(
                ghostly, pair.radii, pair.rates, starts, marks, len(shapes), largest, SLACK
            )
        else:
            margins = contents.particles.with_ghost(bound - sizes) * SLACK
            bounds = UnequalBounds(ghostly, margins, starts, marks, len(shapes), largest)
    steps = make_steps(contents.interaction, contents.particles)
    grid = make_grid(shapes, around)
    return make_lists(n, spans, bounds, grid, scheme.cell_capacity, words, longest, steps)
