"""Crowds of obstacles in cells: a component asks only those whose cells its path passes until it looks again.

A contact is the one found by asking all; its time is rounded otherwise where it is found at another look.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import answers
from carom.engine.neighbors.bounds import EqualBounds
from carom.engine.neighbors.lists import NeighborLists
from carom.engine.neighbors.plan import NeighborPlan
from carom.engine.system import System
from carom.models.interfaces.particles import NEVER
from carom.models.motions.free_flight import FreeFlight
from carom.models.obstacles.balls import SolidBall
from carom.models.obstacles.box_walls import ROUNDING_MARGIN
from carom.models.obstacles.cells import cells_of


class Spheres(NamedTuple):
    """Spheres around the obstacles of a crowd, a hair larger than needed."""

    centers: np.ndarray  # (k, d) [length]
    radii: np.ndarray  # (k,) [length]


class Grid(NamedTuple):
    """Cells of a crowd (:class:`carom.models.obstacles.cells.Cells`), and how far a path is followed."""

    shape: tuple
    sides: tuple
    starts: np.ndarray
    members: np.ndarray
    shifts: np.ndarray
    reach: tuple  # how far a component is followed along each axis, at most [length]
    spheres: Spheres | None  # one around each obstacle, or None for balls, which are spheres themselves
    cell: np.ndarray  # room for the place of a cell, (d,) int64
    turns: np.ndarray  # room for the boxes from that of the component to this cell, (d,) int64


def with_grids(chain: Any, scheme: NeighborPlan, system: System, neighbors: Any, pair: Any) -> Any:
    """Return a chain of obstacles whose crowds have cells, if flights are straight and radii known."""
    own = type(system.interaction).__module__.partition(".")[0] != "carom"
    own_radius = own and answers("radius_of", type(pair))
    if not hasattr(chain, "tail") or not isinstance(system.motion, FreeFlight) or own_radius:
        return chain
    tail = with_grids(chain.tail, scheme, system, neighbors, pair)
    if not hasattr(chain, "grid"):  # not of a crowd
        return chain._replace(tail=tail)
    particles = system.particles
    largest = float(particles.radii.max())
    if system.rates is not None:  # twice what they grow until another scheme is chosen
        largest += 2.0 * scheme.horizon * float(system.rates.max())
    low, high = chain.head.extent()
    cells = cells_of(low - largest, high + largest, system.box, system.periodic)
    spheres = None
    if not isinstance(chain.head, SolidBall.Crowd):  # type: ignore[attr-defined]
        hair = ROUNDING_MARGIN * max(system.box)
        spheres = Spheres(0.5 * (low + high), 0.5 * np.linalg.norm(high - low, axis=1) + hair)
    room = (np.zeros(system.dimension, np.int64) for _ in range(2))
    return chain._replace(tail=tail, grid=Grid(*cells, _reach(neighbors), spheres, *room))


def _reach(neighbors: Any) -> tuple[float, ...]:
    """Return how far a component may fly before it looks again, along each axis [length]."""
    if not isinstance(neighbors, NeighborLists):  # a slack is less than half of a sector
        return tuple(2.0 * side for side in neighbors.sides)
    bounds = neighbors.bounds
    equal = isinstance(bounds, EqualBounds)
    across = math.sqrt(bounds.square) if equal else 2.0 * float(bounds.bounds.max())
    return (across,) * len(neighbors.grid_step)


def soonest_in_cells(grid, crowd, obstacles, model, size, rate, now, before, sight):
    """Return the time until one of a crowd is touched, if below ``before``, and which."""
    boundary, x, v = model.boundary, obstacles.x, obstacles.v
    best = NEVER
    number = -1
    limit = NEVER
    for axis in range(len(grid.sides)):
        if v[axis] != 0.0:
            limit = min(limit, sight.since + grid.reach[axis] / abs(v[axis]))
    place_in(grid, obstacles, boundary)
    before = min(before, sight.until)
    going = True
    while going:
        cell = 0
        leaves = NEVER
        axis_out = 0
        way = 0
        for axis in range(len(grid.sides)):
            cell = cell * grid.shape[axis] + grid.cell[axis]
            if v[axis] != 0.0:
                up = v[axis] > 0.0
                ahead = grid.cell[axis] + grid.turns[axis] * grid.shape[axis] + up
                t = (ahead * grid.sides[axis] - x[axis]) / v[axis]
                if t < leaves:
                    leaves = t
                    axis_out = axis
                    way = 2 * up - 1
        for k in range(grid.starts[cell], grid.starts[cell + 1]):
            for axis in range(len(grid.sides)):
                edge = boundary.edges[axis] if boundary.inverse[axis] > 0.0 else 0.0
                turns = np.float64(grid.shifts[k, axis] - grid.turns[axis])
                obstacles.image[axis] = x[axis] + turns * edge
            who = grid.members[k]
            wanted = min(best, before, limit)
            if not in_reach(grid.spheres, who, obstacles.image, v, size, rate, wanted):
                continue
            t = model.motion.meeting(crowd.member(who), obstacles.image, v, size, rate, now)
            # Of two at one time, the first: as where all are asked.
            if t < best or (t == best and who < number):
                best = t
                number = who
        going = min(best, before) > leaves and leaves < limit
        if going:
            going = step_in(grid, boundary, axis_out, way)
    # What is farther away is found after the next look.
    return (best, number) if best <= limit else (NEVER, -1)


def place_in(grid, obstacles, boundary):
    """Put the cell of the component that is asked about into the room for it."""
    for axis in range(len(grid.sides)):
        cell = int(np.floor(obstacles.x[axis] / grid.sides[axis]))
        if boundary.inverse[axis] > 0.0:
            turns = cell // grid.shape[axis]
            grid.turns[axis] = turns
            grid.cell[axis] = cell - turns * grid.shape[axis]
        else:
            grid.turns[axis] = 0
            grid.cell[axis] = min(max(cell, 0), grid.shape[axis] - 1)


def step_in(grid, boundary, axis, way):
    """Go to the next cell along an axis, ``way`` up (1) or down (-1); False if there is none."""
    cell = grid.cell[axis] + way
    size = grid.shape[axis]
    if 0 <= cell < size:
        grid.cell[axis] = cell
        return True
    grid.cell[axis] = cell - way * size
    grid.turns[axis] += way
    return boundary.inverse[axis] > 0.0


def in_reach(spheres, who, x, v, radius, growth, until):
    """Tell whether a component may touch one of a crowd before a time; by default it may."""
    if spheres is None:
        return True
    distance = spheres.radii[who] + radius
    a = -growth * growth
    b = -growth * distance
    c = -distance * distance
    for axis in range(len(x)):
        r = x[axis] - spheres.centers[who, axis]
        a += v[axis] * v[axis]
        b += v[axis] * r
        c += r * r
    # The square of the gap is a t^2 + 2 b t + c. Is it 0 now, then, or at its least in between?
    if c <= 0.0 or a <= 0.0 or (a * until + 2.0 * b) * until + c <= 0.0:
        return True
    return b < 0.0 and b * b >= a * c and -b <= a * until
