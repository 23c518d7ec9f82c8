"""What is known about hard particles: equations of state, contact values, collision rates; with sources.

An equation of state here is a function from the packing fraction ``eta`` of an infinite fluid of equal hard
spheres (rods, disks, ... hyperspheres) to the compressibility factor ``Z = P V / (N kT)``. All functions take
floats or arrays and return what they were given. None knows about freezing: they are meant for the stable
fluid, up to eta = 0.69 (2D, where accuracy fades from 0.6 on), 0.494 (3D), about 0.29 (4D), 0.17 (5D) and
0.10 (6D).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from carom.errors import InputError

Equation = Callable[[Any], Any]

# beta_k of Z = 1 + sum beta_k eta^(k - 1), given as b_k = B_k / B_2^(k - 1), from k = 3 on; B_2 = 2^(d - 1) v
# with v the volume of a particle. d = 1 is exact (Tonks). Otherwise B_3 and, for even d, B_4 are analytic;
# the rest are numerical: Clisby and McCoy, J. Stat. Phys. 122, 15 (2006), but for d = 3, B_5 to B_8: Labik,
# Kolafa and Malijevsky, Phys. Rev. E 71, 021105 (2005), B_9 and B_10: Schultz and Kofke's fit, and B_11:
# Wheatley, Phys. Rev. Lett. 110, 200601 (2013).
_REDUCED_VIRIALS: dict[int, tuple[float, ...]] = {
    2: (0.7820044379, 0.532231807, 0.33355604, 0.1988425, 0.1148728, 0.064993, 0.0362193, 0.0199537),
    3: (
        0.625,
        0.286949506,
        0.11025176,
        0.038882324,
        0.013022778,
        0.0041833496,
        0.0013096606,
        0.00040299068,
        0.00012192115,
    ),
    4: (0.50634, 0.15184606, 0.0357041, 0.0077359, 0.0014303, 0.0002888, 4.41e-05, 1.13e-05),
    5: (0.414063, 0.0759724807, 0.0129551, 0.0009815, 0.0004162, -0.000112, 7.47e-05, -4.92e-05),
    6: (0.340941, 0.03336314, 0.0075231, -0.0017385, 0.0013066, -0.000895, 0.0006673, -0.000525),
}

# Order of numerator and denominator of the approximants whose mean is virial_pade's default. Each uses all
# coefficients known to better than 5 % (ten in 2D and 6D, nine in 5D, eight in 4D).
_PADE_ORDERS = {
    2: ((5, 4), (4, 5)),
    3: ((5, 4), (4, 5)),
    4: ((4, 3), (3, 4)),
    5: ((4, 4),),
    6: ((5, 4), (4, 5)),
}


def carnahan_starling(packing_fraction: Any) -> Any:
    """Z of hard spheres (d = 3), Carnahan and Starling: simple, and up to 0.3 % low.

    Notes
    -----
    ``Z = (1 + eta + eta^2 - eta^3) / (1 - eta)^3``. J. Chem. Phys. 51, 635 (1969).
    """
    eta = _checked(packing_fraction)
    return (1.0 + eta + eta**2 - eta**3) / (1.0 - eta) ** 3


def kolafa_labik_malijevsky(packing_fraction: Any) -> Any:
    """Z of hard spheres (d = 3), Kolafa, Labik and Malijevsky: within 1e-4 of simulation in the fluid.

    Notes
    -----
    A series in ``x = eta / (1 - eta)`` that keeps B_2 to B_6. Phys. Chem. Chem. Phys. 6, 2335 (2004). The
    coefficients are tested against a table of six decimals, not against the print.
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

    Notes
    -----
    Called mKLM: the same series, fitted to larger simulations; 1e-5 up to freezing. Pieprzyk, Bannerman,
    Branka, Chudak and Heyes, Phys. Chem. Chem. Phys. 21, 6886 (2019); the coefficients as they stand in
    the program pyenskog (DynamO) of the same authors.
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
    """Z of hard disks (d = 2), Henderson: simple, and 0.5 % high at eta = 0.5.

    Notes
    -----
    ``Z = (1 + eta^2 / 8) / (1 - eta)^2``. Mol. Phys. 30, 971 (1975).
    """
    eta = _checked(packing_fraction)
    return (1.0 + eta**2 / 8.0) / (1.0 - eta) ** 2


def santos_lopez_de_haro_yuste(packing_fraction: Any) -> Any:
    """Z of hard disks (d = 2), Santos, Lopez de Haro and Yuste: exact B_2, and a pole at close packing.

    Notes
    -----
    ``Z = 1 / (1 - 2 eta + (2 eta_0 - 1) (eta / eta_0)^2)`` with ``eta_0 = pi sqrt(3) / 6``. It is 1.5 % low
    at eta = 0.5. J. Chem. Phys. 103, 4622 (1995).
    """
    eta = _checked(packing_fraction)
    close = math.pi * math.sqrt(3.0) / 6.0
    return 1.0 / (1.0 - 2.0 * eta + (2.0 * close - 1.0) * (eta / close) ** 2)


def tonks(packing_fraction: Any, n: int | None = None) -> Any:
    """Z of hard rods on a line (d = 1), exact: Tonks.

    Parameters
    ----------
    packing_fraction : float or array
    n : int, optional
        Rods on a ring; infinitely many without it.

    Notes
    -----
    ``Z = 1 / (1 - eta)``, and ``Z = 1 / n + (1 - 1 / n) / (1 - eta)`` for n rods. Phys. Rev. 50, 955 (1936).
    """
    eta = _checked(packing_fraction)
    infinite = 1.0 / (1.0 - eta)
    return infinite if n is None else 1.0 / n + (1.0 - 1.0 / n) * infinite


def virial_coefficients(dimension: int) -> np.ndarray:
    """Known coefficients ``beta_k`` of ``Z = 1 + sum_k beta_k eta^(k - 1)``, from k = 2 on.

    Parameters
    ----------
    dimension : int
        1 to 6.

    Returns
    -------
    (m,) float64 array
        ``B_k / v^(k - 1)`` with v the volume of a particle; 9 or 10 of them (all are 1 for d = 1, and 9 are
        given).

    Raises
    ------
    InputError
        If the dimension is not 1 to 6.

    Notes
    -----
    Sources stand beside the numbers in the module. For d >= 5 the series alternates and diverges within the
    fluid: use :func:`virial_pade`.
    """
    if dimension == 1:
        return np.ones(9)
    if dimension not in _REDUCED_VIRIALS:
        raise InputError(
            f"No virial coefficients are known here for dimension {dimension!r}; there are those of 1 to 6."
        )
    reduced = np.array((1.0, *_REDUCED_VIRIALS[dimension]))
    return reduced * (2.0 ** (dimension - 1)) ** np.arange(1, reduced.size + 1)


def virial_series(packing_fraction: Any, dimension: int, order: int | None = None) -> Any:
    """Z by the virial series, up to ``B_order`` (all known ones without it).

    Raises
    ------
    InputError
        If the dimension is not 1 to 6, or `order` is not 1 to the highest known.
    """
    eta = _checked(packing_fraction)
    beta = virial_coefficients(dimension)
    known = beta.size + 1
    if order is not None and not 1 <= order <= known:
        raise InputError(f"order is {order}; in {dimension} dimensions B_1 to B_{known} are known.")
    return _horner((1.0, *beta[: (order or known) - 1]), eta)


def virial_pade(packing_fraction: Any, dimension: int, orders: tuple[int, int] | None = None) -> Any:
    """Z by a Pade approximant to the virial series.

    Parameters
    ----------
    packing_fraction : float or array
    dimension : int
        1 to 6.
    orders : (int, int), optional
        Of numerator and denominator; their sum is the highest power of eta that is reproduced. Without it,
        the mean of the near-diagonal ones, e.g. [5/4] and [4/5] in 2D.

    Raises
    ------
    InputError
        If the dimension is not 1 to 6, or `orders` need coefficients that are not known.

    Notes
    -----
    The two approximants differ by 1e-4 (relative) at eta = 0.5 and 0.6 in 2D, but are both 1.5 % above
    simulation at 0.67. In 4D they differ by 1e-4 at eta = 0.25, in 6D by 2e-4 at 0.1.
    """
    eta = _checked(packing_fraction)
    if dimension == 1:
        return tonks(eta)
    beta = virial_coefficients(dimension)
    chosen = _PADE_ORDERS[dimension] if orders is None else (orders,)
    values = []
    for above, below in chosen:
        if min(above, below) < 0 or above + below > beta.size:
            raise InputError(
                f"A [{above}/{below}] approximant needs powers up to {above + below}; "
                f"{beta.size} are known in {dimension} dimensions."
            )
        numerator, denominator = _pade(np.concatenate(([1.0], beta)), above, below)
        values.append(_horner(numerator, eta) / _horner(denominator, eta))
    return sum(values) / len(values)


def best(dimension: int) -> Equation:
    """Best equation of state known here for the fluid in `dimension` dimensions.

    Returns
    -------
    callable
        :func:`tonks` (exact) in 1D, :func:`pieprzyk` in 3D, otherwise :func:`virial_pade` of that dimension.

    Raises
    ------
    InputError
        If the dimension is not 1 to 6.
    """
    virial_coefficients(dimension)
    if dimension == 1:
        return tonks
    if dimension == 3:
        return pieprzyk

    def equation(packing_fraction: Any) -> Any:
        return virial_pade(packing_fraction, dimension)

    equation.__name__ = "virial_pade"
    return equation


def finite_size_shift(packing_fraction: Any, n: int, equation: Equation) -> Any:
    """``Z_N - Z`` of N particles in a periodic box of given volume, to leading order in 1 / N.

    Parameters
    ----------
    packing_fraction : float or array
    n : int
        Number of particles N.
    equation : callable
        Z of the infinite fluid.

    Notes
    -----
    ``-(1 / 2N) d ln[d(eta Z)/d eta] / d ln eta``: the canonical ensemble forbids the fluctuations of density.
    Exact in 1D; good to 3e-4 at N = 108 for a density of 0.5 in 3D, and too small a system there for 0.8.
    Lebowitz and Percus, Phys. Rev. 124, 1673 (1961). Derivatives are five-point differences with the relative
    step eps^(1/6), good to about eps^(2/3).
    """
    eta = _checked(packing_fraction)
    step = np.finfo(np.float64).eps ** (1.0 / 6.0) * eta
    far_below, below, here, above, far_above = (
        (eta + k * step) * equation(eta + k * step) for k in (-2, -1, 0, 1, 2)
    )
    # With f = eta Z: eta f'' / f', each difference in units of its step, which is a fixed part of eta.
    slope = (far_below - 8.0 * below + 8.0 * above - far_above) / 12.0
    curvature = (-far_below + 16.0 * below - 30.0 * here + 16.0 * above - far_above) / 12.0
    relative_step = np.finfo(np.float64).eps ** (1.0 / 6.0)
    return -curvature / slope / relative_step / (2.0 * n)


def contact_value(
    compressibility_factor: Any, packing_fraction: Any, dimension: int, n: int | None = None
) -> Any:
    """Contact value g(sigma+) that a compressibility factor implies.

    Parameters
    ----------
    compressibility_factor, packing_fraction : float or array
    dimension : int
    n : int, optional
        Number of particles, if g is normalised by (N - 1) / V as in :mod:`carom.observables.rdf`; infinitely
        many without it.

    Notes
    -----
    The virial theorem of hard spheres, ``Z - 1 = 2^(d - 1) eta g(sigma+)``, for N particles times (N - 1) /
    N.
    """
    pairs = 1.0 if n is None else (n - 1.0) / n
    return (compressibility_factor - 1.0) / (2.0 ** (dimension - 1) * _checked(packing_fraction) * pairs)


def compressibility_factor(contact: Any, packing_fraction: Any, dimension: int, n: int | None = None) -> Any:
    """Z that a contact value implies: the inverse of :func:`contact_value`."""
    pairs = 1.0 if n is None else (n - 1.0) / n
    return 1.0 + 2.0 ** (dimension - 1) * _checked(packing_fraction) * pairs * contact


def speed_factor(degrees_of_freedom: float) -> float:
    """Ratio c_D of the collision rate at constant energy to that at constant temperature.

    Parameters
    ----------
    degrees_of_freedom : float
        D of the velocities: d (N - 1) on a torus with zero total momentum, d N in a box with walls.

    Notes
    -----
    ``c_D = sqrt(D / 2) Gamma(D / 2) / Gamma((D + 1) / 2)``, 1 + 1 / (4 D) for large D, from the mean of
    ``|v|`` over the sphere ``v^2 = D``. At constant energy the virial, quadratic in speeds, has no such
    factor.
    """
    half = 0.5 * degrees_of_freedom
    return math.exp(0.5 * math.log(half) + math.lgamma(half) - math.lgamma(half + 0.5))


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
    n : int, optional
        Number of particles at constant energy and zero momentum in a periodic box; infinitely many without
        it.
    diameter, mass, kT : float
        Length, mass and energy units.

    Notes
    -----
    ``2 d (Z - 1) / sqrt(pi) sqrt(kT / m) / sigma``, times :func:`speed_factor` of d (N - 1). A collision
    counts for both partners: a system has half of N times this. Chapman and Cowling, The Mathematical Theory
    of Non-uniform Gases, sec. 16.2.
    """
    correction = 1.0 if n is None else speed_factor(dimension * (n - 1))
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
    """Mean time between two collisions of a particle: ``1 / collision_rate(...)``, same parameters."""
    return 1.0 / collision_rate(compressibility_factor, dimension, n=n, diameter=diameter, mass=mass, kT=kT)


def ball_volume(dimension: int, diameter: float = 1.0) -> float:
    """Volume of a d-dimensional ball [length^d]: ``pi^(d/2) / Gamma(d/2 + 1) (diameter / 2)^d``."""
    return math.pi ** (0.5 * dimension) / math.gamma(0.5 * dimension + 1.0) * (0.5 * diameter) ** dimension


def _checked(packing_fraction: Any) -> Any:
    eta = np.asarray(packing_fraction, dtype=np.float64)
    if not ((eta >= 0.0) & (eta < 1.0)).all():
        raise InputError(f"packing_fraction is {packing_fraction!r}; it lies between 0 and 1.")
    return eta if eta.ndim else float(eta)


def _horner(coefficients: Any, x: Any) -> Any:
    total = 0.0 * x
    for c in reversed(coefficients):
        total = total * x + float(c)
    return total


def _polynomial_in_x(packing_fraction: Any, coefficients: dict[int, float]) -> Any:
    eta = _checked(packing_fraction)
    x = eta / (1.0 - eta)
    return 1.0 + sum(c * x**power for power, c in coefficients.items())


def _pade(series: np.ndarray, above: int, below: int) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator (constant term 1) that agree with `series` as far as they can."""

    def term(k: int) -> float:
        return float(series[k]) if k >= 0 else 0.0

    denominator = np.ones(1)
    if below:
        matrix = np.array([[term(above + i - j) for j in range(1, below + 1)] for i in range(1, below + 1)])
        right = -np.array([term(above + i) for i in range(1, below + 1)])
        denominator = np.concatenate(([1.0], np.linalg.solve(matrix, right)))
    numerator = np.convolve(series[: above + 1], denominator)[: above + 1]
    return numerator, denominator
