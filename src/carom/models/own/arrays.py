"""Arrays that a model of one's own has beside its fields: of the particles, prepared, and its memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models.interfaces.memory import MOMENT, Field, kept, parameter
from carom.models.interfaces.particles import Particles

SOURCES: dict[str, Callable[[Particles], Any]] = {
    "radii": lambda particles: particles.radii,
    "diameters": lambda particles: 2.0 * particles.radii,
    "masses": lambda particles: particles.masses,
    "species": lambda particles: particles.species,
}
"""What a scene has of every particle."""


class Prepared:
    """Something that is made for a model when its particles are known.

    ``make`` is called with the value and the particles. The other fields: whether it is an array of one value
    a particle (``each``), is written into by the model (``remembers``), holds times of the epoch (``times``);
    the field with the number of its items (``size``); its dimension ``time**power``.
    """

    @property
    def field(self) -> Field:
        """What it is to the engine."""
        return MOMENT if self.times else kept(self.power) if self.remembers else parameter(self.power)

    def __init__(
        self,
        make: Callable[[Any, Any], Any],
        *,
        each: bool = False,
        remembers: bool = False,
        times: bool = False,
        size: str | None = None,
        power: int = 0,
    ):
        code = getattr(make, "__code__", None)
        if code is None or code.co_argcount != 2:
            found = checks.describe(make) if code is None else f"{code.co_argcount} parameters"
            raise InputError(
                f"An array of a model is made by a method, def name(self, particles), found {found}."
            )
        self.make, self.each, self.remembers, self.times = make, each, remembers, times
        self.size, self.power = size, power

    def made(self, value: Any, particles: Any) -> Any:
        """Return it for a value and its particles, as compiled code knows it: without the padding row."""
        found = self.make(value, particles)
        if isinstance(found, np.ndarray) and found.dtype.kind in "biuf":
            whole = not (self.power or self.times)  # what has a unit of time is no count
            return np.array(found, dtype=kind_of(found) if whole else np.float64, order="C")
        if isinstance(found, np.ndarray | str) or self.remembers:
            what = f"an array of {found.dtype}" if isinstance(found, np.ndarray) else checks.describe(found)
            wanted = "an array of numbers" if self.remembers else "a number, numbers or an array of them"
            raise InputError(
                f"{self.make.__name__} of {type(value).__name__} must return {wanted}, found {what}."
            )
        if isinstance(found, bool | int | np.integer):
            return int(found)
        return float(found) if isinstance(found, float | np.floating) else found


def kind_of(values: np.ndarray) -> type:
    """Return the type of the numbers that compiled code gets for those of an array."""
    return {"b": np.bool_, "f": np.float64}.get(values.dtype.kind, np.int64)


def per_particle(what: str | Callable[[Any, Particles], Any]) -> Any:
    """Give a model an array of one value a particle.

    In the body of the class: ``species = own.per_particle("species")``. Or as a decorator of a method
    ``charge(self, particles)`` that returns the array.

    Parameters
    ----------
    what : {"radii", "diameters", "masses", "species"} or callable
        What the scene has of every particle, or the method.

    Returns
    -------
    Prepared
        What the class decorator replaces by the array.

    Raises
    ------
    InputError
        If a scene has no such array.

    Notes
    -----
    Methods read it as ``self.species[i]``. What ``interaction_time`` reads is loaded for eight particles at a
    time. The array of an interaction, a contact law or an obstacle has one item more than there are
    particles: it is for a padding row that nobody meets.
    """
    if callable(what):
        return Prepared(what, each=True)
    if what not in SOURCES:
        raise InputError(f"per_particle() takes one of {', '.join(SOURCES)}, found {checks.describe(what)}.")

    def make(value: Any, particles: Particles) -> np.ndarray:
        found = SOURCES[what](particles)
        if found is None:
            raise InputError(
                f"{type(value).__name__} reads the {what} of the particles, and the scene has none: give it "
                f"{what}=."
            )
        return np.asarray(found)

    return Prepared(make, each=True)


def prepared(method: Callable[[Any, Particles], Any]) -> Any:
    """Compute something once, before the run: a decorator of a method ``name(self, particles)``.

    Parameters
    ----------
    method : callable
        It returns a number, a tuple of numbers or an array. ``self`` is the value, with the fields as given;
        ``particles`` is a :class:`carom.models.interfaces.particles.Particles`, None for an obstacle at rest.

    Returns
    -------
    Prepared
        What the class decorator replaces by the result: methods read it as ``self.name``.
    """
    return Prepared(method)


def memory(start: Any, size: int | str | tuple[int, ...] | None = None, *, times: bool = False) -> Any:
    """Give a model an array that its methods write into.

    In the body of the class: ``turned = own.memory(0)``. Or as a decorator of a method ``due(self,
    particles)`` that returns the array. What has a unit of time is annotated with it, as a field is:
    ``fastest: own.Speed = own.memory(0.0)``, or ``def due(self, particles) -> own.Time``.

    Parameters
    ----------
    start : number or callable
        What all items are at the start, an int or a float; or the method.
    size : int, tuple of ints or str, optional
        Number of items, or the name of a field that holds it. By default one a particle.
    times : bool
        Whether it holds times ``now`` of interactions, contact laws or obstacles, which count from the
        beginning of an epoch. They are then shifted when an epoch ends.

    Returns
    -------
    Prepared
        What the class decorator replaces by the array.

    Raises
    ------
    InputError
        If ``start`` is no number, or ``size`` is none of these.

    Notes
    -----
    A checkpoint keeps the memory, and it goes on when velocities are rescaled, in the engine's unit of time
    then. A model with ``shift_epoch`` or ``copy_state`` does more than that.
    """
    if callable(start):
        return Prepared(start, remembers=True, times=times)
    if isinstance(start, bool) or not isinstance(start, int | float):
        raise InputError(f"memory() starts with a number, found {checks.describe(start)}.")
    if not (size is None or isinstance(size, str)):
        lengths = size if isinstance(size, tuple) else (size,)
        if not lengths or not all(isinstance(each, int | np.integer) and each >= 0 for each in lengths):
            raise InputError(
                "memory() takes how many items it has: an int, a tuple of them, or the name of one field "
                f"that holds an int; found {size!r}."
            )
    kind = np.float64 if isinstance(start, float) else np.int64

    def make(value: Any, particles: Any) -> np.ndarray:
        shape: Any = size
        if size is None:
            shape = len(particles.radii)
        elif isinstance(size, str):
            shape = checks.integer(getattr(value, size), f"{size} of {type(value).__name__}", low=0)
        return np.full(shape, start, kind)

    named = size if isinstance(size, str) else None
    return Prepared(make, each=size is None, remembers=True, times=times, size=named)
