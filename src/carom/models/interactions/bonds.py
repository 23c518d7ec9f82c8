"""Bonds: pairs that cannot part, by a wall of infinite energy outside; chains and rings of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import number, positive, said
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.models.interactions.steps import StepInteraction, Steps, steps


def _pairs(value: Any, name: str) -> tuple[tuple[int, int], ...]:
    """Return pairs of indices in order, each once."""
    if not checks.several(value):
        raise InputError(f"{name} must be m pairs of indices, found {checks.describe(value)}.")
    given = checks.array(value, name, "(m, 2)", ndim=2) if len(value) else np.empty((0, 2))
    whole = (given == np.rint(given)) & (given >= 0) & (given < 2**53)
    if given.shape[1] != 2 or not whole.all():
        raise InputError(f"{name} must be m pairs of indices of components, 0 or more.")
    pairs = np.unique(np.sort(given.astype(np.int64), axis=1), axis=0)
    if not len(pairs):
        raise InputError(f"{name} is empty: give at least one bond, or leave out Bonds.")
    if (pairs[:, 0] == pairs[:, 1]).any():
        raise InputError(f"Component {pairs[pairs[:, 0] == pairs[:, 1]][0, 0]} is bonded to itself.")
    if len(pairs) < len(given):
        raise InputError(f"{name} names a pair twice; give every bond once.")
    return tuple((int(i), int(j)) for i, j in pairs)


said(_pairs, type="array", items={"type": "array", "items": {"type": "integer"}}, minItems=1)


def _others(value: Any, name: str) -> StepInteraction:
    """Check what pairs that are not bonded have."""
    if not isinstance(value, StepInteraction) or isinstance(value, Bonds):
        raise InputError(f"{name} must be a SquareWell or a StepTable, found {checks.describe(value)}.")
    return value


said(_others, anyOf=[{"$ref": "#/definitions/interaction"}])


@dataclass(frozen=True)
class Bonds(Value, StepInteraction):
    """Bonded pairs, whose distance stays between two limits; other pairs may interact by steps.

    Parameters
    ----------
    pairs : (m, 2) sequence of ints
        Indices of the bonded pairs: from :func:`chains`, :func:`rings`, or any other list.
    inner, outer : float
        Smallest and largest distance of a bonded pair [length]; ``inner`` may be 0.
    others : interaction, optional
        Interaction of pairs that are not bonded: ``carom.models.SquareWell`` or ``StepTable``. By
        default they pass through each other (ideal chains).
    bond : Steps, optional
        Potential of a bonded pair, with ``outside=math.inf``, instead of ``inner`` and ``outer``.

    Raises
    ------
    InputError
        If the pairs are not pairs of different indices, each given once. If neither ``outer`` nor ``bond`` is
        given, or both are. If ``others`` or ``bond`` is of another type.

    Examples
    --------
    >>> Bonds(chains(2, length=3), inner=0.9, outer=1.1).pairs
    ((0, 1), (1, 2), (3, 4), (4, 5))
    """

    type = "bonds"
    pairs: Annotated[Any, _pairs] = field(repr=False)
    inner: Annotated[float | None, number(low=0.0)] = None
    outer: Annotated[float | None, positive] = None
    others: Annotated[Any, _others] = None
    bond: Annotated[Steps | None, steps] = None

    def complete(self) -> None:
        """Set the potential of a bond from its ends; raise InputError where it is said twice, or not."""
        if self.bond is None:
            if self.outer is None:
                raise InputError(
                    "A bond needs outer, the distance that it never exceeds; or bond=Steps(...)."
                )
            ends = (self.inner, self.outer) if self.inner else (self.outer,)
            energies = (math.inf, 0.0) if self.inner else (0.0,)
            self._put("bond", Steps(ends, energies, outside=math.inf))
        elif self.inner is not None or self.outer is not None:
            raise InputError("inner and outer say the same as bond: leave out one of them.")
        elif self.bond.outside != math.inf:
            raise InputError("bond must be Steps(..., outside=math.inf): else the two could part.")
        self._put("inner", None)
        self._put("outer", None)

    def steps_by_species(self, diameter: float) -> tuple[tuple[Steps | None, ...], ...]:
        """Return the potentials of pairs that are not bonded, by species, for cores of a ``diameter``."""
        return ((None,),) if self.others is None else self.others.steps_by_species(diameter)

    def bonded(self) -> tuple[np.ndarray, Steps | None]:
        """Return the bonded pairs (m, 2), and their potential."""
        return np.array(self.pairs, np.int64).reshape(-1, 2), self.bond

    def check(self, scene: Any) -> None:
        """Raise InputError where the scene cannot have these bonds."""
        if self.others is not None:
            self.others.check(scene)
        super().check(scene)


def chains(count: int, length: int, first: int = 0) -> list[tuple[int, int]]:
    """Return the bonds of ``count`` chains of ``length`` particles each, numbered consecutively.

    Parameters
    ----------
    count, length : int
        Number of chains, and of particles in each.
    first : int
        Index of the first particle.

    Raises
    ------
    InputError
        If ``count`` is less than 1, or ``length`` less than 2.
    """
    count, length = checks.integer(count, "count", low=1), checks.integer(length, "length", low=2)
    starts = [first + k * length for k in range(count)]
    return [(start + k, start + k + 1) for start in starts for k in range(length - 1)]


def rings(count: int, length: int, first: int = 0) -> list[tuple[int, int]]:
    """Return the bonds of ``count`` rings of ``length`` particles each, numbered consecutively.

    Parameters and errors are those of :func:`chains`; a ring has at least 3 particles.
    """
    count, length = checks.integer(count, "count", low=1), checks.integer(length, "length", low=3)
    ends = [(first + k * length, first + (k + 1) * length - 1) for k in range(count)]
    return [*chains(count, length, first), *ends]
