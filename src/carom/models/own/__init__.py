"""All that a model of one's own needs: ``from carom.models import own`` (docs/models.md).

A model is one class with a decorator that says what it is. Its fields are parameters, and its methods answer
what the engine asks. The decorator makes a frozen dataclass of it, which goes into ``Scene``. Those methods
that are asked during a run are compiled, with ``self`` a tuple of the fields and arrays of the model. The
engine knows nothing of classes: it is given that tuple.
"""

from __future__ import annotations

import sys
from typing import TypeVar, dataclass_transform

from carom.models.interactions.step_pairs import cross, end_of_step
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.steps import BOUNCE, CORE, IN, OUT
from carom.models.mathematics.contact import elastic, first_contact
from carom.models.mathematics.counter_random import normal, uniform
from carom.models.own import classes, kinds
from carom.models.own.arrays import memory, per_particle, prepared
from carom.models.own.fields import Acceleration, Array, Energy, Momentum, PerParticle, Rate, Speed, Time

T = TypeVar("T")

__all__ = [
    "BOUNCE",
    "CORE",
    "IN",
    "NEVER",
    "OUT",
    "Acceleration",
    "Array",
    "Energy",
    "Momentum",
    "PerParticle",
    "Rate",
    "Speed",
    "Time",
    "cross",
    "drive",
    "elastic",
    "end_of_step",
    "first_contact",
    "impact",
    "interaction",
    "memory",
    "motion",
    "normal",
    "observer",
    "obstacle",
    "path",
    "per_particle",
    "prepared",
    "uniform",
]


@dataclass_transform(frozen_default=True)
def interaction(cls: type[T]) -> type[T]:
    """Make a class an interaction of two particles, for ``Scene(interaction=...)``.

    It needs the methods ``reach(self, scene)``, ``interaction_time`` and ``jump``. With ``step_time`` and
    ``step_jump`` instead of these two, its pairs have steps, and it needs ``energies(self)`` and
    ``step_of(self, distance)``, too.

    Parameters
    ----------
    cls : type
        The class.

    Returns
    -------
    type
        The same class, a frozen dataclass.

    Raises
    ------
    InputError
        If a method is missing or has other parameters, or a field is of a type that cannot be compiled.

    Examples
    --------
    >>> from carom.models import own
    >>> @own.interaction
    ... class Cores:
    ...     contact: float
    ...
    ...     def reach(self, scene):
    ...         return self.contact
    ...
    ...     def interaction_time(self, i, j, rr, rv, vv, now):
    ...         return own.first_contact(rr - self.contact * self.contact, rv, vv)
    ...
    ...     def jump(self, i, j, rr, rv, now):
    ...         return own.elastic(self, i, j, rr, rv)
    >>> Cores(contact=1.0)
    Cores(contact=1.0)
    """
    return classes.made(cls, kinds.INTERACTION, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def motion(cls: type[T]) -> type[T]:
    """Make a class a motion between two events, for ``Scene(motion=...)``.

    It needs the methods ``position`` and ``velocity``.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.MOTION, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def impact(cls: type[T]) -> type[T]:
    """Make a class a contact law, for ``Scene(impact=...)``.

    It needs the method ``transfer``.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.IMPACT, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def obstacle(cls: type[T]) -> type[T]:
    """Make a class an obstacle, for ``Scene(obstacles=[...])``.

    A convex shape needs the method ``closest(self, x, axis)``, and may have ``rounding(self)``; any other one
    ``gap(self, positions, radii, box, periodic)``, ``encounter`` and ``outward``. Without a field ``name`` it
    gets one, which is the name of the class by default.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.OBSTACLE, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def drive(cls: type[T]) -> type[T]:
    """Make a class a drive of single particles, for ``Scene(drive=...)``.

    It needs the methods ``next_time`` and ``kick``.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.DRIVE, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def observer(cls: type[T]) -> type[T]:
    """Make a class an observer of events, for ``Simulation(observers=[...])`` and ``sim.measure``.

    It needs one of the methods ``at_pair``, ``at_obstacle`` and ``at_epoch``. With ``add(block)`` in Python,
    which returns a number or an array, ``sim.measure`` gives the mean over blocks with its error bar.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.OBSERVER, sys._getframe(1).f_locals)


@dataclass_transform(frozen_default=True)
def path(cls: type[T]) -> type[T]:
    """Make a class the path of an obstacle that moves, for ``Shaken``.

    It needs the methods ``place`` and ``pace``, and ``lowest``, ``highest``, ``period`` and ``acceleration``.

    Parameters and errors are those of :func:`interaction`.
    """
    return classes.made(cls, kinds.PATH, sys._getframe(1).f_locals)


def __dir__() -> list[str]:
    return sorted(__all__)
