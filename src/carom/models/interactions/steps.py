"""A pair potential that is constant between distances, and what all interactions made of such have in common.

A potential is a list of distances and the energy of a pair inside each of them. ``math.inf`` is a hard core,
or a bond where it is the energy outside. What the engine compiles is in ``step_pairs``.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import fields_of, said, schema_of_table
from carom.errors import InputError, OverlapError
from carom.models.declared_values import Value
from carom.models.interactions.step_pairs import StepPairs
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.interfaces.steps import step_bits

ROUNDING = 2.0**-40
"""Part of a distance by which a pair may be beyond a wall at the start: what the engine's rounding leaves."""

CLOSEST = 2.0**-26
"""Part of a distance by which the next one must be larger: nearer steps are lost in rounding."""


def _numbers(values: Any, name: str) -> tuple[float, ...]:
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        raise InputError(f"{name} must be a list of numbers, found {checks.describe(values)}.")
    found = []
    for value in values:
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"{name} must hold numbers, found {checks.describe(value)}.") from None
        if math.isnan(number) or number == -math.inf or (math.isfinite(number) and abs(number) > 1e100):
            raise InputError(f"{name} must hold numbers up to 1e100, or math.inf; found {value!r}.")
        found.append(number)
    return tuple(found)


said(_numbers, type="array", items={"type": "number"})


def _energy(value: Any, name: str) -> float:
    """Check an energy, which may be infinite."""
    return _numbers([value], name)[0]


said(_energy, type="number")


def check_rise(distances: Sequence[float], what: str) -> None:
    """Raise InputError unless distances are above 0, and each above the one before."""
    for low, high in zip((0.0, *distances), distances, strict=False):
        if not (1.0 / checks.MAGNITUDE <= high <= checks.MAGNITUDE and high > low * (1.0 + CLOSEST)):
            raise InputError(f"{what} and rise by more than rounding, found {high!r} after {low!r}.")


@dataclass(frozen=True)
class Steps(Value):
    """A pair potential that is constant between distances.

    Parameters
    ----------
    distances : sequence of m floats
        Distances at which the energy changes, increasing [length].
    energies : sequence of m floats
        Energy of a pair between the previous distance and this one [energy]. The first may be ``math.inf``, a
        hard core.
    outside : float
        Energy beyond the last distance, ``math.inf`` for a bond [energy].
    leaving : sequence of m floats, optional
        Energies on the way out, for hysteretic steps [energy]. A pair that enters and leaves again loses the
        difference. By default they are equal to ``energies``.

    Raises
    ------
    InputError
        If there are no distances, or they do not increase. If an energy is infinite that is neither a core
        nor a bond.

    Examples
    --------
    >>> well = Steps([1.0, 1.5], [math.inf, -1.0])
    >>> shoulder_and_well = Steps([1.0, 1.2, 1.8], [math.inf, 0.5, -1.0])
    """

    distances: Annotated[tuple[float, ...], _numbers]
    energies: Annotated[tuple[float, ...], _numbers]
    outside: Annotated[float, _energy] = 0.0
    leaving: Annotated[tuple[float, ...] | None, _numbers] = None

    def complete(self) -> None:
        """Raise InputError where these are no steps."""
        leaving = self.energies if self.leaving is None else self.leaving
        if not self.distances:
            raise InputError("distances is empty: give at least one distance at which the energy changes.")
        for name, values in (("energies", self.energies), ("leaving", leaving)):
            if len(values) != len(self.distances):
                raise InputError(
                    f"{name} must have one energy for each of the {len(self.distances)} distances, found "
                    f"{len(values)}."
                )
            if not all(math.isfinite(e) for e in values[1:]):
                raise InputError(f"Only the first of {name} may be infinite, a hard core; found {values}.")
        if (self.energies[0] == math.inf) != (leaving[0] == math.inf):
            raise InputError("A hard core has an infinite energy in both energies and leaving.")
        if math.isinf(self.outside) and len(self.distances) == 1 and math.isinf(self.energies[0]):
            raise InputError("Both sides of the only distance are infinite: no pair could be anywhere.")
        check_rise(self.distances, "distances must be positive")
        if leaving == self.energies:
            self._put("leaving", None)

    def given(self) -> dict[str, Any]:
        """Return the arguments that are not those by default, by name."""
        return self.unusual()

    @property
    def core(self) -> float:
        """Diameter of the hard core, 0 if there is none [length]."""
        return self.distances[0] if self.energies[0] == math.inf else 0.0

    @property
    def levels(self) -> list[tuple[float, float, float, float, float]]:
        """The steps from the outside inwards.

        Each has its inner end, outer end, the energies needed to cross these, and the energy of a pair on it.
        """
        into = (*self.energies, self.outside)
        out = (*(self.energies if self.leaving is None else self.leaving), self.outside)
        ends = (0.0, *self.distances, math.inf)
        found = []
        for k in reversed(range(len(into))):
            if math.isfinite(into[k]):
                enter_cost = into[k - 1] - into[k] if k else math.inf
                leave_cost = out[k + 1] - out[k] if k + 1 < len(out) else math.inf
                found.append((ends[k], ends[k + 1], enter_cost, leave_cost, into[k]))
        return found


def steps(value: Any, name: str) -> Steps:
    """Return a potential, also from its table."""
    if isinstance(value, Mapping):
        checks.keys(value, name, fields_of(Steps), needed=("distances", "energies"))
        return Steps(**value)
    if not isinstance(value, Steps):
        raise InputError(
            f"{name} must be Steps, or a table with distances and energies; found {checks.describe(value)}."
        )
    return value


said(steps, **schema_of_table(Steps))


class StepInteraction(ABC):
    """What all of them have in common: steps for every pair of species, and for pairs that are bonded."""

    penetrable = True
    """Cores are not the components' diameters; :meth:`check` looks at them."""

    @abstractmethod
    def steps_by_species(self, diameter: float) -> tuple[tuple[Steps | None, ...], ...]:
        """Return the steps of every pair of species, (K, K), None without any; one row where species do not
        matter.
        """

    def bonded(self) -> tuple[np.ndarray, Steps | None]:
        """Return the bonded pairs (m, 2), sorted, and their steps."""
        return np.empty((0, 2), np.int64), None

    def reach(self, scene: Any) -> float:
        """Return the largest distance at which the energy of a pair changes [length]."""
        _, bond = self.bonded()
        kinds = {steps for row in self.steps_by_species(scene.diameter) for steps in row}
        return max(float(steps.distances[-1]) for steps in (*kinds, bond) if steps is not None)

    def conserves(self, diameter: float) -> bool:
        """Whether no pair loses energy on its way in and out."""
        _, bond = self.bonded()
        kinds = {steps for row in self.steps_by_species(diameter) for steps in row}
        found = [steps for steps in (*kinds, bond) if steps is not None]
        return all(steps.leaving is None for steps in found)

    @property
    def words(self) -> str:
        """What pairs have, for a title: wells, shoulders, bonds, or several of them."""
        _, bond = self.bonded()
        kinds = {steps for row in self.steps_by_species(1.0) for steps in row if steps is not None}
        energies = {energy for steps in kinds for energy in steps.energies if math.isfinite(energy)}
        found = ["wells"] if min(energies, default=0.0) < 0.0 else []
        found += ["shoulders"] if max(energies, default=0.0) > 0.0 else []
        found += ["bonds"] if bond is not None else []
        several = " and ".join(", ".join(found).rsplit(", ", 1)) or "hard cores"
        return several if self.conserves(1.0) else f"{several} that lose energy"

    def check(self, scene: Any) -> None:
        """Raise InputError where the scene cannot have these steps."""
        table = self.steps_by_species(scene.diameter)
        if len(table) > 1 and (scene.species is None or int(scene.species.max()) >= len(table)):
            count = "none" if scene.species is None else f"{int(scene.species.max()) + 1}"
            raise InputError(
                f"Steps are given for {len(table)} species, and the scene has {count}: species=."
            )
        pairs, bond = self.bonded()
        if len(pairs) and int(pairs.max()) >= scene.n:
            raise InputError(f"A bond names component {int(pairs.max())}, and there are {scene.n}.")
        kinds = {steps for row in table for steps in row} | {bond}
        ends = [end for steps in kinds if steps is not None for end in steps.distances]
        if min(ends) < checks.UNLIKE * max(ends):
            raise InputError(
                f"Steps end at {min(ends):.6g}, and at {max(ends):.6g}; expected at least "
                f"{checks.UNLIKE:.2g} of the largest distance, because doubles cannot tell whether a pair "
                "reaches a nearer one. "
                "Make the distances more alike, or leave out the nearest."
            )

    def _layout(self, diameter: float) -> tuple[list[Steps | None], list[int], np.ndarray, int]:
        """Return the different potentials, where the steps of each begin, which of them each pair of species
        has, and that of bonds (-1 without).
        """
        table = self.steps_by_species(diameter)
        _, bond = self.bonded()
        kinds = list(dict.fromkeys(steps for row in table for steps in row))
        which = np.array([[kinds.index(steps) for steps in row] for row in table])
        if bond is not None:
            kinds.append(bond)
        begins = np.cumsum([0, *(len(_levels(steps)) for steps in kinds)]).tolist()
        return kinds, begins, which, -1 if bond is None else len(kinds) - 1

    def steps(self, particles: Particles) -> tuple[int, np.ndarray]:
        """Return how many steps there are, and the outermost of every pair of species (K, K)."""
        _, begins, which, _ = self._layout(2.0 * float(particles.radii[0]))
        return begins[-1], np.asarray(begins)[which]

    def steps_of(
        self, pairs: np.ndarray, distances: np.ndarray, species: np.ndarray | None, diameter: float
    ) -> np.ndarray:
        """Return the step that each pair (m, 2) at a distance (m,) starts on.

        Raises
        ------
        OverlapError
            If a pair is inside a hard core.
        InputError
            If a bonded pair is too far apart.
        """
        kinds, begins, which, bond = self._layout(diameter)
        sort = which[tuple(species[pairs].T)] if len(which) > 1 and species is not None else which[0, 0]
        sort = np.broadcast_to(sort, len(pairs)).copy()
        if bond >= 0:
            sort[_among(pairs, self.bonded()[0])] = bond
        found = np.zeros(len(pairs), np.int64)
        for kind, (steps, begin) in enumerate(zip(kinds, begins[:-1], strict=True)):
            rows = np.flatnonzero(sort == kind)
            if steps is None:
                found[rows] = begin
                continue
            r, last = distances[rows], len(steps.distances)
            outside = math.isinf(steps.outside)
            region = np.searchsorted(steps.distances, r, side="right")  # at a distance a pair is outside it
            inside = region < bool(steps.core)
            beyond = (region == last) & outside
            for bad, edge in ((inside, steps.distances[0]), (beyond, steps.distances[-1])):
                wrong = rows[bad & (np.abs(r - edge) > ROUNDING * edge)]
                if len(wrong):
                    worst = wrong[np.argmax(np.abs(distances[wrong] - edge))]
                    i, j = (int(k) for k in pairs[worst])
                    if bad is inside:
                        raise OverlapError(
                            f"spheres {i} and {j} are {distances[worst]:.9g} apart, inside the hard core of "
                            f"{edge:.9g}: move them apart."
                        )
                    raise InputError(
                        f"components {i} and {j} are bonded and {distances[worst]:.9g} apart; a bond reaches "
                        f"to {edge:.9g}: move them together."
                    )
            region = np.clip(region, int(bool(steps.core)), last - int(outside))
            found[rows] = begin + (last - int(outside)) - region
        return found

    def cores_of(self, pairs: np.ndarray, species: np.ndarray | None, diameter: float) -> np.ndarray:
        """Return the hard core of each of ``pairs`` (m, 2), 0 where there is none, (m,) [length]."""
        table, (bonds, bond) = self.steps_by_species(diameter), self.bonded()
        cores = np.array([[0.0 if steps is None else steps.core for steps in row] for row in table])
        found = cores[tuple(species[pairs].T)] if len(cores) > 1 and species is not None else cores[0, 0]
        found = np.broadcast_to(found, len(pairs)).copy()
        if bond is not None:
            found[_among(pairs, bonds)] = bond.core
        return found

    def model(self, particles: Particles) -> StepPairs:
        """Return the model that the engine compiles."""
        kinds, _, _, _ = self._layout(2.0 * float(particles.radii[0]))
        levels = np.array([level for steps in kinds for level in _levels(steps)])
        inner, outer, enter_cost, leave_cost, energy = (_padded(column) for column in levels.T)
        unit = particles.unit
        longest = float(np.max(outer, where=np.isfinite(outer), initial=1.0))
        return StepPairs(
            np.where(inner > 0.0, inner**2, -(longest**2)),
            outer**2,
            unit.to_kernel(enter_cost, -2),
            unit.to_kernel(leave_cost, -2),
            unit.to_kernel(energy, -2),
            np.zeros((len(energy), 4), np.int64),
            particles.with_padding(particles.radii),
            particles.with_padding(particles.masses),
        )


def _levels(potential: Steps | None) -> list[tuple[float, float, float, float, float]]:
    """Return the levels of a potential; those who have none are everywhere on one step without an end."""
    return [(0.0, math.inf, math.inf, math.inf, 0.0)] if potential is None else potential.levels


def _padded(column: np.ndarray) -> np.ndarray:
    """Return a column with as many items as the bits of a word can name."""
    return np.concatenate([column, np.full((1 << step_bits(len(column))) - len(column), NEVER)])


def _among(pairs: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Tell which pairs (m, 2) are among known ones, in either order."""
    n = int(max(pairs.max(initial=0), known.max(initial=0))) + 1

    def key(both: np.ndarray) -> np.ndarray:
        return both.min(axis=1) * n + both.max(axis=1)

    return np.isin(key(pairs), key(known))
