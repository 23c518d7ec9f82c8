"""Cuboids: boxes that stand in the way, with sharp or rounded edges, in any dimension."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom.declared import Opt, described
from carom.errors import InputError
from carom.models.declared_values import Name, Rounding, Vector
from carom.models.obstacles.cells import crowded
from carom.models.obstacles.convex import Body, Rounded, check_points


@described
@dataclass(frozen=True, repr=False)
class Cuboid(Body):
    """A block with edges along the axes, rounded if it has a radius.

    Raises
    ------
    InputError
        If an edge is not positive, or a number is out of range.
    """

    type = "cuboid"
    low: Annotated[Vector, Opt("The corner with the least coordinates [length].")]
    high: Annotated[Vector, Opt("The corner opposite to it [length].")]
    radius: Rounding = 0.0
    name: Name = "cuboid"

    def complete(self) -> None:
        """Raise InputError where an edge is not positive."""
        check_points((self.low, self.high), "corners of a cuboid")
        if any(not a < b for a, b in zip(self.low, self.high, strict=True)):
            raise InputError(f"low must be below high along every axis, found {self.low} and {self.high}.")

    def corners(self) -> np.ndarray:
        """Return all corners, (2^d, d) [length]."""
        return np.array(list(itertools.product(*zip(self.low, self.high, strict=True))))

    def spread(self) -> np.ndarray:
        """Return zeros (d,) [length]: sides that face each other tell the images of a block apart."""
        return np.zeros(len(self.low))

    def model(self) -> Block:
        """Return the model that the engine compiles."""
        middle = tuple(0.5 * (a + b) for a, b in zip(self.low, self.high, strict=True))
        return Block(middle, self.radius, self.low, self.high)


@crowded
class Block(Rounded):
    """All places within a distance of a block."""

    low: tuple
    high: tuple

    def extent(self: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest coordinates of each, (k, d) [length]."""
        return self.low - self.round[:, None], self.high + self.round[:, None]

    def closest(self, x, axis):
        return min(max(x[axis], self.low[axis]), self.high[axis])
