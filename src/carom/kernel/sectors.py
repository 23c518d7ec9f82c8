"""Sectors: the paper's grid of cells, at least a diameter wide; a component looks into the 3^d around its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.boundary import word_of
from carom.kernel.constants import NEVER, TRANSIT
from carom.kernel.dispatch import inner
from carom.kernel.motion import position
from carom.kernel.neighbors import (
    Cells,
    candidates,
    enter_cell,
    fold,
    leave_cell,
    make_cells,
    settle,
    transit,
    transit_time,
    wrapped,
)


class Sectors(NamedTuple):
    """Components by sector."""

    cells: Cells
    sides: tuple
    """Sides of a sector [length]."""
    place: np.ndarray
    """Sector of each component along each axis, (n, d) int32; not wrapped while a flight lasts, as the position is not."""
    words: np.ndarray
    """Room for the candidates of two components, uint32."""


def make_sectors(n: int, edges, shape, capacity: int) -> Sectors:
    """Return empty sectors: ``shape`` of them along the edges, ``capacity`` components in each at most."""
    cells = make_cells(shape, capacity)
    return Sectors(
        cells,
        tuple(edge / size for edge, size in zip(edges, shape, strict=True)),
        np.zeros((n + 1, len(shape)), np.int32),  # the ghost has a place, too
        np.zeros(2 * (len(cells.digits) * capacity + 8), np.uint32),
    )


@inner
def cell_at(sectors, i, code):
    """Return the cell at offset ``code`` from the one that holds component i."""
    cells = sectors.cells
    cell = np.int64(0)
    for axis in range(len(cells.shape)):
        size = cells.shape[axis]
        cell = cell * size + fold(np.int64(sectors.place[i, axis]) + cells.digits[code, axis], size)
    return np.uint64(cell)


@candidates.register
def _(neighbors: Sectors, boundary, i, half):
    cells = neighbors.cells
    words = neighbors.words
    begin = np.uint64(half * (len(words) // 2))
    total = begin
    for code in range(np.uint64(len(cells.digits))):
        cell = cell_at(neighbors, i, code)
        for k in range(np.uint64(cells.counts[cell])):
            words[total] = word_of(boundary, np.int64(cells.members[cell, k]), np.int64(code))
            total += np.uint64(1)
    ghost = word_of(boundary, np.int64(len(neighbors.place) - 1), np.int64(0))
    for k in range(np.uint64(8)):
        words[total + k] = ghost
    return words, begin, (np.int64(total - begin) + 7) & ~7


@transit_time.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    row = state.rows[i]
    best = NEVER
    face = np.int64(0)
    for axis in range(len(neighbors.sides)):
        v = row.v[axis]
        x = position(motion, axis, row.x[axis], v, now - row.t)
        up = v > 0.0
        place = neighbors.place[i, axis]
        wall = neighbors.sides[axis] * (place + 1 if up else place)
        t = max((wall - x) / v, 0.0) if v != 0.0 else NEVER
        if t < best:
            best = t
            face = 2 * axis + (1 if up else 0)
    return now + best, TRANSIT - face


@transit.register
def _(neighbors: Sectors, motion, boundary, state, i, now, code):
    face = TRANSIT - np.int64(code)
    axis = face >> 1
    centre = np.uint64(len(neighbors.cells.digits) // 2)
    step = 1 if face & 1 else -1
    old = cell_at(neighbors, i, centre)
    neighbors.place[i, axis] += step
    new = cell_at(neighbors, i, centre)
    if new != old:  # one sector along this axis is its own neighbour
        if not enter_cell(neighbors.cells, new, np.uint32(i)):
            neighbors.place[i, axis] -= step
            return False
        leave_cell(neighbors.cells, old, np.uint32(i))
    return True


@wrapped.register
def _(neighbors: Sectors, i, axis, crossings):
    neighbors.place[i, axis] -= np.int64(crossings) * neighbors.cells.shape[axis]


@settle.register
def _(neighbors: Sectors, motion, boundary, state):
    cells = neighbors.cells
    now = state.clock[0].now
    centre = np.uint64(len(cells.digits) // 2)
    cells.counts[:] = 0
    for i in range(np.uint64(len(state.partner))):
        row = state.rows[i]
        for axis in range(len(neighbors.sides)):
            x = position(motion, axis, row.x[axis], row.v[axis], now - row.t)
            neighbors.place[i, axis] = np.int32(np.floor(x / neighbors.sides[axis]))
        if not enter_cell(cells, cell_at(neighbors, i, centre), np.uint32(i)):
            return False
    return True
