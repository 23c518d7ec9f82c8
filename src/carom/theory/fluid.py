"""Equations of state of the fluid of equal hard particles: rods, disks and spheres."""

from __future__ import annotations

import math
from typing import Any

from carom import checks
from carom.theory.arithmetic import checked


def carnahan_starling(packing_fraction: Any) -> Any:
    """Z of hard spheres (d = 3), Carnahan and Starling: simple, and up to 0.3 % low in the fluid.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the spheres.

    Notes
    -----
    ``Z = (1 + eta + eta^2 - eta^3) / (1 - eta)^3``. J. Chem. Phys. 51, 635 (1969).
    """
    eta = checked(packing_fraction)
    return (1.0 + eta + eta**2 - eta**3) / (1.0 - eta) ** 3


def kolafa_labik_malijevsky(packing_fraction: Any) -> Any:
    """Z of hard spheres (d = 3), Kolafa, Labik and Malijevsky: within 1e-4 of simulation in the fluid.

    Parameters are those of :func:`carnahan_starling`.

    Notes
    -----
    A series in ``x = eta / (1 - eta)`` with the exact B_2 to B_6. Phys. Chem. Chem. Phys. 6, 2335 (2004). The
    coefficients are tested against a table of six decimals, not against the paper.
    """
    return _polynomial_in_x(
        packing_fraction,
        {
            1: 4.0,
            2: 6.0,
            3: 2.3647684,
            4: -0.8698551,
            5: 1.1062803,
            6: -1.095049,
            7: 0.637614,
            10: -0.2279397,
            14: 0.1098948,
            17: -0.00906797,
        },
    )


def pieprzyk(packing_fraction: Any) -> Any:
    """Z of hard spheres (d = 3), Kolafa-Labik-Malijevsky refitted by Pieprzyk et al.: the best one.

    Parameters are those of :func:`carnahan_starling`.

    Notes
    -----
    It is called mKLM: the same series, fitted to larger simulations, accurate to 1e-5 up to freezing. For the
    metastable fluid it holds up to some 0.55: Z has a maximum at 0.57, and is negative at 0.6. Pieprzyk,
    Bannerman, Branka, Chudak and Heyes, Phys. Chem. Chem. Phys. 21, 6886 (2019). The coefficients are those
    in the program pyenskog (DynamO) of the same authors.
    """
    return _polynomial_in_x(
        packing_fraction,
        {
            1: 4.0,
            2: 6.0,
            3: 2.3647684,
            4: -0.8698551,
            5: 1.1062803,
            6: -1.1014221,
            7: 0.66605866,
            8: -0.03633431,
            10: -0.20965164,
            14: 0.10555569,
            22: -0.00872380,
        },
    )


def henderson(packing_fraction: Any) -> Any:
    """Z of hard disks (d = 2), Henderson: simple, and 0.5 % high at eta = 0.5, 1.2 % at 0.6.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the disks.

    Notes
    -----
    ``Z = (1 + eta^2 / 8) / (1 - eta)^2``. Mol. Phys. 30, 971 (1975).
    """
    eta = checked(packing_fraction)
    return (1.0 + eta**2 / 8.0) / (1.0 - eta) ** 2


def santos_lopez_de_haro_yuste(packing_fraction: Any) -> Any:
    """Z of hard disks (d = 2), Santos, Lopez de Haro and Yuste: exact B_2, and a pole at close packing.

    Parameters are those of :func:`henderson`.

    Notes
    -----
    ``Z = 1 / (1 - 2 eta + (2 eta_0 - 1) (eta / eta_0)^2)`` with ``eta_0 = pi sqrt(3) / 6``. It is 1.5 % low
    at eta = 0.5. J. Chem. Phys. 103, 4622 (1995).
    """
    eta = checked(packing_fraction)
    close = math.pi * math.sqrt(3.0) / 6.0
    return 1.0 / (1.0 - 2.0 * eta + (2.0 * close - 1.0) * (eta / close) ** 2)


def tonks(packing_fraction: Any, n: int | None = None) -> Any:
    """Z of hard rods on a line (d = 1), exact: Tonks.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the rods.
    n : int, optional
        Number of rods on a ring; by default infinitely many.

    Raises
    ------
    InputError
        If a packing fraction is not in [0, 1), or n is less than 1.

    Notes
    -----
    ``Z = 1 / (1 - eta)``, and ``Z = 1 / n + (1 - 1 / n) / (1 - eta)`` for n rods. Phys. Rev. 50, 955 (1936).
    """
    eta = checked(packing_fraction)
    infinite = 1.0 / (1.0 - eta)
    if n is None:
        return infinite
    part = 1.0 / checks.number(n, "n", low=1)
    return part + (1.0 - part) * infinite


def _polynomial_in_x(packing_fraction: Any, coefficients: dict[int, float]) -> Any:
    """Return 1 plus the sum of ``c x^k`` with x = eta / (1 - eta)."""
    eta = checked(packing_fraction)
    x = eta / (1.0 - eta)
    return 1.0 + sum(c * x**power for power, c in coefficients.items())
