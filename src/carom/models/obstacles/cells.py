"""Many obstacles of one kind: their numbers in arrays, and cells that say which of them are near a place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.compiling.registry import Questions
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.obstacles.box_walls import ROUNDING_MARGIN

CROWD_FROM = 16
"""Obstacles of one kind from which on they are kept in arrays and cells, where their type can be."""

MOST_ENTRIES = 256
"""Cells that an obstacle is in, at most, on the average; in few dimensions 4^d."""


class Cells(NamedTuple):
    """A grid of cells over the box, and the obstacles in each: those that come into it."""

    shape: tuple[int, ...]  # cells along each axis
    sides: tuple[float, ...]  # sides of a cell [length]
    starts: np.ndarray  # where the obstacles of each cell begin, (cells + 1,) int64
    members: np.ndarray  # obstacles, cell after cell, int32
    shifts: np.ndarray
    """Boxes from the cell to where that obstacle comes into an image of it, (entries, d) int32."""


class CrowdModel(Questions):
    """Many obstacles of one kind: an array for each field of theirs."""

    def members(self):
        """Return how many they are: one a row of the first array."""
        return len(self[0])

    def member(self, k):
        """Return obstacle k."""
        raise NotImplementedError


def crowded(kind: Any) -> Any:
    """Let a type of models be kept in arrays where there are many: a class decorator.

    ``Crowd``, the type of many, has an array for each field. ``extent`` of the class becomes its: the least
    and largest coordinates of each, (k, d) [length].
    """
    fields = kind._fields

    def member(self, k):
        row: tuple[Any, ...] = ()
        for name in fields:
            row = (*row, getattr(self, name)[k])
        return kind(*row)

    scope = {
        "__module__": kind.__module__,
        "__annotations__": dict.fromkeys(fields, Any),
        "__qualname__": f"{kind.__qualname__}.Crowd",
        "extent": kind.extent,
        "member": member,
    }
    make: Any = type(CrowdModel)
    kind.Crowd = make("Crowd", (CrowdModel,), scope)
    return kind


class InEveryImage(ObstacleModel):
    """What stands in every image of the box."""

    midpoint: tuple  # between its least and its largest coordinates [length]

    def is_periodic(self):
        return True

    def anchor(self, axis):
        return self.midpoint[axis]


def together(models: Sequence[Any]) -> Any:
    """Return many models of a type that is :func:`crowded` as one, or None of any other type."""
    crowd = getattr(type(models[0]), "Crowd", None)
    return crowd and crowd(*(np.array(values, np.float64) for values in zip(*models, strict=True)))


def cells_of(low: np.ndarray, high: np.ndarray, box: Sequence[float], periodic: Sequence[bool]) -> Cells:
    """Return cells of obstacles with least and largest coordinates ``low`` and ``high``, (k, d) [length].

    These are grown by the radius of a particle whose center is looked up. Along axes that are not periodic, a
    place beyond the box is in the last cell.
    """
    edges, wraps = np.array(box, np.float64), np.array(periodic)
    dimension, hair = len(edges), ROUNDING_MARGIN * float(np.max(box))
    side = float(np.prod(edges) / len(low)) ** (1.0 / dimension)
    while True:
        shape = np.maximum(edges / side, 1.0).astype(np.int64)
        first = np.floor((low - hair) * shape / edges)
        last = np.floor((high + hair) * shape / edges)
        inside = [
            np.where(wraps, each, np.clip(each, 0, shape - 1)).astype(np.int64) for each in (first, last)
        ]
        first, spans = inside[0], inside[1] - inside[0] + 1
        counts = spans.prod(axis=1)
        if counts.sum() <= min(4**dimension, MOST_ENTRIES) * len(low) or shape.max() == 1:
            break
        side *= 2.0
    members = np.repeat(np.arange(len(low), dtype=np.int32), counts)
    rest = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)  # 0, 1, ... of each
    cell = np.zeros(len(members), np.int64)
    shifts = np.zeros((len(members), dimension), np.int32)
    for axis in range(dimension):
        rest, way = np.divmod(rest, spans[members, axis])
        shifts[:, axis], place = np.divmod(first[members, axis] + way, shape[axis])
        cell = cell * shape[axis] + place
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(shape.prod() + 1))
    sides = tuple((edges / shape).tolist())
    return Cells(tuple(shape.tolist()), sides, starts, members[order], shifts[order])
