"""Fixed obstacles, walls, planes, balls and containers, in any arithmetic, described by tables as in a scene
file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from carom.errors import InputError
from carom.reference.arithmetic import Arithmetic


class Plane(NamedTuple):
    """A plane: spheres stay where ``normal . x >= offset``; `length` is that of the normal."""

    normal: np.ndarray
    offset: Any
    length: Any

    def gap(self, x: np.ndarray, radius: Any) -> Any:
        """Distance between the plane and the surface of a sphere at `x` [length]."""
        return (sum(self.normal * x) - self.offset) / self.length - radius

    def outward(self, x: np.ndarray) -> np.ndarray:
        """Vector (d,) of any length along which a sphere at `x` is thrown back."""
        return self.normal

    def encounter(self, x: np.ndarray, v: np.ndarray, radius: Any, growth: Any, sqrt: Any) -> Any:
        """Time until a sphere, whose radius grows, touches; or None."""
        rate = sum(self.normal * v) - self.length * growth
        if rate >= 0:
            return None
        height = sum(self.normal * x) - self.offset - self.length * radius
        return max(height, height * 0) / -rate


class Container(NamedTuple):
    """A container: spheres stay within `radius` of a point, or of a line along `axis`."""

    center: np.ndarray
    radius: Any
    axis: int | None
    sqrt: Any

    def _across(self, vector: np.ndarray) -> np.ndarray:
        """Return a vector without its component along the axis."""
        if self.axis is None:
            return vector
        across = vector.copy()
        across[self.axis] *= 0
        return across

    def gap(self, x: np.ndarray, radius: Any) -> Any:
        """Distance between the container and the surface of a sphere at `x` [length]."""
        r = self._across(x - self.center)
        return self.radius - radius - self.sqrt(sum(r * r))

    def outward(self, x: np.ndarray) -> np.ndarray:
        """Vector (d,) of any length along which a sphere at `x` is thrown back."""
        return self._across(self.center - x)

    def encounter(self, x: np.ndarray, v: np.ndarray, radius: Any, growth: Any, sqrt: Any) -> Any:
        """Time until a sphere, whose radius grows, touches; or None.

        The first root t >= 0 of ``|r + v t|^2 = (room - growth t)^2``, written so that it keeps its digits.
        """
        r, u, room = self._across(x - self.center), self._across(v), self.radius - radius
        a = sum(u * u) - growth * growth
        b = sum(r * u) + room * growth
        c = sum(r * r) - room * room
        if c >= 0 and b > 0:
            return c * 0
        root = sqrt(max(b * b - a * c, c * 0))
        if b > 0:
            return -c / (b + root)
        return (root - b) / a if a > 0 else None


class Ball(NamedTuple):
    """A solid ball, met under all periodic images."""

    center: np.ndarray
    radius: Any


def make_fixed(
    box: np.ndarray, periodic: Sequence[bool], obstacles: Sequence[Mapping[str, Any]], numbers: Arithmetic
) -> tuple[Plane | Container | Ball, ...]:
    """Return the walls of axes that are not periodic (lower, upper, axis after axis), then the obstacles."""
    d = len(box)
    made: list[Plane | Container | Ball] = []
    one, zero = numbers.number(1), numbers.number(0)
    for axis in range(d):
        if not periodic[axis]:
            normal = numbers.array([int(k == axis) for k in range(d)], "normal")
            made += [Plane(normal, zero, one), Plane(-normal, -box[axis], one)]
    for k, described in enumerate(obstacles):
        try:
            kind, values = described["type"], dict(described)
            point = numbers.array(values["normal" if kind == "plane" else "center"], f"obstacle {k}")
            size = numbers.array([values["offset" if kind == "plane" else "radius"]], f"obstacle {k}")[0]
            if point.shape != (d,):
                raise InputError(f"Obstacle {k} has {point.size} coordinates; expected {d}.")
            if kind == "plane":
                made.append(Plane(point, size, numbers.sqrt(sum(point * point))))
            elif kind == "ball":
                made.append(Ball(point, size))
            elif kind in ("sphere", "cylinder"):
                along = int(values["axis"]) if kind == "cylinder" else None
                made.append(Container(point, size, along, numbers.sqrt))
            else:
                raise InputError(f"Obstacle {k} is a {kind!r}; expected plane, ball, sphere or cylinder.")
        except (KeyError, TypeError) as error:
            raise InputError(f"Obstacle {k} lacks {error}.") from error
    return tuple(made)
