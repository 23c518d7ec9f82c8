"""The particles, from which a value makes its model; and time that never comes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from carom.errors import InputError
from carom.units import TimeUnit

NEVER = np.inf
"""Time of what does not happen (the paper's + infinity)."""


@dataclass(frozen=True)
class Particles:
    """The particles, from which a value makes its model, in the engine's unit of time.

    Attributes
    ----------
    box : tuple of d floats
        Edges [length].
    radii, masses : (n,) float64 arrays
        Radius [length] and mass of each particle.
    species : (n,) int64 array or None
        Species of each particle.
    rates : (n,) float64 array or None
        Rate at which each radius grows, where diameters grow [length / time].
    equal : bool
        Whether all have one diameter and one mass.
    unit : TimeUnit
        The engine's unit of time.
    """

    box: tuple[float, ...]
    radii: np.ndarray
    masses: np.ndarray
    species: np.ndarray | None
    rates: np.ndarray | None
    equal: bool
    unit: TimeUnit

    def with_padding(self, values: Any, dtype: Any = np.float64) -> np.ndarray:
        """Return ``values``, one a particle, as an array of ``dtype`` that ends with a copy of the first."""
        values = np.asarray(values)
        return np.concatenate([values, values[:1]]).astype(dtype)

    def speed(self, value: Any) -> Any:
        """Return a speed ``value`` in the engine's unit of time: exact, as units differ by a power of two."""
        return self.unit.to_kernel(value, -1)


M = TypeVar("M")


def lanes(*names: str) -> Callable[[type[M]], type[M]]:
    """Name the fields that ``interaction_time`` reads of candidate j: arrays of one value a particle.

    This is a class decorator; ``names`` are names of fields. The search loads these fields for eight
    candidates at a time. Other fields are loaded one by one, which is slower and gives the same bits.

    Raises
    ------
    InputError
        If the class has no such field.
    """

    def decorate(model: type[M]) -> type[M]:
        for name in names:
            if name not in model._fields:  # type: ignore[attr-defined]
                known = ", ".join(model._fields)  # type: ignore[attr-defined]
                raise InputError(f"{model.__name__} has no field {name!r} for a lane; known are {known}.")
        model.lanes = names  # type: ignore[attr-defined]
        return model

    return decorate


def species_count(scene: Any) -> int:
    """Return the number of species of a scene, K: 1 where none are given."""
    if scene.species is None:
        return 1
    contacts = 0 if scene.contact is None else len(scene.contact)
    return max(int(scene.species.max()) + 1, len(scene.species_names), contacts)
