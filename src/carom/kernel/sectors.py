"""Sectors: the paper's grid of cells, at least a diameter wide; a component looks into the 3^d around its
own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.kernel.boundary import word_of
from carom.kernel.constants import NEVER
from carom.kernel.dispatch import inner
from carom.kernel.lookahead import ask_candidates, ask_rows, prefetch
from carom.kernel.motion import position
from carom.kernel.neighbors import (
    Cells,
    candidates,
    enter_cell,
    leave_cell,
    make_cells,
    settle,
    transit,
    transit_time,
    wrapped,
)

STEP = 8
"""Members of a sector copied in one go."""


class Sectors(NamedTuple):
    """Components by sector."""

    cells: Cells
    sides: tuple
    """Sides of a sector [length]."""
    place: np.ndarray
    """Sector of each component along each axis, (n + 1, d) int32; the ghost has one, too."""
    turn: np.ndarray
    """Boxes from the component's position, which is not wrapped in flight, to that sector, (n + 1, d)
    int32.
    """
    faces: np.ndarray
    """Neighbouring sectors that come into view when a component moves down or up along an axis, (2 d, 3^(d
    - 1)) int64.
    """
    words: np.ndarray
    """Room for the candidates of two components, uint32."""


def make_sectors(n: int, edges, shape, capacity: int) -> Sectors:
    """Return empty sectors: ``shape`` of them along the edges, ``capacity`` components in each at most."""
    dimension = len(shape)
    cells = make_cells(shape, -(-capacity // STEP) * STEP)
    return Sectors(
        cells=cells,
        sides=tuple(edge / size for edge, size in zip(edges, shape, strict=True)),
        place=np.zeros((n + 1, dimension), np.int32),
        turn=np.zeros((n + 1, dimension), np.int32),
        faces=np.array(
            [np.flatnonzero(cells.digits[:, k // 2] == 2 * (k % 2) - 1) for k in range(2 * dimension)]
        ),
        words=np.zeros(2 * (len(cells.digits) * cells.members.shape[1] + STEP), np.uint32),
    )


@inner
def sector_near(sectors, i, code):
    """Return the sector at offset ``code`` from the one that holds component i."""
    cell = np.int64(0)
    for axis in range(len(sectors.sides)):
        size = sectors.cells.shape[axis]
        place = np.int64(sectors.place[i, axis]) + sectors.cells.digits[code, axis]
        place = size - 1 if place < 0 else (0 if place >= size else place)
        cell = cell * size + place
    return np.uint64(cell)


@inner
def look_into(sectors, boundary, i, code, total):
    """Append the words of all in a neighbouring sector at ``total``; return where the next go.

    Members are copied eight at a time, whether so many are there or not: sectors hold a few each, and a loop
    over the right number would be mispredicted at every one.
    """
    cells = sectors.cells
    cell = sector_near(sectors, i, code)
    count = np.uint64(cells.counts[cell])
    for start in range(np.uint64(0), count, np.uint64(STEP)):
        for k in range(np.uint64(STEP)):
            word = word_of(boundary, np.int64(cells.members[cell, start + k]), np.int64(code))
            sectors.words[total + start + k] = word
    return total + count


@candidates.register
def _(neighbors: Sectors, boundary, i, half):
    begin = np.uint64(half * (len(neighbors.words) // 2))
    total = begin
    for code in range(np.uint64(len(neighbors.cells.digits))):
        total = look_into(neighbors, boundary, i, code, total)
    return neighbors.words, begin, np.int64(total - begin)


@inner
def next_face(sectors, motion, state, i, now):
    """Return the time until component i reaches a face of its sector, and the face: twice the axis, plus
    one for the upper.
    """
    row = state.rows[i]
    best = NEVER
    face = np.int64(0)
    for axis in range(len(sectors.sides)):
        v = row.v[axis]
        x = position(motion, axis, row.x[axis], v, now - row.t)
        up = np.int64(v > 0.0)
        place = np.int64(sectors.place[i, axis]) + sectors.cells.shape[axis] * np.int64(sectors.turn[i, axis])
        t = max((sectors.sides[axis] * (place + up) - x) / v, 0.0) if v != 0.0 else NEVER
        if t < best:
            best = t
            face = 2 * axis + up
    return best, face


@transit_time.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    return now + next_face(neighbors, motion, state, i, now)[0]


@transit.register
def _(neighbors: Sectors, motion, boundary, state, i, now):
    cells = neighbors.cells
    centre = np.uint64(len(cells.digits) // 2)
    face = next_face(neighbors, motion, state, i, now)[1]
    axis = face >> 1
    old = sector_near(neighbors, i, centre)
    place = np.int64(neighbors.place[i, axis]) + (1 if face & 1 else -1)
    if place < 0:
        place += cells.shape[axis]
        neighbors.turn[i, axis] -= 1
    elif place >= cells.shape[axis]:
        place -= cells.shape[axis]
        neighbors.turn[i, axis] += 1
    neighbors.place[i, axis] = place
    new = sector_near(neighbors, i, centre)
    total = np.uint64(0)
    done = True
    if new != old:  # one sector along this axis is its own neighbour
        done = enter_cell(cells, new, np.uint32(i))
        if done:
            leave_cell(cells, old, np.uint32(i))
    for k in range(np.uint64(neighbors.faces.shape[1])):
        total = look_into(neighbors, boundary, i, np.uint64(neighbors.faces[face, k]), total)
    return done, neighbors.words, np.uint64(0), np.int64(total)


@ask_candidates.register
def _(neighbors: Sectors, i):
    prefetch(neighbors.place, np.int64(i) * len(neighbors.sides))
    prefetch(neighbors.turn, np.int64(i) * len(neighbors.sides))


@ask_rows.register
def _(neighbors: Sectors, rows, i):
    return None


@wrapped.register
def _(neighbors: Sectors, i, axis, crossings):
    neighbors.turn[i, axis] -= np.int64(crossings)


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
            place = np.int64(np.floor(x / neighbors.sides[axis]))
            turn = place // cells.shape[axis]
            neighbors.place[i, axis] = place - turn * cells.shape[axis]
            neighbors.turn[i, axis] = turn
        if not enter_cell(cells, sector_near(neighbors, i, centre), np.uint32(i)):
            return False
    return True
