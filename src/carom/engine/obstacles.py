"""Walls and fixed bodies: the one-component interactions, the paper's partners N + k.

An obstacle is a ``NamedTuple`` for which functions are registered: ``encounter`` (when a component touches
it), ``outward`` (in which direction it is thrown back), ``repeated`` (whether it stands in every image of the
box) and ``anchor`` (around which point, if it does). Anyone's own obstacle does the same, from outside of
this package (docs/obstacles).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from carom.compiling.dispatch import generic, inner
from carom.engine.constants import NEVER
from carom.engine.images import in_box
from carom.engine.meeting import FAR
from carom.models.free_flight import position, velocity
from carom.models.hard_cores import growth, mass, radius


class Cushions(NamedTuple):
    """Hard walls at 0 and at the edge along the axes that are not periodic."""

    edges: tuple
    """Edges of the box [length]."""
    walled: tuple
    """1 for an axis with walls, 0 for a periodic one."""


class Plane(NamedTuple):
    """The half space ``normal . x >= offset`` is free."""

    normal: tuple
    """Unit vector into the free side."""
    offset: float
    """Distance from the origin along the normal [length]."""


class Ball(NamedTuple):
    """A solid ball, which stands in every image of the box."""

    center: tuple
    radius: float


class Sphere(NamedTuple):
    """The inside of a sphere is free."""

    center: tuple
    radius: float


class Cylinder(NamedTuple):
    """The inside of a cylinder along an axis is free."""

    axis: int
    """The coordinate along which it extends."""
    center: tuple
    """A point on its axis."""
    radius: float


@generic
def encounter(obstacle, x, v, radius, growth):
    """Return the time until a component touches the obstacle, not negative, or NEVER.

    Parameters
    ----------
    obstacle : model
        The obstacle.
    x, v : (d,) float64 arrays
        Position of the centre [length] and velocity.
    radius, growth : float
        Radius [length], and the rate at which it grows.

    Notes
    -----
    A component that touches and approaches, or is a hair inside by rounding and goes deeper, touches now; one
    that moves away does not.
    """
    raise NotImplementedError(type(obstacle))


@generic
def outward(obstacle, x, axis):
    """Return a coordinate of the unit vector along which a component at x that touches is thrown back."""
    raise NotImplementedError(type(obstacle))


@generic
def repeated(obstacle):
    """Tell whether the obstacle stands in every image of the box, so that all of them are to be looked at."""
    raise NotImplementedError(type(obstacle))


@generic
def anchor(obstacle, axis):
    """Return a coordinate of the centre by whose images those of the obstacle are told apart."""
    raise NotImplementedError(type(obstacle))


@encounter.register
def _(obstacle: Plane, x, v, radius, growth):
    height = -obstacle.offset - radius
    approach = growth
    for axis in range(len(obstacle.normal)):
        height += obstacle.normal[axis] * x[axis]
        approach -= obstacle.normal[axis] * v[axis]
    return max(height / approach, 0.0) if approach > 0.0 else NEVER


@outward.register
def _(obstacle: Plane, x, axis):
    return obstacle.normal[axis]


@repeated.register
def _(obstacle: Plane):
    return False


@anchor.register
def _(obstacle: Plane, axis):
    return 0.0


@encounter.register
def _(obstacle: Ball, x, v, radius, growth):
    start = 0.0
    for _ in range(2):
        contact = obstacle.radius + radius + growth * start
        c = -contact * contact
        b = -contact * growth
        a = -growth * growth
        for axis in range(len(obstacle.center)):
            r = x[axis] + v[axis] * start - obstacle.center[axis]
            c += r * r
            b += r * v[axis]
            a += v[axis] * v[axis]
        discriminant = b * b - a * c
        if discriminant < 0.0 or (b >= 0.0 and a >= 0.0):
            return NEVER
        t = start + c / (np.sqrt(discriminant) - b)
        if start > 0.0 or c < (FAR * contact) ** 2 or a <= 0.0:
            break
        start = max(t - 2.0 * contact / np.sqrt(a), 0.0)  # with the digits that are lost from so far away
    return max(t, 0.0)


@outward.register
def _(obstacle: Ball, x, axis):
    rr = 0.0
    for k in range(len(obstacle.center)):
        rr += (x[k] - obstacle.center[k]) ** 2
    return (x[axis] - obstacle.center[axis]) / np.sqrt(rr)


@repeated.register
def _(obstacle: Ball):
    return True


@anchor.register
def _(obstacle: Ball, axis):
    return obstacle.center[axis]


@inner
def leave_round(c, b, a):
    """Return the later root of ``c + 2 b t + a t^2`` (c <= 0: inside), or now for what leaves already."""
    if c > 0.0 and b > 0.0:
        return 0.0
    root = np.sqrt(max(b * b - a * c, 0.0))
    if b > 0.0:
        return -c / (b + root)
    return (root - b) / a if a > 0.0 else NEVER


@encounter.register
def _(obstacle: Sphere, x, v, radius, growth):
    room = obstacle.radius - radius
    c = -room * room
    b = room * growth
    a = -growth * growth
    for axis in range(len(obstacle.center)):
        r = x[axis] - obstacle.center[axis]
        c += r * r
        b += r * v[axis]
        a += v[axis] * v[axis]
    return leave_round(c, b, a)


@outward.register
def _(obstacle: Sphere, x, axis):
    rr = 0.0
    for k in range(len(obstacle.center)):
        rr += (x[k] - obstacle.center[k]) ** 2
    return (obstacle.center[axis] - x[axis]) / np.sqrt(rr)


@repeated.register
def _(obstacle: Sphere):
    return False


@anchor.register
def _(obstacle: Sphere, axis):
    return 0.0


@encounter.register
def _(obstacle: Cylinder, x, v, radius, growth):
    room = obstacle.radius - radius
    c = -room * room
    b = room * growth
    a = -growth * growth
    for axis in range(len(obstacle.center)):
        if axis != obstacle.axis:
            r = x[axis] - obstacle.center[axis]
            c += r * r
            b += r * v[axis]
            a += v[axis] * v[axis]
    return leave_round(c, b, a)


@outward.register
def _(obstacle: Cylinder, x, axis):
    if axis == obstacle.axis:
        return 0.0
    rr = 0.0
    for k in range(len(obstacle.center)):
        if k != obstacle.axis:
            rr += (x[k] - obstacle.center[k]) ** 2
    return (obstacle.center[axis] - x[axis]) / np.sqrt(rr)


@repeated.register
def _(obstacle: Cylinder):
    return False


@anchor.register
def _(obstacle: Cylinder, axis):
    return 0.0


class Chain(NamedTuple):
    """Obstacles of one kind, and the chain of the other kinds: a list that types can walk along."""

    head: tuple
    """Obstacles of one kind."""
    number: int
    """Number of the first of them."""
    tail: Any
    """The rest, a Chain or None."""


class Crowd(NamedTuple):
    """A link of many balls, in arrays: each value of a tuple is compiled for itself, which takes minutes for
    hundreds of them.
    """

    centers: np.ndarray
    """(k, d) float64."""
    radii: np.ndarray
    """(k,) float64."""
    number: int
    """Number of the first of them."""
    tail: Any
    """The rest, a Chain or None."""
    center: np.ndarray
    """Room for a center, (d,)."""


CROWDED = 16
"""Balls from which on they are a crowd."""


class Obstacles(NamedTuple):
    """Everything fixed that components can meet, numbered: two for every axis (its lower and its upper wall,
    if it has walls), then one an obstacle.
    """

    cushions: Cushions | None
    chain: Chain | Crowd | None
    hits: np.ndarray
    """Collisions with each, (numbers,) int64."""
    impulse: np.ndarray
    """Momentum that each took up along its normal, (numbers,) float64."""
    x: np.ndarray
    """Room for a position in the box, (d,)."""
    image: np.ndarray
    """Room for one of its images, (d,)."""
    v: np.ndarray
    """Room for a velocity, (d,)."""


def make_obstacles(edges, walled, models) -> Obstacles | None:
    """Return the obstacles of a scene, or None if there are none.

    Parameters
    ----------
    edges : d floats
        Edges of the box.
    walled : d bools
        Which axes have walls.
    models : sequence of NamedTuple
        The others; those of one kind follow each other (see :func:`numbering`).
    """
    dimension = len(edges)
    if not any(walled) and not models:
        return None
    cushions = None
    if any(walled):
        cushions = Cushions(tuple(map(float, edges)), tuple(int(wall) for wall in walled))
    kinds: dict[type, list] = {}
    for model in models:
        kinds.setdefault(type(model), []).append(model)
    total = 2 * dimension + len(models)
    number = total
    chain: Chain | Crowd | None = None
    for kind, group in reversed(kinds.items()):
        number -= len(group)
        if kind is Ball and len(group) >= CROWDED:
            centers = np.array([ball.center for ball in group])
            radii = np.array([ball.radius for ball in group])
            chain = Crowd(centers, radii, number, chain, np.zeros(dimension))
        else:
            chain = Chain(tuple(group), number, chain)
    places = (np.zeros(dimension) for _ in range(3))
    return Obstacles(cushions, chain, np.zeros(total, np.int64), np.zeros(total), *places)


def numbering(models) -> list[int]:
    """Return the place of each obstacle after they were put together by kind."""
    kinds: dict[type, list[int]] = {}
    for k, model in enumerate(models):
        kinds.setdefault(type(model), []).append(k)
    order = [k for group in kinds.values() for k in group]
    return [order.index(k) for k in range(len(models))]


@inner
def face_images(model, state, i, now):
    """Put the position of component i at the time now, in the box, and its velocity into the rooms."""
    obstacles = model.obstacles
    row = state.rows[i]
    t = now - row.t
    for axis in range(len(model.boundary.edges)):
        x = position(model.motion, axis, row.x[axis], row.v[axis], t)
        obstacles.x[axis] = in_box(model.boundary, i, axis, x)
        obstacles.v[axis] = velocity(model.motion, axis, row.v[axis], t)


@generic
def soonest(obstacles, model, state, i, now, every):
    """Return the time until component i touches an obstacle, and the number of that obstacle, or -1.

    ``every`` is False where only those that stand in every image of the box are to be looked at: they are
    seen as far as the next images, and looked for again whenever i has gone as far as its neighbours reach.
    """
    raise NotImplementedError(type(obstacles))


@soonest.register
def _(obstacles: None, model, state, i, now, every):
    return NEVER, np.int64(-1)


@soonest.register
def _(obstacles: Obstacles, model, state, i, now, every):
    face_images(model, state, i, now)
    size = radius(model.pair, i, now)
    rate = growth(model.pair, i)
    best = NEVER
    number = np.int64(-1)
    if every:
        best, number = soonest_wall(obstacles.cushions, obstacles, size, rate)
    t, k = soonest_link(obstacles.chain, obstacles, model.boundary, size, rate, every)
    if t < best:
        best = t
        number = k
    return best, number


@generic
def soonest_wall(cushions, obstacles, size, rate):
    """Return the time until a component touches a wall of the box, and the number of that wall."""
    raise NotImplementedError(type(cushions))


@soonest_wall.register
def _(cushions: None, obstacles, size, rate):
    return NEVER, np.int64(-1)


@soonest_wall.register
def _(cushions: Cushions, obstacles, size, rate):
    best = NEVER
    number = np.int64(-1)
    for axis in range(len(cushions.edges)):
        if cushions.walled[axis] != 0:
            x = obstacles.x[axis]
            v = obstacles.v[axis]
            upper = np.int64(v > 0.0)
            approach = abs(v) + rate
            gap = cushions.edges[axis] - x - size if upper else x - size
            t = max(gap / approach, 0.0) if approach > 0.0 else NEVER
            if rate > 0.0:  # the wall behind may be reached by growth
                back = rate - abs(v)
                gap = x - size if upper else cushions.edges[axis] - x - size
                if back > 0.0 and max(gap / back, 0.0) < t:
                    t = max(gap / back, 0.0)
                    upper = 1 - upper
            if t < best:
                best = t
                number = 2 * axis + upper
    return best, number


@generic
def soonest_link(chain, obstacles, boundary, size, rate, every):
    """Return the time until a component touches one of a chain of obstacles, and its number."""
    raise NotImplementedError(type(chain))


@soonest_link.register
def _(chain: None, obstacles, boundary, size, rate, every):
    return NEVER, np.int64(-1)


@soonest_link.register
def _(chain: Chain, obstacles, boundary, size, rate, every):
    best, number = soonest_link(chain.tail, obstacles, boundary, size, rate, every)
    for k in range(len(chain.head)):
        t = soonest_image(chain.head[k], obstacles, boundary, size, rate, every)
        if t < best:
            best = t
            number = np.int64(chain.number + k)
    return best, number


@soonest_link.register
def _(chain: Crowd, obstacles, boundary, size, rate, every):
    best, number = soonest_link(chain.tail, obstacles, boundary, size, rate, every)
    for k in range(len(chain.radii)):
        t = soonest_image(member(chain, k), obstacles, boundary, size, rate, every)
        if t < best:
            best = t
            number = np.int64(chain.number + k)
    return best, number


@inner
def member(crowd, k):
    """Return a ball of a crowd; its center is the room for one."""
    for axis in range(len(crowd.center)):
        crowd.center[axis] = crowd.centers[k, axis]
    return Ball(crowd.center, crowd.radii[k])


@inner
def soonest_image(obstacle, obstacles, boundary, size, rate, every):
    """Return the time until a component touches an obstacle, in any image of the box in which it stands."""
    t = NEVER
    if repeated(obstacle):
        for code in range(3 ** len(boundary.edges)):
            digits = code
            for axis in range(len(boundary.edges)):
                edge = boundary.edges[axis] if boundary.inverse[axis] > 0.0 else 0.0
                # The anchor may have been given in another box.
                turns = np.floor(anchor(obstacle, axis) * boundary.inverse[axis])
                obstacles.image[axis] = obstacles.x[axis] + (turns + (digits % 3 - 1)) * edge
                digits //= 3
            t = min(t, encounter(obstacle, obstacles.image, obstacles.v, size, rate))
    elif every:
        t = encounter(obstacle, obstacles.x, obstacles.v, size, rate)
    return t


@inner
def bounce(model, state, i, number, now):
    """Throw component i, which is up to date, back from the obstacle of that number; return the momentum."""
    obstacles = model.obstacles
    face_images(model, state, i, now)
    normal_of(obstacles.cushions, obstacles, number)
    normal_along(obstacles.chain, obstacles, model.boundary, number)
    row = state.rows[i]
    speed = 0.0
    for axis in range(len(model.boundary.edges)):
        speed += obstacles.image[axis] * row.v[axis]
    change = 2.0 * (growth(model.pair, i) - speed)
    for axis in range(len(model.boundary.edges)):
        row.v[axis] += change * obstacles.image[axis]
    momentum = mass(model.pair, i) * change
    obstacles.hits[number] += 1
    obstacles.impulse[number] += momentum
    return momentum


@generic
def normal_of(cushions, obstacles, number):
    """Put the normal of a wall of the box into the room for an image, if ``number`` is one's."""
    raise NotImplementedError(type(cushions))


@normal_of.register
def _(cushions: None, obstacles, number):
    return None


@normal_of.register
def _(cushions: Cushions, obstacles, number):
    for axis in range(len(cushions.edges)):
        obstacles.image[axis] = 0.0
        if number >> 1 == axis:
            obstacles.image[axis] = 1.0 if number & 1 == 0 else -1.0


@generic
def normal_along(chain, obstacles, boundary, number):
    """Put the normal of the obstacle of that number into the room for an image, if it is in the chain."""
    raise NotImplementedError(type(chain))


@normal_along.register
def _(chain: None, obstacles, boundary, number):
    return None


@normal_along.register
def _(chain: Chain, obstacles, boundary, number):
    normal_along(chain.tail, obstacles, boundary, number)
    k = number - chain.number
    if 0 <= k < len(chain.head):
        face(chain.head[k], obstacles, boundary)


@normal_along.register
def _(chain: Crowd, obstacles, boundary, number):
    normal_along(chain.tail, obstacles, boundary, number)
    k = number - chain.number
    if 0 <= k < len(chain.radii):
        face(member(chain, k), obstacles, boundary)


@inner
def face(obstacle, obstacles, boundary):
    """Put the normal of an obstacle that is touched into the room for an image."""
    if repeated(obstacle):  # the image that is touched is the nearest one
        for axis in range(len(boundary.edges)):
            turns = np.rint((obstacles.x[axis] - anchor(obstacle, axis)) * boundary.inverse[axis])
            obstacles.x[axis] -= turns * boundary.edges[axis]
    for axis in range(len(boundary.edges)):
        obstacles.image[axis] = outward(obstacle, obstacles.x, axis)
