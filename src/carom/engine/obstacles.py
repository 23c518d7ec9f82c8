"""What is fixed: the one-component interactions, the paper's partners N + k.

Obstacles are numbered, and nested in a chain, so that the compiler knows the type of each. The engine asks
when a component touches one (``encounter``) and for the normal there (``outward``). One is *live* that moves,
loses energy or has a memory: its value has ``live``.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from carom.compiling import registry
from carom.compiling.registry import Questions
from carom.engine.advance import place_at
from carom.engine.obstacle_grid import soonest_in_cells
from carom.engine.tangential_impulse import rub_obstacle
from carom.models.interfaces.memory import ROOM, kept, remembers
from carom.models.interfaces.obstacle import LIVE, rebound
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.walls import wall_normal, yields
from carom.models.obstacles.cells import CROWD_FROM, together


class Link(Questions):
    """A list of obstacles that types can walk along: links of one kind each. These are the end's answers."""

    def soonest_link(self, obstacles, model, size, rate, every, now, sight):
        """Return the time until a component touches one of a chain of obstacles, and its number."""
        return NEVER, -1

    def normal_along(self, obstacles, boundary, number):
        """Put the normal of the obstacle of that number into the room for an image, if it is in the chain."""
        return

    def strike(self, model, state, i, number, now):
        """Replace the room's velocity by that after the contact with an obstacle, and find its normal.

        It is elastic where the number is none of a chain of single obstacles: a wall of the box, or one of a
        crowd.
        """
        there = model.obstacles
        rebound(model.motion, there.v, there.image, model.pair.growth_of(i))

    def age_link(self, duration):
        """Refer the times that obstacles of a chain remember to the start of the next epoch."""
        return


class End(Link):
    """The end of a chain."""

    last: bool = True  # always true: an empty tuple would count as false


class Chain(Link):
    """Obstacles of one kind."""

    head: tuple  # obstacles of one kind
    number: int  # number of the first of them
    tail: Any  # the rest, a link

    def soonest_link(self, obstacles, model, size, rate, every, now, sight):
        best, number = self.tail.soonest_link(obstacles, model, size, rate, every, now, sight)
        k = 0
        while k < len(self.head):  # a range would be written out
            t = soonest_image(self.head[k], obstacles, model, size, rate, every, now)
            if t < best:
                best = t
                number = self.number + k
            k += 1
        return best, number

    def normal_along(self, obstacles, boundary, number):
        self.tail.normal_along(obstacles, boundary, number)
        k = number - self.number
        if 0 <= k < len(self.head):
            store_normal(self.head[k], obstacles, boundary)

    def strike(self, model, state, i, number, now):
        k = number - self.number
        if 0 <= k < len(self.head):
            obstacle, there, weight = self.head[k], model.obstacles, model.pair.mass_of(i)
            obstacle.at_time(now)
            store_normal(obstacle, there, model.boundary)
            rate = model.pair.growth_of(i)
            obstacle.recoil(model.motion, i, weight, there.x, there.v, there.image, rate, now)
            rub_obstacle(obstacle, model.impact, model, state, i, now)
        else:
            self.tail.strike(model, state, i, number, now)

    def age_link(self, duration):
        self.tail.age_link(duration)
        k = 0
        while k < len(self.head):
            self.head[k].shift_epoch(duration)
            k += 1


class Crowd(Link):
    """Many obstacles of one kind, in arrays: each in a tuple would be compiled, minutes for hundreds."""

    head: Any  # a model of all of them, which answers ``members`` and ``member``
    number: int  # number of the first of them
    tail: Any  # the rest, a link
    grid: Any = None
    """Cells in which they are looked up (:mod:`carom.engine.obstacle_grid`), or None where all are asked."""

    def soonest_link(self, obstacles, model, size, rate, every, now, sight):
        best, number = self.tail.soonest_link(obstacles, model, size, rate, every, now, sight)
        t, k = soonest_member(self.grid, self.head, obstacles, model, size, rate, every, now, best, sight)
        return (t, self.number + k) if t < best else (best, number)

    def normal_along(self, obstacles, boundary, number):
        self.tail.normal_along(obstacles, boundary, number)
        k = number - self.number
        if 0 <= k < self.head.members():
            store_normal(self.head.member(k), obstacles, boundary)

    def strike(self, model, state, i, number, now):
        k = number - self.number
        if 0 <= k < self.head.members():
            store_normal(self.head.member(k), model.obstacles, model.boundary)
        self.tail.strike(model, state, i, number, now)

    def age_link(self, duration):
        self.tail.age_link(duration)


HAIR = 2.0**-40  # part of a time by which it may be rounded


class Sight(NamedTuple):
    """How far a component looks."""

    since: float  # time from the moment from which its contacts are computed to the present
    until: float  # time from there up to which they are wanted


class Obstacles(NamedTuple):
    """Everything fixed, by number: two for every axis (its walls, if there are any), then one an obstacle."""

    walls: Any
    """The walls of the box, or None."""
    chain: Link
    hits: Annotated[np.ndarray, kept()]
    """Collisions with each, (numbers,) int64."""
    impulse: Annotated[np.ndarray, kept(-1)]
    """Momentum that each took up along its normal, (numbers,) float64."""
    x: Annotated[np.ndarray, ROOM]
    """Room for a position in the box, (d,)."""
    image: Annotated[np.ndarray, ROOM]
    """Room for one of its images, (d,)."""
    v: Annotated[np.ndarray, ROOM]
    """Room for a velocity, (d,)."""
    live: Any = None
    """What live ones add up to, :class:`ObstacleWork`, or None."""
    timing: Any = None
    """How the time of a contact is computed (:mod:`carom.engine.one_body`); None: from now."""


class ObstacleWork(NamedTuple):
    """What live obstacles add up to."""

    work: Annotated[np.ndarray, kept(-2)]
    """Energy that each wall and obstacle gave to components, (numbers,) float64."""
    energy: Annotated[np.ndarray, ROOM]
    """That of the contact now, (1,) float64."""


def is_live(model: Any) -> bool:
    """Return whether the model of an obstacle remembers something, or answers one of these questions."""
    return remembers(model) or any(registry.answers(question, type(model)) for question in LIVE)


def make_obstacles(dimension: int, walls, models) -> Obstacles | None:
    """Return the obstacles of a scene, or None if there are none."""
    if walls is None and not models:
        return None
    kinds: dict[tuple, list] = {}
    for model in models:
        kinds.setdefault(kind_of(model), []).append(model)
    total = 2 * dimension + len(models)
    number = total
    chain: Link = End()
    for group in reversed(kinds.values()):
        number -= len(group)
        crowd = together(group) if len(group) >= CROWD_FROM else None
        chain = Chain(tuple(group), number, chain) if crowd is None else Crowd(crowd, number, chain)
    x, image, v = (np.zeros(dimension) for _ in range(3))
    live = ObstacleWork(np.zeros(total), np.zeros(1)) if any(map(is_live, models)) else None
    return Obstacles(walls, chain, np.zeros(total, np.int64), np.zeros(total), x, image, v, live)


def kind_of(model) -> tuple:
    """Return the type of a model, and those of the models in it: what the compiler tells apart."""
    return type(model), *(kind_of(part) for part in model if hasattr(part, "_fields"))


def numbers_of(periodic, models) -> list[int]:
    """Return the numbers of walls, of axes that are not periodic, and of obstacles, in the scene's order."""
    walls = [2 * axis + side for axis, wraps in enumerate(periodic) if not wraps for side in (0, 1)]
    kinds: dict[tuple, list[int]] = {}  # they were put together by kind
    for k, model in enumerate(models):
        kinds.setdefault(kind_of(model), []).append(k)
    order = [k for group in kinds.values() for k in group]
    return walls + [2 * len(periodic) + k for k in np.argsort(order).tolist()]


def soonest(obstacles, model, state, i, now, every, until):
    """Return the time until component i touches an obstacle, and the number of that obstacle, or -1.

    Without ``every`` only those in every image of the box are looked at: they are seen as far as the next
    images, and looked for again whenever i has gone as far as its neighbors reach. Contacts after ``until``
    need not be found.
    """
    place_at(model, state, i, now, obstacles.x, obstacles.v)
    size = model.pair.radius_of(i, now)
    rate = model.pair.growth_of(i)
    best = NEVER
    number = -1
    if every:
        best, number = model.motion.wall_meeting(obstacles.walls, obstacles.x, obstacles.v, size, rate)
    sight = Sight(max(state.clock[0].now - now, 0.0), until - now + HAIR * until)
    t, k = obstacles.chain.soonest_link(obstacles, model, size, rate, every, now, sight)
    if t < best or yields(obstacles.walls, model.motion, obstacles.x, obstacles.v, size, rate, t):
        best = t
        number = k
    return best, number


def soonest_member(grid, crowd, obstacles, model, size, rate, every, now, before, sight):
    """Return the time until one of a crowd is touched, if below ``before``, and which."""
    if grid is not None:
        return soonest_in_cells(grid, crowd, obstacles, model, size, rate, now, before, sight)
    best = NEVER
    number = -1
    for k in range(crowd.members()):
        t = soonest_image(crowd.member(k), obstacles, model, size, rate, every, now)
        if t < best:
            best = t
            number = k
    return best, number


def soonest_image(obstacle, obstacles, model, size, rate, every, now):
    """Return the time until a component touches an obstacle, in any image of the box in which it stands."""
    boundary = model.boundary
    t = NEVER
    if obstacle.is_periodic():
        code = 0
        while code < 3 ** len(boundary.edges):  # a range would be written out in the plane
            digits = code
            code += 1
            for axis in range(len(boundary.edges)):
                edge = boundary.edges[axis] if boundary.inverse[axis] > 0.0 else 0.0
                # The anchor may have been given in another box.
                turns = np.floor(obstacle.anchor(axis) * boundary.inverse[axis])
                obstacles.image[axis] = obstacles.x[axis] + (turns + (digits % 3 - 1)) * edge
                digits //= 3
            t = min(t, model.motion.meeting(obstacle, obstacles.image, obstacles.v, size, rate, now))
    elif every:
        t = model.motion.meeting(obstacle, obstacles.x, obstacles.v, size, rate, now)
    return t


def reflect_component(model, state, i, number, now):
    """Throw component i, which is up to date, back from the obstacle of that number; return the momentum."""
    obstacles = model.obstacles
    place_at(model, state, i, now, obstacles.x, obstacles.v)
    for axis in range(len(model.boundary.edges)):
        obstacles.image[axis] = wall_normal(obstacles.walls, number, axis)
    momentum = reflect(obstacles.live, model, state, i, number, now)
    obstacles.hits[number] += 1
    obstacles.impulse[number] += momentum
    return momentum


def reflect(live, model, state, i, number, now):
    """Give i its velocity after the contact; return the momentum along the normal."""
    obstacles = model.obstacles
    me = state.rows[i]
    if live is None:
        obstacles.chain.normal_along(obstacles, model.boundary, number)
        speed = 0.0
        for axis in range(len(model.boundary.edges)):
            speed += obstacles.image[axis] * me.v[axis]
        change = model.motion.rebound_speed(model.pair.growth_of(i) - speed)
        model.motion.push(change, me.v, obstacles.image)
        return model.pair.mass_of(i) * change
    obstacles.chain.strike(model, state, i, number, now)
    along = 0.0
    energy = 0.0
    for axis in range(len(model.boundary.edges)):
        change = obstacles.v[axis] - me.v[axis]
        along += obstacles.image[axis] * change
        energy += 0.5 * change * (obstacles.v[axis] + me.v[axis])
        me.v[axis] = obstacles.v[axis]
    weight = model.pair.mass_of(i)
    live.energy[0] = weight * energy
    live.work[number] += weight * energy
    return weight * along


def gained(live, momentum, rate):
    """Return the energy that a contact with an obstacle gave to a component that grows at this rate."""
    return momentum * rate if live is None else live.energy[0]


def store_normal(obstacle, obstacles, boundary):
    """Put the normal of an obstacle that is touched into the room for an image."""
    if obstacle.is_periodic():  # the image that is touched is the nearest one
        for axis in range(len(boundary.edges)):
            turns = np.rint((obstacles.x[axis] - obstacle.anchor(axis)) * boundary.inverse[axis])
            obstacles.x[axis] -= turns * boundary.edges[axis]
    for axis in range(len(boundary.edges)):
        obstacles.image[axis] = obstacle.outward(obstacles.x, axis)


def age_obstacles(obstacles, duration):
    """Refer the times that obstacles remember to the start of the next epoch, if there are live ones."""
    if obstacles is not None:
        age_live(obstacles.live, obstacles.chain, duration)


def age_live(live, chain, duration):
    """Do so, if there are live ones."""
    if live is not None:
        chain.age_link(duration)


def spared_by_number(chain: Any) -> dict[int, tuple[int, int]]:
    """Return, by obstacle, contacts that lost nothing, and those thrown faster than they came."""
    found: dict[int, tuple[int, int]] = {}
    while not isinstance(chain, End):
        for k, model in enumerate(chain.head if isinstance(chain, Chain) else ()):
            if hasattr(model, "spared"):
                found[chain.number + k] = (int(model.spared[0]), int(model.spared[1]))
        chain = chain.tail
    return found
