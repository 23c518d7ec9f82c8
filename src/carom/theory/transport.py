"""Transport of hard spheres by theory: Enskog's coefficients, long-time tails, the finite-size shift.

All are of equal, smooth, elastic spheres, in units of Boltzmann's constant 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.theory.arithmetic import checked
from carom.theory.contact import ball_volume

SONINE: dict[int, tuple[float, float, float]] = {
    2: (1.02709, 1.02197, 1.02972),
    3: (1.018954, 1.016034, 1.025218),
    4: (1.01457, 1.01302, 1.02190),
    5: (1.01183, 1.01107, 1.01934),
    6: (1.00995, 1.00968, 1.01732),
    7: (1.00859, 1.00862, 1.01569),
    8: (1.00755, 1.00777, 1.01433),
    9: (1.00674, 1.00709, 1.01319),
    10: (1.00609, 1.00652, 1.01222),
    11: (1.00555, 1.00603, 1.01139),
    12: (1.00509, 1.00562, 1.01066),
}
"""Factors by which converged Sonine expansions exceed the first order, by dimension: of self-diffusion, shear
viscosity and thermal conductivity. Those for d = 2 and 4 are extrapolated from orders 1 to 6; those from 5 on
are of order 6, which has converged. Those for d = 3 are from S. Chapman and T. G. Cowling, The Mathematical
Theory of Non-uniform Gases, sec. 10.21.
"""

HIGHEST = 0.5
"""Largest packing fraction of Erpenbeck and Wood's fit, a little beyond freezing."""


@dataclass(frozen=True)
class Enskog:
    """Enskog's transport coefficients of a fluid of hard spheres.

    Attributes
    ----------
    self_diffusion : float
        Coefficient of self-diffusion, D [length^2 / time].
    shear_viscosity, bulk_viscosity : float
        Shear viscosity eta and bulk viscosity zeta [mass length^(2 - d) / time].
    thermal_conductivity : float
        Thermal conductivity, lambda, with Boltzmann's constant 1 [length^(2 - d) / time].
    """

    self_diffusion: float
    shear_viscosity: float
    bulk_viscosity: float
    thermal_conductivity: float


def enskog(
    compressibility_factor: float,
    packing_fraction: float,
    dimension: int,
    *,
    diameter: float = 1.0,
    mass: float = 1.0,
    kT: float = 1.0,
) -> Enskog:
    """Return Enskog's transport coefficients, with converged Sonine factors in d = 2 to 12.

    Parameters
    ----------
    compressibility_factor, packing_fraction : float
        Z and eta, of infinitely many particles.
    dimension : int
        d, at least 2. From 13 on the first Sonine order is returned, which is up to 1 % too small.
    diameter, mass, kT : float
        Diameter [length], mass and temperature [energy].

    Raises
    ------
    InputError
        If d is less than 2, as particles on a line cannot pass each other; or if Z is not above 1.

    Notes
    -----
    Let y = Z - 1, n the number density and chi the contact value. The coefficients of the dilute gas are

    - ``eta_0 = (d + 2) Gamma(d / 2) / (8 pi^((d - 1) / 2)) sqrt(m kT) / sigma^(d - 1)``,
    - ``lambda_0 = d (d + 2)^2 Gamma(d / 2) / (16 (d - 1) pi^((d - 1) / 2)) sqrt(kT / m) / sigma^(d - 1)``.

    In the first Sonine order, those of the dense fluid are

    - ``zeta = 2 n sigma y sqrt(m kT / pi) / d``, in every order,
    - ``eta = eta_0 / chi (1 + 2 y / (d + 2))^2 + d zeta / (d + 2)``,
    - ``lambda = lambda_0 / chi (1 + 3 y / (d + 2))^2 + d zeta / (2 m)``,
    - ``D = sqrt(pi) sigma sqrt(kT / m) / (4 y)``.

    The Sonine factors multiply eta_0, lambda_0 and D. J. F. Lutsko, Phys. Rev. E 72, 021306 (2005); D. M.
    Gass, J. Chem. Phys. 54, 1898 (1971) for d = 2.
    """
    y, d = compressibility_factor - 1.0, dimension
    if d < 2 or not y > 0.0:
        raise InputError(f"Enskog's theory needs d >= 2 and Z > 1; found d = {d} and Z = {1.0 + y:g}.")
    chi = y / (2.0 ** (d - 1) * packing_fraction)
    n = packing_fraction / ball_volume(d, diameter)
    of_d, of_eta, of_lambda = SONINE.get(d, (1.0, 1.0, 1.0))
    angles = math.gamma(0.5 * d) / math.pi ** (0.5 * (d - 1)) / diameter ** (d - 1)
    eta = of_eta * (d + 2) / 8.0 * angles * math.sqrt(mass * kT)
    conductivity = of_lambda * d * (d + 2) ** 2 / (16.0 * (d - 1)) * angles * math.sqrt(kT / mass)
    zeta = 2.0 * n * diameter * y * math.sqrt(mass * kT / math.pi) / d
    return Enskog(
        of_d * 0.25 * math.sqrt(math.pi) * diameter * math.sqrt(kT / mass) / y,
        eta / chi * (1.0 + 2.0 * y / (d + 2)) ** 2 + d / (d + 2.0) * zeta,
        zeta,
        conductivity / chi * (1.0 + 3.0 * y / (d + 2)) ** 2 + 0.5 * d * zeta / mass,
    )


def erpenbeck_wood(packing_fraction: Any) -> Any:
    """Return D over Enskog's value for infinitely many spheres (d = 3), up to freezing.

    Parameters
    ----------
    packing_fraction : float or array
        eta of the spheres, at most 0.5.

    Raises
    ------
    InputError
        If a packing fraction is not from 0 to 0.5: the fit falls to zero beyond freezing.

    Notes
    -----
    ``1 + 0.05403 v + 6.3656 v^2 - 10.9425 v^3`` with ``v = n sigma^3 / sqrt 2``. It was fitted to molecular
    dynamics, corrected for the finite size and the long-time tail. J. J. Erpenbeck and W. W. Wood, Phys. Rev.
    A 43, 4254 (1991).
    """
    eta = checked(packing_fraction)
    if not np.all(eta <= HIGHEST):
        raise InputError(f"packing_fraction is {packing_fraction!r}; the fit holds from 0 to {HIGHEST}.")
    v = 6.0 * eta / math.pi / math.sqrt(2.0)
    return 1.0 + v * (0.05403 + v * (6.3656 - 10.9425 * v))


def diffusion_shift(
    n: int,
    density: float,
    shear_viscosity: float,
    *,
    self_diffusion: float = 0.0,
    mass: float = 1.0,
    kT: float = 1.0,
) -> float:
    """Return the deficit of D of n spheres in a periodic cube (d = 3) [length^2 / time].

    Parameters
    ----------
    n : int
        Number of spheres.
    density, shear_viscosity : float
        Number density [1 / length^3] and shear viscosity [mass / (length time)].
    self_diffusion : float
        D of infinitely many spheres [length^2 / time]; 0 gives the formula of Yeh and Hummer.
    mass, kT : float
        Mass of a sphere, and temperature [energy].

    Notes
    -----
    ``2.837297 kT / (6 pi m rho (nu + D) L)`` with the number density rho, the edge L and ``nu = eta / (m
    rho)``. The flow around a particle acts on its periodic images. The deficit is the integral over all waves
    minus the sum over those of the periodic box, where a wave decays with ``(nu + D) k^2`` by mode coupling.
    B. Duenweg and K. Kremer, J. Chem. Phys. 99, 6983 (1993), and I.-C. Yeh and G. Hummer, J. Phys. Chem. B
    108, 15873 (2004), assume ``D << nu``, as in a liquid.
    """
    edge = (n / density) ** (1.0 / 3.0)
    friction = shear_viscosity + mass * density * self_diffusion
    return 2.837297 * kT / (6.0 * math.pi * friction * edge)


def velocity_tail(
    density: float,
    self_diffusion: float,
    shear_viscosity: float,
    dimension: int,
    *,
    mass: float = 1.0,
    kT: float = 1.0,
) -> float:
    """Return the amplitude a of the long-time tail ``<v(0).v(t)> / d = a t^(-d/2)`` by mode coupling.

    Parameters
    ----------
    density : float
        Number density, rho [length^-d].
    self_diffusion, shear_viscosity : float
        D [length^2 / time] and eta [mass length^(2 - d) / time].
    dimension : int
        d.
    mass, kT : float
        Mass of a particle, and temperature [energy].

    Notes
    -----
    ``a = (d - 1) / d kT / (m rho) (4 pi (D + nu))^(-d/2)`` with ``nu = eta / (m rho)``. M. H. Ernst, E. H.
    Hauge and J. M. J. van Leeuwen, Phys. Rev. Lett. 25, 1254 (1970). For d = 2 the integral of the tail
    diverges with the logarithm of time, and so does D.
    """
    d, nu = dimension, shear_viscosity / (mass * density)
    return (d - 1.0) / d * kT / (mass * density) * (4.0 * math.pi * (self_diffusion + nu)) ** (-0.5 * d)


def normal_speed(speed: Any, *, reduced_mass: float = 0.5, kT: float = 1.0) -> Any:
    """Return the probability density of the relative normal speed u at a collision: exact at every density.

    Parameters
    ----------
    speed : float or array
        u [length / time].
    reduced_mass : float
        mu [mass].
    kT : float
        Temperature [energy].

    Notes
    -----
    ``(mu u / kT) exp(-mu u^2 / (2 kT))``: the Maxwell distribution of the normal particle, times u for the
    rate of such collisions. At constant energy the speeds of N particles are bounded, a correction of order
    1 / N.
    """
    u = np.asarray(speed, dtype=np.float64)
    density = reduced_mass * u / kT * np.exp(-0.5 * reduced_mass * u * u / kT)
    return density if density.ndim else float(density)
