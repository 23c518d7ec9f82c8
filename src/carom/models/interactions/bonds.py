"""Bonds: pairs that cannot part, by a wall of infinite energy outside; chains and rings of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.interactions.steps import StepInteraction, Steps


@dataclass(frozen=True)
class Bonds(StepInteraction):
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

    pairs: Any = field(repr=False)
    inner: float | None = None
    outer: float | None = None
    others: Any = None
    bond: Steps | None = None

    def __post_init__(self) -> None:
        if not checks.several(self.pairs):
            raise InputError(f"pairs must be m pairs of indices, found {checks.describe(self.pairs)}.")
        given = checks.array(self.pairs, "pairs", "(m, 2)", ndim=2) if len(self.pairs) else np.empty((0, 2))
        whole = (given == np.rint(given)) & (given >= 0) & (given < 2**53)
        if given.shape[1] != 2 or not whole.all():
            raise InputError("pairs must be m pairs of indices of components, 0 or more.")
        pairs = np.unique(np.sort(given.astype(np.int64), axis=1), axis=0)
        if not len(pairs):
            raise InputError("pairs is empty: give at least one bond, or leave out Bonds.")
        if (pairs[:, 0] == pairs[:, 1]).any():
            raise InputError(f"Component {pairs[pairs[:, 0] == pairs[:, 1]][0, 0]} is bonded to itself.")
        if len(pairs) < len(given):
            raise InputError("pairs names a pair twice; give every bond once.")
        object.__setattr__(self, "pairs", tuple((int(i), int(j)) for i, j in pairs))
        if self.others is not None and not (
            isinstance(self.others, StepInteraction) and not isinstance(self.others, Bonds)
        ):
            raise InputError(
                f"others must be a SquareWell or a StepTable, found {checks.describe(self.others)}."
            )
        if self.bond is None:
            if self.outer is None:
                raise InputError(
                    "A bond needs outer, the distance that it never exceeds; or bond=Steps(...)."
                )
            outer = checks.positive(self.outer, "outer")
            inner = checks.number(0.0 if self.inner is None else self.inner, "inner", low=0.0)
            ends = (inner, outer) if inner > 0.0 else (outer,)
            energies = (math.inf, 0.0) if inner > 0.0 else (0.0,)
            object.__setattr__(self, "bond", Steps(ends, energies, outside=math.inf))
        elif self.inner is not None or self.outer is not None:
            raise InputError("inner and outer say the same as bond: leave out one of them.")
        elif not isinstance(self.bond, Steps) or self.bond.outside != math.inf:
            raise InputError("bond must be Steps(..., outside=math.inf): else the two could part.")
        object.__setattr__(self, "inner", None)
        object.__setattr__(self, "outer", None)

    def to_table(self) -> dict[str, Any]:
        """Return the arguments, for a file."""
        assert self.bond is not None
        found = {"type": "bonds", "pairs": [list(pair) for pair in self.pairs], "bond": self.bond.to_table()}
        return found if self.others is None else {**found, "others": self.others.to_table()}

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

    Parameters
    ----------
    count, length : int
        Number of rings, and of particles in each.
    first : int
        Index of the first particle.

    Raises
    ------
    InputError
        If ``count`` is less than 1, or ``length`` less than 3.
    """
    count, length = checks.integer(count, "count", low=1), checks.integer(length, "length", low=3)
    ends = [(first + k * length, first + (k + 1) * length - 1) for k in range(count)]
    return [*chains(count, length, first), *ends]
