"""Obstacles at the walls of the box: for which wall one stands, in whose plane it lies, or that it is hidden.

A wall and an obstacle in its plane are met at once, and rounding would decide which comes first. So a plane
or a container that gets to a wall, at rest or while it moves, stands for that wall, which nothing meets then.
Something else that lies in the plane of a wall (a segment, a block, an obstacle of the user's own) is met
before the wall, and the wall is met beside it. What lies behind a wall is never met, and is refused.

wall : (int, int)
    Axis, and 0 for the lower wall, 1 for the upper one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.models.obstacles.arcs import Arc
from carom.models.obstacles.balls import Ball
from carom.models.obstacles.box_walls import ROUNDING_MARGIN, Walls, cushions, place_of, sides, wall_name
from carom.models.obstacles.containers import CylindricalContainer, SphericalContainer
from carom.models.obstacles.convex import Body
from carom.models.obstacles.planes import Plane, walls
from carom.models.obstacles.with_properties import Dressed

PROBES = 256  # places on a wall at which it is asked whether an obstacle of the user's own lies there

GOLDEN = 0.6180339887498949
"""Multiples of its powers, without their whole part, are spread evenly: they are the probes' coordinates."""

Wall = tuple[int, int]


def stand_ins(obstacles: Sequence[Any], box: Sequence[float], periodic: Sequence[bool]) -> dict[Wall, int]:
    """Return the walls for which an obstacle stands, and the number of that obstacle."""
    hair, found = ROUNDING_MARGIN * max(box), dict[Wall, int]()
    for wall in sides(periodic):
        for k, obstacle in enumerate(obstacles):
            heights = _heights(obstacle, box, wall)
            if heights is None:
                stands = hasattr(obstacle, "live") and _is_own(obstacle)
                stands = stands and bool((np.abs(_gaps(obstacle, box, periodic, wall)) <= hair).all())
            else:
                stands = heights[0] <= hair and heights[1] >= -hair
            if not stands:
                continue
            before = found.setdefault(wall, k)
            if before != k and all(isinstance(bare(obstacles[each]), Plane) for each in (before, k)):
                raise InputError(
                    f"{obstacles[before].name} and {obstacle.name} both stand for the wall "
                    f"{wall_name(*wall)}, and particles would meet both at once; leave one of them out, or "
                    "move it into the box."
                )
    return found


def yielding(obstacles: Sequence[Any], box: Sequence[float], periodic: Sequence[bool]) -> set[Wall]:
    """Return the walls in the plane of which an obstacle lies, in part or all over, that stands for none."""
    return {
        wall
        for wall in sides(periodic)
        if any(_lies_in(obstacle, box, periodic, wall) for obstacle in obstacles)
    }


def hard_walls(obstacles: Sequence[Any], box: Sequence[float], periodic: Sequence[bool]) -> Walls | None:
    """Return what the engine compiles for the walls of the box, or None where there are none."""
    replaced = stand_ins(obstacles, box, periodic)
    return cushions(box, periodic, replaced, yielding(obstacles, box, periodic) - {*replaced})


def standing_walls(obstacles: Sequence[Any], box: Sequence[float], periodic: Sequence[bool]) -> list[Plane]:
    """Return the walls for which no obstacle stands."""
    replaced = stand_ins(obstacles, box, periodic)
    named = zip(sides(periodic), walls(box, periodic), strict=True)
    return [plane for wall, plane in named if wall not in replaced]


def refuse_hidden(
    obstacles: Sequence[Any], box: Sequence[float], periodic: Sequence[bool], radius: float
) -> None:
    """Raise InputError if no particle of a ``radius`` meets an obstacle, or one lets centers out."""
    for obstacle in obstacles:
        if _is_hidden(obstacle, box, periodic):
            raise InputError(
                f"{obstacle.name} lies behind the walls of the box, where no particle can meet it; move it "
                "into the box, or into the plane of a wall, or leave it out."
            )
    replaced = stand_ins(obstacles, box, periodic)
    for k, obstacle in enumerate(obstacles):
        wall = place_of(obstacle.name)
        if wall in sides(periodic) and replaced.get(wall) != k:
            raise InputError(
                f"{obstacle.name} is the name of a wall, for which this obstacle does not stand."
            )
    for wall, k in replaced.items():
        heights = _heights(obstacles[k], box, wall)
        if heights is not None and heights[0] < -radius - ROUNDING_MARGIN * max(box):
            raise InputError(
                f"{obstacles[k].name} stands for the wall {wall_name(*wall)} and moves up to "
                f"{-heights[0]:.6g} behind it, where centers leave the box; expected at most the smallest "
                f"radius, {radius:.6g}. Shake it less, or move it into the box: a Wall by its offset."
            )


def bare(obstacle: Any) -> Any:
    """Return an obstacle without its surface and motion."""
    return obstacle.obstacle if isinstance(obstacle, Dressed) else obstacle


def _is_own(obstacle: Any) -> bool:
    """Tell whether an obstacle, without its surface and motion, is of a class of the user's own."""
    known = (Plane, Ball, SphericalContainer, CylindricalContainer, Body, Arc)
    return not isinstance(bare(obstacle), known)


def _normal(box: Sequence[float], wall: Wall) -> tuple[float, ...]:
    """Return the unit vector from a wall into the box."""
    return tuple((-1.0) ** wall[1] * (axis == wall[0]) for axis in range(len(box)))


def _place(box: Sequence[float], wall: Wall) -> float:
    """Return the coordinate of a wall along its normal [length]."""
    return -float(box[wall[0]]) if wall[1] else 0.0


def _heights(obstacle: Any, box: Sequence[float], wall: Wall) -> tuple[float, float] | None:
    """Return how far before a wall an obstacle confines components, at least and at most [length]."""
    confines = getattr(obstacle, "confines", None)
    offsets = None if confines is None else confines(_normal(box, wall))
    if offsets is None:
        return None
    return offsets[0] - _place(box, wall), offsets[1] - _place(box, wall)


def _front(body: Any, box: Sequence[float], wall: Wall) -> tuple[float, float] | None:
    """Return the least and the greatest height of a solid body above a wall; None for others [length]."""
    axis, sign = wall[0], (-1.0) ** wall[1]
    if isinstance(body, Ball):
        ends = [body.center[axis] - body.radius, body.center[axis] + body.radius]
    elif isinstance(body, Body):
        along = body.corners()[:, axis]
        ends = [float(along.min()) - body.radius, float(along.max()) + body.radius]
    elif isinstance(body, Arc):
        ends = [float(end[axis]) for end in body.extent()]
    else:
        return None
    heights = [sign * end - _place(box, wall) for end in ends]
    return min(heights), max(heights)


def _lies_in(obstacle: Any, box: Sequence[float], periodic: Sequence[bool], wall: Wall) -> bool:
    """Tell whether a wall and an obstacle that does not stand for it can be met at once."""
    body, hair = bare(obstacle), ROUNDING_MARGIN * max(box)
    if _is_own(obstacle):
        return bool((np.abs(_gaps(obstacle, box, periodic, wall)) <= hair).any())
    front = _front(body, box, wall)
    if front is None:
        return False
    # From inside, an arc touches a wall in one point: without a surface of its own it throws back likewise.
    from_inside = isinstance(body, Arc) and hasattr(obstacle, "live") and abs(front[0]) <= hair
    return abs(front[1]) <= hair or from_inside


def _gaps(obstacle: Any, box: Sequence[float], periodic: Sequence[bool], wall: Wall) -> np.ndarray:
    """Return the distances of an obstacle from places on a wall, (m,) [length]."""
    d, edges = len(box), np.array(box, dtype=float)
    spread = np.arange(1, PROBES + 1)[:, None] * GOLDEN ** np.arange(1, d + 1) % 1.0
    places = np.concatenate([spread, np.full((1, d), 0.5)]) * edges
    places[:, wall[0]] = edges[wall[0]] if wall[1] else 0.0
    with np.errstate(all="ignore"):
        return np.asarray(
            obstacle.gap(places, np.zeros(len(places)), tuple(box), tuple(periodic)), dtype=float
        )


def _is_hidden(obstacle: Any, box: Sequence[float], periodic: Sequence[bool]) -> bool:
    """Tell whether all of an obstacle is behind walls, always."""
    body, hair = bare(obstacle), ROUNDING_MARGIN * max(box)
    moves = isinstance(obstacle, Dressed) and obstacle.path is not None
    ways = obstacle.ends if moves else np.zeros((1, len(box)))
    if isinstance(body, Plane | SphericalContainer | CylindricalContainer):
        # The room that they leave is convex, so that one of the corners is nearest.
        ends = [(0.0,) if wraps else (0.0, edge) for edge, wraps in zip(box, periodic, strict=True)]
        corners = np.array(list(itertools.product(*ends)))
        nearest = [body.gap(corners - way, 0.0, tuple(box), tuple(periodic)).min() for way in ways]
        return bool(min(nearest) > hair)
    for wall in sides(periodic):
        front = _front(body, box, wall)
        if front is not None and front[1] + float((ways @ _normal(box, wall)).max()) < -hair:
            return True
    return False
