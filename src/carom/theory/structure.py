"""The static structure factor of hard rods, exactly, and of hard spheres, by Percus and Yevick."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.errors import InputError
from carom.theory.arithmetic import checked

NODES = 128
"""Of the quadrature: exact to rounding up to k sigma of about 100."""


def structure_factor(k: Any, packing_fraction: float, dimension: int = 3, *, diameter: float = 1.0) -> Any:
    """S(k) of an infinite fluid of equal hard rods (d = 1) or spheres (d = 3).

    Parameters
    ----------
    k : float or array
        Wave numbers [1 / length].
    packing_fraction : float
    dimension : int
        1, where it is exact, or 3, where it is the solution of the Percus-Yevick equation.
    diameter : float
        [length].

    Raises
    ------
    InputError
        If the packing fraction is not between 0 and 1, or there is no such solution in a dimension.

    Notes
    -----
    ``1 / S = 1 - rho c(k)`` with the direct correlation function within the diameter: ``-(1 - eta x) / (1 -
    eta)^2`` in 1D (J. K. Percus, J. Stat. Phys. 15, 505 (1976)), and ``-(a + b x + eta a x^3 / 2)`` in 3D (M.
    S. Wertheim, Phys. Rev. Lett. 10, 321 (1963)).
    """
    eta = float(checked(packing_fraction))
    if dimension not in (1, 3):
        raise InputError(f"S(k) in closed form is known in 1 and 3 dimensions, found {dimension}.")
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    x, w = 0.5 * (nodes + 1.0), 0.5 * weights
    q = np.asarray(k, np.float64)[..., None] * diameter * x
    if dimension == 1:
        direct = 2.0 * eta * (1.0 - eta * x) / (1.0 - eta) ** 2 * np.cos(q)
    else:
        a = (1.0 + 2.0 * eta) ** 2 / (1.0 - eta) ** 4
        b = -6.0 * eta * (1.0 + 0.5 * eta) ** 2 / (1.0 - eta) ** 4
        direct = 24.0 * eta * x**2 * (a + b * x + 0.5 * eta * a * x**3) * np.sinc(q / np.pi)
    found = 1.0 / (1.0 + np.sum(w * direct, axis=-1))
    return float(found) if np.ndim(found) == 0 else found
