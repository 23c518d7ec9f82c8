"""Piecewise-constant pair potentials: square wells, shoulders and any number of steps, by species or not."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import number, said, schema_of
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.models.interactions.steps import CLOSEST, StepInteraction, Steps, steps


@dataclass(frozen=True)
class SquareWell(Value, StepInteraction):
    """A hard core with a well around it; a negative depth is a shoulder.

    Parameters
    ----------
    range : float
        Diameter of the well in diameters of the core, lambda > 1.
    depth : float
        Depth of the well, epsilon: a pair in it has the energy ``-depth`` [energy].

    Raises
    ------
    InputError
        If the range is not above 1 by more than rounding, or the depth is not a finite number.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.crystal(256, 0.2, interaction=SquareWell(1.5, 1.0))
    """

    type = "square-well"
    range: Annotated[float, number(low=1.0, open_low=True)] = 1.5
    depth: Annotated[float, number(low=-checks.MAGNITUDE)] = 1.0

    def complete(self) -> None:
        """Raise InputError where the range leaves the well no width."""
        if not self.range > 1.0 + CLOSEST:
            raise InputError(f"range must be above 1 by more than rounding, found {self.range!r}.")

    @property
    def words(self) -> str:
        """What pairs have, for a title."""
        kind, size = ("shoulders", "height") if self.depth < 0.0 else ("wells", "depth")
        return f"square {kind} of range {self.range:g} and {size} {abs(self.depth):g}"

    def steps_by_species(self, diameter: float) -> tuple[tuple[Steps, ...], ...]:
        """Return the one potential of all pairs, for cores of a ``diameter``."""
        return ((Steps((diameter, self.range * diameter), (math.inf, -self.depth)),),)

    def check(self, scene: Any) -> None:
        """Raise InputError if the diameters of the ``scene`` differ."""
        super().check(scene)
        if np.ptp(scene.diameters) > 0.0:
            raise InputError(
                "A SquareWell is for components of one diameter; give StepTable a potential for each pair of "
                "species."
            )


def _rows(value: Any, name: str) -> tuple[tuple[Steps, ...], ...]:
    """Check a potential for all pairs, or one for each pair of species."""
    try:
        rows = ((value,),) if isinstance(value, Steps) else tuple(tuple(row) for row in value)
    except TypeError:
        raise InputError(
            f"{name} must be Steps, or K rows of K Steps; found {checks.describe(value)}."
        ) from None
    if not rows or any(len(row) != len(rows) for row in rows):
        raise InputError(f"{name} must have as many columns as rows, found {[len(row) for row in rows]}.")
    rows = tuple(
        tuple(steps(x, f"{name}[{a}][{b}]") for b, x in enumerate(row)) for a, row in enumerate(rows)
    )
    for a, row in enumerate(rows):
        for b, each in enumerate(row):
            if each.outside != 0.0:
                raise InputError(f"{name}[{a}][{b}] has an energy outside; only a bond has (Bonds).")
            if each != rows[b][a]:
                raise InputError(f"{name}[{a}][{b}] and {name}[{b}][{a}] differ: a pair has one potential.")
    return rows


said(_rows, type="array", items={"type": "array", "items": schema_of(steps)})


@dataclass(frozen=True)
class StepTable(Value, StepInteraction):
    """A potential for each pair of species, or one for all.

    Parameters
    ----------
    table : Steps, or (K, K) nested sequence of Steps
        Potential of all pairs, or of each pair of species: a symmetric matrix.

    Raises
    ------
    InputError
        If the table is not a square, symmetric matrix of Steps, or a potential has an energy ``outside``.

    Examples
    --------
    >>> core = Steps([1.0], [math.inf])
    >>> StepTable([[core, Steps([1.0, 1.5], [math.inf, -1.0])], [Steps([1.0, 1.5], [math.inf, -1.0]), core]])
    ... # doctest: +ELLIPSIS
    StepTable(...)
    """

    type = "steps"
    table: Annotated[Any, _rows] = field(repr=False)

    def steps_by_species(self, diameter: float) -> tuple[tuple[Steps, ...], ...]:
        """Return the table; it does not depend on the ``diameter``."""
        return self.table


def from_potential(
    u: Callable[[float], float],
    *,
    reach: float,
    core: float,
    count: int,
    spacing: str = "volume",
    dimension: int = 3,
) -> Steps:
    """Return steps that approximate a continuous pair potential.

    Parameters
    ----------
    u : callable
        The potential at a distance [energy].
    reach : float
        Cutoff [length]; the potential is 0 beyond it.
    core : float
        Diameter of the hard core that replaces its steep part [length].
    count : int
        Number of steps. With ``spacing="energy"`` it is the number for a monotonic potential.
    spacing : {"volume", "energy"}
        Steps of equal volume, each with the average of u over it. Or steps at equal differences of energy:
        the energy changes where u is half way between two of them.
    dimension : int
        d, for volumes.

    Raises
    ------
    InputError
        If u is not finite between core and reach, or an argument is out of range.

    Notes
    -----
    Chapela, Scriven and Davis, J. Chem. Phys. 91 (1989) 4307; Thomson, Lue and Bannerman, J. Chem. Phys. 140
    (2014) 034105.

    Examples
    --------
    >>> def lennard_jones(r):
    ...     return 4.0 * (r**-12 - r**-6)
    >>> steps = from_potential(lennard_jones, reach=2.5, core=0.9, count=10)
    >>> len(steps.distances), round(min(steps.energies), 3)
    (11, -0.422)
    """
    if not callable(u):
        raise InputError(f"u must be a function of a distance, found {checks.describe(u)}.")
    core = checks.positive(core, "core")
    reach = checks.number(reach, "reach", low=core, high=checks.MAGNITUDE, open_low=True)
    count = checks.integer(count, "count", low=1, high=MOST)
    dimension = checks.integer(dimension, "dimension", low=1)
    if spacing not in ("volume", "energy"):
        raise InputError(f"spacing is {spacing!r}; expected 'volume' or 'energy'.")

    def energy(r: float) -> float:
        value = float(u(float(r)))
        if not math.isfinite(value):
            raise InputError(f"u({r:.6g}) is {value!r}; expected finite energies between core and reach.")
        return value

    split = _of_equal_volume if spacing == "volume" else _of_equal_energy
    distances, energies = split(energy, core, reach, count, dimension)
    return Steps((core, *distances), (math.inf, *energies))


MOST = 1000
"""Steps of one potential: more are slower than a force is."""

FINE = 4096  # points at which a potential is looked at for the distances where it passes an energy


def _of_equal_volume(
    energy: Callable[[float], float], core: float, cutoff: float, count: int, d: int
) -> tuple[list[float], list[float]]:
    """Return outer ends, and the average of u over the volume between each two."""
    ends = (core**d + (cutoff**d - core**d) * np.arange(count + 1) / count) ** (1.0 / d)
    ends[[0, -1]] = core, cutoff
    nodes, weights = np.polynomial.legendre.leggauss(16)
    energies = []
    for low, high in itertools.pairwise(ends):
        volumes = 0.5 * (low**d + high**d) + 0.5 * (high**d - low**d) * nodes
        values = [energy(volume ** (1.0 / d)) for volume in volumes]
        energies.append(float(0.5 * weights @ values))
    return ends[1:].tolist(), energies


def _of_equal_energy(
    energy: Callable[[float], float], core: float, cutoff: float, count: int, d: int
) -> tuple[list[float], list[float]]:
    """Return outer ends where u passes half way between two multiples of a step, and the multiples."""
    from scipy.optimize import brentq

    places = np.linspace(core, cutoff, FINE + 1)
    values = np.array([energy(r) for r in places])
    step = float(np.ptp(values)) / count
    if step == 0.0:
        return [cutoff], [float(values[0])]
    on_step = np.rint(values / step).astype(np.int64)
    ends, energies = [], []
    for k in np.flatnonzero(np.diff(on_step)):
        sense = 1 if on_step[k + 1] > on_step[k] else -1
        for n in range(int(on_step[k]), int(on_step[k + 1]), sense):
            half = (n + 0.5 * sense) * step
            ends.append(float(brentq(lambda r, half=half: energy(r) - half, places[k], places[k + 1])))
            energies.append(n * step)
    if on_step[-1] != 0:
        ends.append(cutoff)
        energies.append(float(on_step[-1]) * step)
    return ends, energies
