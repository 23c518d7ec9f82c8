"""The pressure on a wall or an obstacle, from the momentum that it receives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from carom import checks
from carom.block import Block
from carom.errors import InputError
from carom.models.obstacles.box_walls import sides
from carom.models.obstacles.faces import bare, stand_ins
from carom.models.obstacles.planes import Plane, walls
from carom.observables.analysis.surface_changes import freed, place_of
from carom.observables.of_blocks import OfBlocks, OneNumber
from carom.observables.statistics import Estimate, ratio
from carom.scene.fields import standing
from carom.suggestions import corrected

if TYPE_CHECKING:
    from carom.scene.scene import Scene


@corrected()
@dataclass(frozen=True)
class WallPressure(OfBlocks["WallPressureResult"]):
    """The pressure on a wall or an obstacle: an observable of a run, for :meth:`carom.Simulation.measure`.

    Parameters
    ----------
    obstacle : int or str
        Its number or name, as :attr:`carom.Simulation.obstacles` lists them: the walls, "x_low" before
        "x_high", then walls with properties and the scene's obstacles.
    area : float, optional
        Area by which the force is divided [length^(d-1)]. By default it is that of the wall, or of the
        surface of the ball or container (not of the surface on which centers turn back); 1 in one dimension.
        Of a plane that stands for a wall it is that of the wall. It is required for other planes, for
        segments without a radius, and for your own obstacles.

    Raises
    ------
    InputError
        If the area is not positive.

    Notes
    -----
    A wall for which an obstacle stands is listed, and nothing meets it: ask for the obstacle. A wall with
    properties is asked for by its name.

    The force on walls, containers, balls and planes along an axis comes from the momentum balance of the
    whole fluid (``analysis.momentum_balance``), so that sound waves do not correlate the blocks. It
    differs from the momentum received per time by a term that does not grow with the run. For slanting planes
    and your own obstacles, a regression on their distances removes most of the sound
    (``carom.observables.analysis.surface_changes``). If blocks hold neither, the momentum received is used.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, walls=True))
    >>> found = sim.measure(WallPressure("y_low"), collisions_per_particle=50)
    >>> 0.0 < found.pressure.error < 0.2 * found.pressure.mean
    True
    """

    obstacle: int | str = 0
    area: float | None = None

    def __post_init__(self) -> None:
        if self.area is not None:
            checks.number(self.area, "area", low=0.0, open_low=True)

    def begin(self, scene: Scene) -> None:
        """Raise InputError if a ``scene`` has no such obstacle, or its area is not known."""
        k = self._number(scene)
        if self.area is None:
            _area(scene, k)

    _what = "the pressure"

    def _of(self, blocks: Sequence[Block], scene: Scene, kT: float) -> WallPressureResult:
        names, k = obstacle_names(scene), self._number(scene)
        area = _area(scene, k) if self.area is None else self.area
        impulses = np.array([block.impulses[k] for block in blocks])
        if all(block.momentum_changes for block in blocks):
            flux = impulses + np.array([block.momentum_changes[k] for block in blocks])
        else:
            flux = impulses
        durations = np.array([block.duration for block in blocks])
        place = place_of(scene, k)
        if not impulses.any():  # without collisions the scatter is zero, but the error is not
            force = Estimate(0.0, math.inf, 0.0, math.inf, len(blocks))
        elif place is not None and all(block.surface_changes for block in blocks):
            changes = np.array([block.surface_changes[place : place + 2] for block in blocks])
            force, flux = freed(impulses, changes, durations)
        else:
            force = ratio(flux, durations)
        values = tuple((flux / durations / area).tolist())
        return WallPressureResult(
            force.scaled(1.0 / area), force, names[k], area, values, tuple(durations.tolist())
        )

    def _number(self, scene: Scene) -> int:
        """Return the number of the obstacle among all walls and obstacles."""
        names, walls = obstacle_names(scene), sides(scene.periodic)
        k = self._among(names)
        replaced = stand_ins(standing(scene), scene.box, scene.periodic)
        if k < len(walls) and walls[k] in replaced:
            name = standing(scene)[replaced[walls[k]]].name
            raise InputError(f"{name} stands for the wall {names[k]}, which nothing meets; measure {name!r}.")
        return k

    def _among(self, names: tuple[str, ...]) -> int:
        """Return the number of the obstacle among these names."""
        if not names:
            raise InputError("This scene has neither walls nor obstacles, so nothing takes up momentum.")
        if isinstance(self.obstacle, str):
            if names.count(self.obstacle) != 1:
                raise InputError(
                    f"There must be one obstacle {self.obstacle!r}, found {names.count(self.obstacle)}; "
                    f"there are {', '.join(names)}."
                )
            return names.index(self.obstacle)
        return checks.integer(self.obstacle, "obstacle", low=0, high=len(names) - 1)


@dataclass(frozen=True, eq=False)
class WallPressureResult(OneNumber):
    """The pressure on a wall or an obstacle, and the force.

    Parameters
    ----------
    pressure : Estimate
        Momentum along the normal per time and area [energy / length^d].
    force : Estimate
        Momentum per time [energy / length].
    name : str
        Name of the wall or obstacle.
    area : float
        Area by which the force was divided [length^(d-1)].
    block_values, block_durations : tuple of float
        Pressure [energy / length^d] and duration [time] of each block.
    """

    pressure: Estimate
    force: Estimate
    name: str
    area: float
    block_values: tuple[float, ...] = field(default=(), repr=False)
    block_durations: tuple[float, ...] = field(default=(), repr=False)

    _main = "pressure"
    _ylabel = "pressure P"

    def _rows(self) -> tuple[str, list[tuple[str, str]]]:
        if self.never_hit:
            return self.name, [("hits", "none")]
        rows = [("P [energy / length^d]", self.pressure), ("force [energy / length]", self.force)]
        texts = [(name, e.value_text) for name, e in rows]
        return self.name, [*texts, ("area [length^(d-1)]", f"{self.area:.6g}")]

    def __str__(self) -> str:
        if self.never_hit:
            return f"P on {self.name}: nothing hit it"
        return f"P on {self.name} = {self.pressure.value_text} energy / length^d"

    @property
    def never_hit(self) -> bool:
        """Whether nothing hit it: the mean is zero, and its error is not known."""
        return self.force.mean == 0.0 and math.isinf(self.force.error)

    @property
    def quantity(self) -> str:  # type: ignore[override]
        """Name of the measured quantity, for messages."""
        return f"the pressure on {self.name}"


def obstacle_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of walls and obstacles; a plain wall beside one of its name is "plain y_low"."""
    taken = [each.name for each in standing(scene)]
    plain = (each.name for each in walls(scene.box, scene.periodic))
    return (*(f"plain {name}" if name in taken else name for name in plain), *taken)


def _area(scene: Scene, k: int) -> float:
    """Return the area of wall or obstacle k [length^(d-1)]."""
    axes = [axis for axis, wraps in enumerate(scene.periodic) if not wraps]
    if k < 2 * len(axes):
        return scene.volume / scene.box[axes[k // 2]]
    number = k - 2 * len(axes)
    obstacle = standing(scene)[number]
    body = bare(obstacle)
    area = float(body.area(scene.box)) if hasattr(body, "area") else 0.0
    if area > 0.0:  # that of a segment without a radius is zero
        return area
    if isinstance(body, Plane):
        for (axis, _), stands in stand_ins(standing(scene), scene.box, scene.periodic).items():
            if stands == number:
                return scene.volume / scene.box[axis]
    raise InputError(f"The area of {obstacle.name} is not known; give WallPressure(area=...).")
