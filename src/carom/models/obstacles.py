"""Obstacles: planes, fixed balls and containers, and the walls of axes that are not periodic.

An obstacle is a value with a name and three functions: ``check`` says whether it fits a box, ``gap`` how far
the surface of each component is from it, and ``model`` what the engine is to compile. A class of one's own
with these is as good as those here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Protocol, runtime_checkable

import numpy as np

from carom import checks
from carom.errors import InputError

__all__ = ["Ball", "CylindricalContainer", "Obstacle", "Plane", "SphericalContainer", "walls"]


@runtime_checkable
class Obstacle(Protocol):
    """What an obstacle must have."""

    @property
    def name(self) -> str:
        """What to call it in messages and results."""

    def gap(
        self, positions: np.ndarray, radii: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
    ) -> np.ndarray:
        """Return how far each component's surface is from the obstacle's (n,), negative inside [length].

        Parameters
        ----------
        positions : (n, d) array
            Centres [length].
        radii : (n,) array
            [length].
        box : sequence of d floats
            Edges [length].
        periodic : sequence of d bools
            Which axes are.
        """

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the obstacle cannot stand in this box."""

    def model(self) -> Any:
        """Return what the engine compiles: a NamedTuple whose type has the kernel's functions."""


@dataclass(frozen=True)
class Plane:
    """A flat wall in any orientation: centres stay where normal . x >= offset + radius.

    Parameters
    ----------
    normal : d floats
        Points to the allowed side; of any length. Zero along periodic axes.
    offset : float
        ``normal . x`` on the plane, in units of the normal's length.
    name : str
        What to call it.

    Raises
    ------
    InputError
        If the normal is zero or a number is none.
    """

    normal: tuple[float, ...]
    offset: float
    name: str = "plane"

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", _vector(self.normal, "normal of a plane"))
        object.__setattr__(self, "offset", checks.number(self.offset, "offset of a plane"))
        _name(self)
        if not any(self.normal):
            raise InputError("The normal of a plane must not be zero: it points to the allowed side.")

    def _unit(self) -> tuple[tuple[float, ...], float]:
        """Return the normal of length 1, and the plane's distance from the origin along it."""
        length = math.hypot(*self.normal)
        return tuple(x / length for x in self.normal), self.offset / length

    def gap(self, positions, radii, box, periodic):
        """Return how far each component's surface is from the plane (n,) [length]."""
        normal, distance = self._unit()
        return positions @ np.array(normal) - distance - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the normal has another dimension, or a component along a periodic axis."""
        _dimensions(self.normal, box, f"normal of {self.name}")
        for axis, (component, repeats) in enumerate(zip(self.normal, periodic, strict=True)):
            if component and repeats:
                raise InputError(
                    f"The normal of {self.name} has a component along axis {axis}, which is periodic: the "
                    "plane would end at the box. Set periodic to false for that axis."
                )

    def model(self):
        """Return the kernel's Plane."""
        from carom.engine import obstacles as obstacle

        return obstacle.Plane(*self._unit())


@dataclass(frozen=True)
class Ball:
    """A fixed solid ball (a disk for d = 2), met under all its periodic images.

    Parameters
    ----------
    center : d floats
        [length].
    radius : float
        [length].
    name : str
        What to call it.
    """

    center: tuple[float, ...]
    radius: float
    name: str = "ball"

    def __post_init__(self) -> None:
        _center_and_radius(self)

    def gap(self, positions, radii, box, periodic):
        """Return how far each component's surface is from the nearest image of the ball (n,) [length]."""
        edges = np.where(periodic, box, np.inf)
        separation = positions - np.array(self.center)
        # A product with infinity would be no number along axes that are not periodic.
        separation -= np.where(periodic, box, 0.0) * np.rint(separation / edges)
        return np.linalg.norm(separation, axis=1) - self.radius - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension."""
        _dimensions(self.center, box, f"center of {self.name}")

    def model(self):
        """Return the kernel's Ball."""
        from carom.engine import obstacles as obstacle

        return obstacle.Ball(self.center, self.radius)


@dataclass(frozen=True)
class SphericalContainer:
    """A hollow sphere around everything; no axis may be periodic.

    Parameters
    ----------
    center : d floats
        [length].
    radius : float
        Of its inside [length].
    name : str
        What to call it.
    """

    center: tuple[float, ...]
    radius: float
    name: str = "sphere"

    def __post_init__(self) -> None:
        _center_and_radius(self)

    def gap(self, positions, radii, box, periodic):
        """Return how far each component's surface is from the container's (n,) [length]."""
        return self.radius - np.linalg.norm(positions - np.array(self.center), axis=1) - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension, or an axis is periodic."""
        _dimensions(self.center, box, f"center of {self.name}")
        if any(periodic):
            raise InputError(
                f"Around {self.name}, a spherical container, no axis may be periodic, found axis "
                f"{list(periodic).index(True)}. Set periodic to false."
            )

    def model(self):
        """Return the kernel's Sphere."""
        from carom.engine import obstacles as obstacle

        return obstacle.Sphere(self.center, self.radius)


@dataclass(frozen=True)
class CylindricalContainer:
    """A hollow cylinder around everything, along one of the axes; the others may not be periodic.

    Parameters
    ----------
    axis : int
        Along which it lies.
    center : d floats
        Any point of its middle line [length].
    radius : float
        Of its inside [length].
    name : str
        What to call it.
    """

    axis: int
    center: tuple[float, ...]
    radius: float
    name: str = "cylinder"

    def __post_init__(self) -> None:
        _center_and_radius(self)
        axis = checks.integer(self.axis, "axis of a cylinder", low=0, high=len(self.center) - 1)
        object.__setattr__(self, "axis", axis)
        if len(self.center) < 2:
            raise InputError("A cylindrical container needs two dimensions or more, found one.")

    def gap(self, positions, radii, box, periodic):
        """Return how far each component's surface is from the container's (n,) [length]."""
        across = np.delete(positions - np.array(self.center), self.axis, axis=1)
        return self.radius - np.linalg.norm(across, axis=1) - radii

    def check(self, box: Sequence[float], periodic: Sequence[bool]) -> None:
        """Raise InputError if the center has another dimension, or an axis across is periodic."""
        _dimensions(self.center, box, f"center of {self.name}")
        for axis, repeats in enumerate(periodic):
            if repeats and axis != self.axis:
                raise InputError(
                    f"Across {self.name}, a cylindrical container along axis {self.axis}, no axis may be "
                    f"periodic, found axis {axis}. Set periodic to false for that axis."
                )

    def model(self):
        """Return the kernel's Cylinder."""
        from carom.engine import obstacles as obstacle

        return obstacle.Cylinder(self.axis, self.center, self.radius)


#: The kinds by the names that scene files and checkpoints use.
KINDS: dict[str, type] = {
    "plane": Plane,
    "ball": Ball,
    "sphere": SphericalContainer,
    "cylinder": CylindricalContainer,
}


def walls(box: Sequence[float], periodic: Sequence[bool]) -> tuple[Plane, ...]:
    """Return the hard walls of the axes that are not periodic: at 0, then at the edge, axis after axis."""
    result = []
    for axis, (edge, repeats) in enumerate(zip(box, periodic, strict=True)):
        if not repeats:
            inwards = tuple(float(k == axis) for k in range(len(box)))
            outwards = tuple(-x for x in inwards)
            result.append(Plane(inwards, 0.0, f"lower wall of axis {axis}"))
            result.append(Plane(outwards, -edge, f"upper wall of axis {axis}"))
    return tuple(result)


def checked(obstacles: Any, box: Sequence[float], periodic: Sequence[bool]) -> tuple[Obstacle, ...]:
    """Return obstacles as a tuple, each of which can stand in the box.

    Raises
    ------
    InputError
        If one is no obstacle, or does not fit the box.
    """
    if not isinstance(obstacles, Sequence) or isinstance(obstacles, str):
        raise InputError(f"obstacles must be a tuple of obstacles, found {checks.describe(obstacles)}.")
    for k, obstacle in enumerate(obstacles):
        if isinstance(obstacle, type) or not isinstance(obstacle, Obstacle):
            raise InputError(
                f"Obstacle {k} must be one of {', '.join(c.__name__ for c in KINDS.values())}, or have name, "
                f"gap, check and model as they do; found {checks.describe(obstacle)}."
            )
        obstacle.check(box, periodic)
    return tuple(obstacles)


def to_json(obstacle: Obstacle) -> dict[str, Any]:
    """Return an obstacle as values that JSON and TOML hold; of a class of one's own only its name."""
    for kind, known in KINDS.items():
        if type(obstacle) is known:
            return {"kind": kind, **asdict(obstacle)}  # type: ignore[call-overload]
    return {"kind": "own", "class": type(obstacle).__name__, "name": obstacle.name}


def from_json(values: Any) -> Obstacle:
    """Return the obstacle of :func:`to_json`.

    Raises
    ------
    InputError
        If it is of a class of one's own, of an unknown kind, or a value is missing, unknown or wrong.
    """
    if not isinstance(values, dict):
        raise InputError(f"An obstacle must be a table, found {checks.describe(values)}.")
    kind = values.get("kind")
    if kind == "own":
        raise InputError(
            f"The obstacle {values.get('name')} is of the class {values.get('class')}, which no file holds; "
            "give obstacles=."
        )
    if kind not in KINDS:
        raise InputError(
            f"kind of an obstacle must be one of {', '.join(KINDS)}; found {checks.describe(kind)}."
        )
    known = {f.name: f for f in fields(KINDS[kind])}
    given = {key: value for key, value in values.items() if key != "kind"}
    for key in given:
        if key not in known:
            raise InputError(f"A {kind} has no {key[:40]!r}; known are {', '.join(known)}.")
    for key in known:
        if key not in given and key != "name":
            raise InputError(f"A {kind} needs {key}, found none.")
    return KINDS[kind](**given)


def outwards(
    obstacle: Obstacle, positions: np.ndarray, box: Sequence[float], periodic: Sequence[bool]
) -> np.ndarray:
    """Return the unit vectors (n, d) along which an obstacle or its nearest image throws components back."""
    from carom.engine.obstacles import anchor, outward, repeated

    model, d = obstacle.model(), len(box)
    x = np.array(positions, dtype=np.float64).reshape(-1, d)
    for axis in range(d):
        if periodic[axis] and repeated(model):
            x[:, axis] -= box[axis] * np.rint((x[:, axis] - anchor(model, axis)) / box[axis])
    return np.array([[outward(model, tuple(each), axis) for axis in range(d)] for each in x]).reshape(-1, d)


def _vector(values: Any, name: str) -> tuple[float, ...]:
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        raise InputError(f"{name} must be a list of numbers, one an axis, found {checks.describe(values)}.")
    if not len(values):
        raise InputError(f"{name} must have one number an axis, found none.")
    return tuple(checks.number(x, name, low=-checks.MAGNITUDE, high=checks.MAGNITUDE) for x in values)


def _name(obstacle: Any) -> None:
    name = obstacle.name
    if not isinstance(name, str) or not name or not name.isprintable() or len(name) > 80:
        raise InputError(
            f"An obstacle's name must be a string of 1 to 80 printable characters, found "
            f"{checks.describe(name)}."
        )


def _center_and_radius(obstacle: Any) -> None:
    kind = type(obstacle).name  # the default name is the kind
    object.__setattr__(obstacle, "center", _vector(obstacle.center, f"center of a {kind}"))
    object.__setattr__(obstacle, "radius", checks.positive(obstacle.radius, f"radius of a {kind}"))
    _name(obstacle)


def _dimensions(vector: tuple[float, ...], box: Sequence[float], what: str) -> None:
    if len(vector) != len(box):
        raise InputError(f"The {what} must have {len(box)} coordinates, found {len(vector)}.")
