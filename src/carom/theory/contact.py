"""What follows from the compressibility factor alone: contact values and collision rates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.theory.arithmetic import checked
from carom.theory.finite_size import speed_factor


def contact_value(
    compressibility_factor: Any, packing_fraction: Any, dimension: int, n: int | None = None
) -> Any:
    """Contact value g(sigma+) that a compressibility factor implies.

    Parameters
    ----------
    compressibility_factor, packing_fraction : float or array
        Z and eta.
    dimension : int
        d.
    n : int, optional
        Number of particles, if g is normalized by (N - 1) / V as in :mod:`carom.observables.rdf`. By default
        infinitely many.

    Raises
    ------
    InputError
        If a packing fraction is not in [0, 1), or n is less than 2.

    Notes
    -----
    The virial theorem of hard spheres is ``Z - 1 = 2^(d - 1) eta g(sigma+)``. For N particles the right side
    has the factor (N - 1) / N.
    """
    pairs = 1.0 if n is None else (checks.number(n, "n", low=2) - 1.0) / n
    return (compressibility_factor - 1.0) / (2.0 ** (dimension - 1) * checked(packing_fraction) * pairs)


def compressibility_factor(contact: Any, packing_fraction: Any, dimension: int, n: int | None = None) -> Any:
    """Z that a ``contact`` value implies: the inverse of :func:`contact_value`.

    The other parameters are those of :func:`contact_value`.

    Raises
    ------
    InputError
        If a packing fraction is not in [0, 1), or n is less than 1.
    """
    pairs = 1.0 if n is None else (checks.number(n, "n", low=1) - 1.0) / n
    return 1.0 + 2.0 ** (dimension - 1) * checked(packing_fraction) * pairs * contact


def collision_rate(
    compressibility_factor: Any,
    dimension: int,
    *,
    n: int | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
    kT: float = 1.0,
) -> Any:
    """Collisions of one particle per time, as Z implies (Enskog; exact at every density).

    Parameters
    ----------
    compressibility_factor : float or array
        Z, of N particles if `n` is given.
    dimension : int
        d.
    n : int, optional
        Number of particles at constant energy and zero momentum in a periodic box. By default infinitely
        many.
    diameter, mass, kT : float
        Diameter [length], mass and temperature [energy].

    Raises
    ------
    InputError
        If n is less than 2: one particle meets nobody.

    Notes
    -----
    ``2 d (Z - 1) / sqrt(pi) sqrt(kT / m) / sigma``, times :func:`speed_factor` of d (N - 1) for N particles.
    A collision counts for both partners, so that N particles have N / 2 times this rate. Chapman and Cowling,
    The Mathematical Theory of Non-uniform Gases, sec. 16.2.
    """
    correction = 1.0 if n is None else speed_factor(dimension * (checks.number(n, "n", low=2) - 1))
    speed = math.sqrt(kT / mass)
    return (
        2.0 * dimension * (compressibility_factor - 1.0) / math.sqrt(math.pi) * speed / diameter * correction
    )


def mean_free_time(
    compressibility_factor: Any,
    dimension: int,
    *,
    n: int | None = None,
    diameter: float = 1.0,
    mass: float = 1.0,
    kT: float = 1.0,
) -> Any:
    """Mean time between two collisions of a particle: ``1 / collision_rate(...)``.

    Parameters are those of :func:`collision_rate`.

    Raises
    ------
    InputError
        If Z is not above 1, or n is less than 2.
    """
    if not np.all(np.asarray(compressibility_factor) > 1.0):
        raise InputError(
            f"Z is {compressibility_factor!r}; it must be above 1, where the mean free time is infinite."
        )
    return 1.0 / collision_rate(compressibility_factor, dimension, n=n, diameter=diameter, mass=mass, kT=kT)


def ball_volume(dimension: int, diameter: float = 1.0) -> float:
    """Volume of a ball in ``dimension`` d [length^d]: ``pi^(d/2) / Gamma(d/2 + 1) (diameter / 2)^d``."""
    return math.pi ** (0.5 * dimension) / math.gamma(0.5 * dimension + 1.0) * (0.5 * diameter) ** dimension
