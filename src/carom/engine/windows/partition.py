"""How the cells of a neighbour scheme are divided among parts of the box."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from carom.engine.neighbors.lists import Lists
from carom.engine.neighbors.sectors import Sectors
from carom.engine.windows.shares import ABSENT, EDGE, OWN, RIM, ZONE


class Layout(NamedTuple):
    """Where the cells are."""

    centers: np.ndarray
    """Centre of each cell, (cells, d) [length]."""
    spans: np.ndarray
    """Length along each axis after which cells repeat, (d,); infinite along an axis with walls [length]."""
    zone: np.ndarray
    """How far a part can touch beyond the centres of its own cells along each axis, (d,) [length]."""
    edges: np.ndarray
    """Edges of the box, (d,) [length]."""


def layout_of(neighbors: Lists | Sectors, box, periodic) -> Layout:
    """Return where the cells of a neighbour scheme are."""
    edges = np.array(box)
    if isinstance(neighbors, Sectors):
        shapes, lengths = [np.array(neighbors.shape)], edges
        zone = np.array(neighbors.sides)
    else:
        shapes = list(neighbors.grid.shape)
        bits = min(32, 64 // len(edges))
        lengths = np.array(neighbors.grain) * 2.0**bits
        bounds = neighbors.bounds
        reach = math.sqrt(bounds.square) if hasattr(bounds, "square") else 2.0 * float(bounds.largest.max())
        zone = reach + np.max([lengths / shape for shape in shapes], axis=0)
    centers = np.concatenate([_centers(shape, lengths) for shape in shapes])
    spans = np.where(periodic, lengths, math.inf)
    return Layout(centers, spans, zone * (1.0 + 1e-6), edges)


def _centers(shape, lengths) -> np.ndarray:
    """Return the centres of the cells of a grid, (cells, d) [length]."""
    along = [(np.arange(size) + 0.5) / size * length for size, length in zip(shape, lengths, strict=True)]
    return np.stack(np.meshgrid(*along, indexing="ij"), axis=-1).reshape(-1, len(along))


def cuts(parts: int, edges, depth) -> tuple[int, ...]:
    """Return the number of pieces of each axis for which parts with rims of this ``depth`` are smallest."""
    dimension = len(edges)
    best, least = (parts,) + (1,) * (dimension - 1), math.inf
    for pieces in itertools.product(range(1, parts + 1), repeat=dimension):
        if math.prod(pieces) != parts:
            continue
        volume = 1.0
        for edge, piece, far in zip(edges, pieces, depth, strict=True):
            volume *= edge if piece == 1 else min(edge / piece + 2.0 * far, edge)
        if volume < least:
            best, least = pieces, volume
    return best


class Partition(NamedTuple):
    """The owner of each cell, and the role of each cell for each part."""

    owners: np.ndarray
    """Part that owns each cell, (cells,) int64."""
    flags: np.ndarray
    """What each cell is to each part, (parts, cells) uint8."""
    stages: np.ndarray
    """Stage after which each cell no longer matters, ``STAGES`` if it always does, (parts, cells) uint8."""


STAGES = 4
"""Stages of a window: after each, what has become too far away from a part to matter is given up."""


def share_out(layout: Layout, parts: int, depth: float, least: float = 0.0) -> Partition:
    """Return a partition of the cells.

    The rim of a part reaches ``depth`` beyond its zone when a window begins, and ``least`` when it ends
    [length].
    """
    cells, dimension = layout.centers.shape
    pieces = cuts(parts, layout.edges, layout.zone + depth)
    owners = np.zeros(cells, np.int64)
    for axis in range(dimension):
        place = np.floor(layout.centers[:, axis] / layout.edges[axis] * pieces[axis]).astype(np.int64)
        owners = owners * pieces[axis] + np.clip(place, 0, pieces[axis] - 1)
    flags = np.empty((parts, cells), np.uint8)
    stages = np.empty((parts, cells), np.uint8)
    # Depth of the rim in each stage.
    depths = least + (depth - least) * (1.0 - np.arange(STAGES) / STAGES)
    for part, place in enumerate(itertools.product(*[range(piece) for piece in pieces])):
        beyond = np.full(cells, -math.inf)
        for axis in range(dimension):
            if pieces[axis] == 1:
                continue
            width = layout.edges[axis] / pieces[axis]
            away = np.abs(layout.centers[:, axis] - (place[axis] + 0.5) * width)
            away = np.minimum(away, np.abs(layout.spans[axis] - away)) - 0.5 * width
            beyond = np.maximum(beyond, away - layout.zone[axis])
        flags[part] = np.where(beyond <= 0.0, ZONE, np.where(beyond <= depth, RIM, ABSENT))
        flags[part, owners == part] = OWN
        stages[part] = np.sum(beyond[:, None] <= depths, axis=1)
    for part in range(parts):
        flags[part, (owners == part) & (flags == ZONE).any(axis=0)] = EDGE
    return Partition(owners, flags, stages)
