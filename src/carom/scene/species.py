"""Diameters, masses and species of the components, and the distances at which pairs touch."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks
from carom.configuration import MOST_SPECIES
from carom.errors import InputError
from carom.suggestions import corrected


@corrected()
@dataclass(frozen=True)
class Species:
    """One species of a mixture.

    Parameters
    ----------
    name : str, optional
        Name of the species, for files and tables; by default its number.
    fraction : float, optional
        Part of the n spheres that it has. All species have a fraction, which add up to 1, or all have a
        count.
    count : int, optional
        Number of its spheres.
    diameter, mass : float
        Diameter [length] and mass.

    Raises
    ------
    InputError
        If a value has the wrong type or is out of range.

    Examples
    --------
    >>> Species("small", fraction=0.8, diameter=0.5)
    Species(name='small', fraction=0.8, count=None, diameter=0.5, mass=1.0)
    """

    name: str | None = None
    fraction: float | None = None
    count: int | None = None
    diameter: float = 1.0
    mass: float = 1.0

    def __post_init__(self) -> None:
        if self.name is not None and not isinstance(self.name, str):
            raise InputError(f"name of a Species must be a string, found {checks.describe(self.name)}.")
        whose = f"of species {self.name}" if self.name else "of a Species"
        if self.fraction is not None:
            low = checks.number(self.fraction, f"fraction {whose}", low=0.0, high=checks.MAGNITUDE)
            object.__setattr__(self, "fraction", low)
        if self.count is not None:
            object.__setattr__(self, "count", checks.integer(self.count, f"count {whose}", low=0))
        for name in ("diameter", "mass"):
            object.__setattr__(self, name, checks.positive(getattr(self, name), f"{name} {whose}"))


def checked_species(given: Any) -> list[Species]:
    """Return a list of species, all of which have a count, or all a fraction."""
    found = listed(given, "species")
    for each in found:
        if not isinstance(each, Species):
            raise InputError(f"species must be a list of Species, found {checks.describe(each)} in it.")
    ways = {(each.count is not None, each.fraction is not None) for each in found}
    if len(ways) != 1 or ways & {(True, True), (False, False)}:
        raise InputError("Give each species a fraction, or each a count.")
    return found


def per_component(value: Any, name: str, n: int) -> np.ndarray:
    """Return a positive property of each component, (n,) and read-only, from one number or n of them."""
    if not checks.several(value):
        each = np.full(n, checks.positive(value, name))
    else:
        each = checks.array(value, name, "(n,)", ndim=1)
        if len(each) != n:
            raise InputError(f"{name} must be one number or {n}, one a component; found {len(each)}.")
        worst = int(np.argmin(each)) if each.min() < 1 / checks.MAGNITUDE else int(np.argmax(each))
        checks.positive(float(each[worst]), f"{name} of component {worst}")
    each.setflags(write=False)
    return each


def labels(species: Any, n: int) -> np.ndarray | None:
    """Return the species of each component, (n,) int64 and read-only, or None."""
    if species is None:
        return None
    try:
        given = np.asarray(species)
    except ValueError:  # rows of unequal length
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iu" or given.shape != (n,):
        found = f"shape {given.shape}" if given.dtype.kind in "iu" else f"values of type {given.dtype}"
        raise InputError(f"species must be {n} integers, one a component, found {found}.")
    if given.min() < 0 or given.max() >= MOST_SPECIES:
        wrong = given.min() if given.min() < 0 else given.max()
        raise InputError(f"species must be from 0 to {MOST_SPECIES - 1}, found {wrong}.")
    result = given.astype(np.int64)
    result.setflags(write=False)
    return result


def names(given: Any, species: np.ndarray | None) -> tuple[str, ...]:
    """Return the names of the species, one each and all different, or ()."""
    if given is None or (isinstance(given, Sequence) and len(given) == 0):
        return ()
    if isinstance(given, str) or not isinstance(given, Sequence | np.ndarray):
        raise InputError(f"species_names must be a list of names, found {checks.describe(given)}.")
    result = tuple(given)
    for name in result:
        if not isinstance(name, str) or not name or not name.isprintable() or len(name) > 40:
            raise InputError(
                f"A species' name must be a string of 1 to 40 printable characters, found "
                f"{checks.describe(name)}."
            )
    if len(set(result)) < len(result):
        raise InputError(f"species_names must differ, found {', '.join(result)}.")
    if species is None:
        raise InputError("species_names need species: say of each component which one it is.")
    if species.max() >= len(result):
        raise InputError(f"Species {species.max()} has no name: {len(result)} are given.")
    return result


def pair_name(one: int | str, other: int | str) -> str:
    """Return the name of a pair of species, such as "large-small", by their names or numbers.

    A name that holds a hyphen or a quote stands in quotes, so that different pairs have different names.
    """
    return "-".join(json.dumps(name, ensure_ascii=False) if {*name} & {*'-"'} else name
                    for name in map(str, (one, other)))  # fmt: skip


def contact_matrix(given: Any, species: np.ndarray | None, diameters: np.ndarray) -> np.ndarray | None:
    """Return the contact distances (K, K) between species, read-only, or None where they are additive."""
    if given is None:
        return None
    matrix = checks.array(given, "contact", "(K, K)", ndim=2)
    count = len(matrix)
    if matrix.shape != (count, count) or count == 0:
        raise InputError(f"contact must be a table of K x K distances, found shape {matrix.shape}.")
    if species is None:
        raise InputError("contact needs species: say of each component which one it is.")
    if species.max() >= count:
        raise InputError(f"contact is a table of {count} species, found species {species.max()}.")
    for k, row in enumerate(matrix):
        for distance in row:
            checks.positive(float(distance), "contact")
        own = diameters[species == k]
        if own.size and (own != row[k]).any():
            raise InputError(
                f"contact[{k}][{k}] must be the diameter of species {k}, found {row[k]:.6g} for a diameter "
                f"of {own[own != row[k]][0]:.6g}."
            )
    if (matrix != matrix.T).any():
        i, j = map(int, np.argwhere(matrix != matrix.T)[0])
        raise InputError(
            f"contact must be symmetric, found {matrix[i, j]:.6g} at [{i}, {j}] and {matrix[j, i]:.6g} at "
            f"[{j}, {i}]."
        )
    matrix.setflags(write=False)
    return matrix


def counts_of(fractions: Any, n: int) -> tuple[int, ...]:
    """Return how many of n components each species gets, by ``fractions`` that add up to 1.

    The numbers are rounded down, and those that lost most by it get one more.
    """
    exact = checks.shares(fractions) * n
    result = np.floor(exact).astype(np.int64)
    lost = np.argsort(result - exact, kind="stable")
    result[lost[: n - result.sum()]] += 1
    return tuple(map(int, result))


def listed(values: Any, name: str) -> list[Any]:
    """Return values as a list; one is given for each species."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        raise InputError(f"{name} must be a list, one value a species, found {checks.describe(values)}.")
    return list(values)


def counts_from(counts: Any, n: Any, fractions: Any, most: int) -> tuple[int, ...]:
    """Return the numbers of each species, from one of the two ways to give them."""
    if (counts is None) == (fractions is None):
        raise InputError(
            "Give counts, or n and fractions, for the species; found "
            f"{'neither' if counts is None else 'both'}."
        )
    if counts is None:
        return counts_of(fractions, checks.integer(n, "n", low=1, high=most))
    result = tuple(checks.integer(c, "counts", low=0, high=most) for c in listed(counts, "counts"))
    if n is not None and checks.integer(n, "n", low=1) != sum(result):
        raise InputError(f"counts add up to {sum(result)}, but n is {n}; leave n out.")
    return result
