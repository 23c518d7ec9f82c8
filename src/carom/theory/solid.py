"""Equations of state of crystals of equal hard particles, and the free volume near close packing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom.densities import CLOSEST_PACKING
from carom.errors import InputError
from carom.theory.arithmetic import checked, horner

CLOSE_PACKING = {d: CLOSEST_PACKING[d] for d in range(1, 7)}
"""Packing fraction of the densest known lattices in 1 to 6 dimensions."""

LOWEST = 0.49
"""Smallest packing fraction of the fits to the fcc crystal, just below freezing. Farther down they have poles
and turn round, and no crystal persists."""

_FCC = CLOSE_PACKING[3]


def speedy(packing_fraction: Any) -> Any:
    """Z of the fcc crystal of hard spheres (d = 3), Speedy: within 1e-3 from melting to close packing.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the crystal, from 0.49 to below close packing.

    Raises
    ------
    InputError
        If a packing fraction is not in this range.

    Notes
    -----
    ``Z = 3 / (1 - z) - a (z - b) / (z - c)`` with ``z = eta / eta_0`` and (a, b, c) = (0.5921, 0.7072,
    0.601). J. Phys.: Condens. Matter 10, 4387 (1998), eq. 2.
    """
    z = _of_fcc(packing_fraction) / _FCC
    return 3.0 / (1.0 - z) - 0.5921 * (z - 0.7072) / (z - 0.601)


def almarza(packing_fraction: Any) -> Any:
    """Z of the fcc crystal of hard spheres (d = 3), Almarza: the best one at melting.

    Parameters and errors are those of :func:`speedy`.

    Notes
    -----
    The paper gives a function of the pressure, ``beta p (v - v_0) = sum_k c_k y^k`` with ``y = 1 / (beta p
    sigma^3)``. It is solved here for p by Newton's method, which starts from the free-volume law. J. Chem.
    Phys. 130, 184106 (2009), eq. 19.
    """
    coefficients = (3.0, -1.807846, 11.56350, 141.6000, -2609.260, 19328.09)
    slopes = tuple(k * c for k, c in enumerate(coefficients))[1:]
    eta = _of_fcc(packing_fraction)
    volume = math.pi / 6.0 / eta
    free = volume - math.sqrt(0.5)
    pressure = 3.0 / free
    # Convergence is quadratic from the free-volume law; the limit only ends a search far outside the crystal.
    for _ in range(50):
        y = 1.0 / pressure
        value = pressure * free - horner(coefficients, y)
        step = value / (free + horner(slopes, y) * y * y)
        pressure = pressure - step
        if np.all(np.abs(step) <= 4.0 * np.finfo(np.float64).eps * np.abs(pressure)):
            break
    return pressure * volume


def hall(packing_fraction: Any) -> Any:
    """Z of the fcc crystal of hard spheres (d = 3), Hall: the classic fit.

    Parameters and errors are those of :func:`speedy`.

    Notes
    -----
    ``Z = (12 - 3 b) / b + 2.557696 + 0.1253077 b + ...`` with ``b = 4 (1 - eta / eta_0)``. J. Chem. Phys.
    57, 2252 (1972), after the data of Alder, Hoover and Young.
    """
    b = 4.0 * (1.0 - _of_fcc(packing_fraction) / _FCC)
    series = (2.557696, 0.1253077, 0.1762393, -1.053308, 2.818621, -2.921934, 1.118413)
    return (12.0 - 3.0 * b) / b + horner(series, b)


def free_volume(packing_fraction: Any, dimension: int) -> Any:
    """Z of a crystal by the free volume of one particle in the cage of its neighbors at rest.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the crystal, below close packing.
    dimension : int
        d, 1 to 6.

    Raises
    ------
    InputError
        If the dimension is not 1 to 6, or the packing fraction is not below that of the densest lattice.

    Notes
    -----
    ``Z = 1 / (1 - (eta / eta_0)^(1/d))``. It is exact in 1D. In every dimension it is exact to leading order
    near close packing, ``Z -> d / (V / V_0 - 1)``. Salsburg and Wood, J. Chem. Phys. 37, 798 (1962).
    """
    z = _below_close_packing(packing_fraction, dimension) / CLOSE_PACKING[dimension]
    return 1.0 / (1.0 - z ** (1.0 / dimension))


def _of_fcc(packing_fraction: Any) -> Any:
    """Return a packing fraction, checked to be that of an fcc crystal of spheres."""
    eta = _below_close_packing(packing_fraction, 3)
    if not np.all(eta >= LOWEST):
        raise InputError(
            f"packing_fraction is {packing_fraction!r}; the fits to the fcc crystal hold from {LOWEST} to "
            "close packing."
        )
    return eta


def _below_close_packing(packing_fraction: Any, dimension: int) -> Any:
    """Return a packing fraction, checked to be between 0 and close packing."""
    if dimension not in CLOSE_PACKING:
        raise InputError(f"No densest lattice is known here for dimension {dimension!r}, only for 1 to 6.")
    eta, limit = checked(packing_fraction), CLOSE_PACKING[dimension]
    if not np.all((eta > 0.0) & (eta < limit)):
        raise InputError(
            f"packing_fraction is {packing_fraction!r}; a crystal in {dimension} dimensions has one "
            f"between 0 and {limit:.6f}, close packing."
        )
    return eta
