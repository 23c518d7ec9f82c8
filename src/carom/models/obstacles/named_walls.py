"""Walls of the box by name: which axes have them, and the properties of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import Opt, described, number
from carom.errors import InputError
from carom.models.obstacles.box_walls import axis_names, sides, wall_name
from carom.models.obstacles.planes import Plane
from carom.models.obstacles.properties import Properties, properties_of
from carom.texts import axis_name, counted

Walls = bool | str | Sequence[str] | Mapping[str, "Wall"]  # what the keyword ``walls`` takes


@described
@dataclass(frozen=True, kw_only=True, repr=False)
class Wall(Properties):
    """A wall of the box with properties: shaken, lossy or hot.

    Without any it is plain: hard, at rest. It is given by name, ``walls={"y_low": Wall(...)}``.

    Raises
    ------
    InputError
        If a value is out of range, or two of them exclude each other.

    Examples
    --------
    >>> from carom import Scene
    >>> from carom.models import Sine
    >>> floor = Wall(shake=Sine(0.3, period=2.0), impact=0.9)
    >>> Scene.random(100, 0.1, 2, walls={"y_low": floor}).periodic
    (True, False)
    """

    offset: Annotated[
        float,
        number(low=0.0, high=checks.MAGNITUDE),
        Opt(
            "How far inside the face of the box a shaken wall swings [length], at most so far that it gets "
            "to the face. Its center then never leaves the box by more than the smallest radius, which is an "
            "error."
        ),
    ] = 0.0

    def complete(self) -> None:
        """Raise InputError where the wall never gets to the face of the box."""
        if self.offset > (0.0 if self.shake is None else -float(self.shake.lowest)):
            raise InputError(
                f"A Wall stands in the face of the box, or gets there while it is shaken; found offset "
                f"{self.offset:g}. A Plane among the obstacles may stand anywhere."
            )

    @property
    def is_plain(self) -> bool:
        """Whether it has no property."""
        return not properties_of(self) and not self.offset


def named(walls: Any, dimension: int) -> dict[str, Wall]:
    """Return the walls of a box by name, in their order, from what the keyword ``walls`` takes."""
    names = axis_names(dimension)
    properties: dict[str, Wall] = {}
    if isinstance(walls, Mapping):
        properties = dict(walls)
        known = [wall_name(axis, side) for axis in range(dimension) for side in (0, 1)]
        for name, wall in properties.items():
            if name not in known:
                hint = checks.suggestion(name, known) if isinstance(name, str) else ""
                raise InputError(f"There is no wall {name!r} in {counted(dimension, 'dimension')}{hint}.")
            if not isinstance(wall, Wall):
                raise InputError(f"walls[{name!r}] must be a Wall, found {checks.describe(wall)}.")
        given = [axis for axis in names if {f"{axis}_low", f"{axis}_high"} & {*properties}]
    elif walls is None or isinstance(walls, bool | np.bool_):
        given = names if walls else []
    elif isinstance(walls, str):
        given = [walls] if walls in names else list(walls)
    elif isinstance(walls, Sequence):
        given = list(walls)
    else:
        raise InputError(
            f"walls must name axes, such as 'xy', or hold a Wall by its name, found {checks.describe(walls)}."
        )
    for axis in given:
        if axis not in names:
            space = f"in {counted(dimension, 'dimension')}"
            raise InputError(
                f"walls={walls!r} names {axis!r}, which is no axis {space}: expected some of "
                f"{', '.join(names)}, or True for all."
            )
        if given.count(axis) > 1:
            raise InputError(f"walls={walls!r} names the axis {axis} twice.")
    found = sides([name not in given for name in names])
    return {name: properties.get(name, Wall()) for name in (wall_name(*each) for each in found)}


def periodic_axes(walls: Mapping[str, Wall], dimension: int) -> tuple[bool, ...]:
    """Return which axes have no walls."""
    return tuple(wall_name(axis, 0) not in walls for axis in range(dimension))


def standing(walls: Mapping[str, Wall], box: Sequence[float]) -> tuple[Plane, ...]:
    """Return the planes that stand for the walls with properties."""
    each = zip(sides(periodic_axes(walls, len(box))), walls.values(), strict=True)
    return tuple(_plane(wall, place, box) for place, wall in each if not wall.is_plain)


def _plane(wall: Wall, axis_and_side: tuple[int, int], box: Sequence[float]) -> Plane:
    """Return the plane with the properties of a wall, in its place: axis and side."""
    axis, side = axis_and_side
    normal = tuple((-1.0) ** side * (k == axis) for k in range(len(box)))
    return Plane(
        normal, wall.offset - (box[axis] if side else 0.0), wall_name(*axis_and_side), **properties_of(wall)
    )


def shortest(walls: Mapping[str, Wall], dimension: int) -> Any:
    """Return the shortest form in which the keyword ``walls`` takes these walls."""
    if not all(wall.is_plain for wall in walls.values()):
        return {**walls}
    return axes_without(periodic_axes(walls, dimension))


def axes_without(periodic: Sequence[bool]) -> Any:
    """Return the shortest form of ``walls`` for plain walls along the axes that are not periodic."""
    if not any(periodic) or all(periodic):
        return not any(periodic)
    axes = [axis_name(axis) for axis, wraps in enumerate(periodic) if not wraps]
    return "".join(axes) if len(periodic) <= 3 or all(len(axis) == 1 for axis in axes) else tuple(axes)
