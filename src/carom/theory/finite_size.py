"""Effects of a finite number of particles, at constant energy in a periodic box."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom import checks
from carom.theory.arithmetic import Equation, checked


def finite_size_shift(packing_fraction: Any, n: int, equation: Equation) -> Any:
    """``Z_N - Z`` of N particles in a periodic box of given volume, to leading order in 1 / N.

    Parameters
    ----------
    packing_fraction : float or array
        eta.
    n : int
        Number of particles N.
    equation : callable
        Z of the infinite fluid.

    Raises
    ------
    InputError
        If a packing fraction is not in [0, 1), or n is less than 1.

    Notes
    -----
    ``-(1 / 2N) d ln[d(eta Z)/d eta] / d ln eta``, because the canonical ensemble has no fluctuations of
    density. It is exact in 1D. In 3D its error is 3e-4 for N = 108 at a density of 0.5; at 0.8 it needs more
    particles. Lebowitz and Percus, Phys. Rev. 124, 1673 (1961). Derivatives are five-point differences with
    the relative step eps^(1/6), accurate to about eps^(2/3).
    """
    number = checks.number(n, "n", low=1)
    asked = checked(packing_fraction)
    # At zero density there is no shift, and no relative step.
    eta = np.where(asked == 0.0, 0.1, asked) if np.ndim(asked) else asked or 0.1
    step = np.finfo(np.float64).eps ** (1.0 / 6.0) * eta
    far_below, below, here, above, far_above = (
        (eta + k * step) * equation(eta + k * step) for k in (-2, -1, 0, 1, 2)
    )
    # For f = eta Z this is eta f'' / f', with differences in units of the step, a fixed fraction of eta.
    slope = (far_below - 8.0 * below + 8.0 * above - far_above) / 12.0
    curvature = (-far_below + 16.0 * below - 30.0 * here + 16.0 * above - far_above) / 12.0
    relative_step = np.finfo(np.float64).eps ** (1.0 / 6.0)
    return (asked > 0.0) * (-curvature / slope / relative_step / (2.0 * number))


def speed_factor(degrees_of_freedom: float) -> float:
    """Ratio c_D of the collision rate at constant energy to that at constant temperature.

    Parameters
    ----------
    degrees_of_freedom : float
        D of the velocities: d (N - 1) in a periodic box with zero total momentum, d N in a box with walls.
        Of infinitely many c_D is 1.

    Raises
    ------
    InputError
        If D is not positive.

    Notes
    -----
    ``c_D = sqrt(D / 2) Gamma(D / 2) / Gamma((D + 1) / 2)``, which is 1 + 1 / (4 D) for large D. It follows
    from the mean of ``|v|`` over the sphere ``v^2 = D``. The virial, quadratic in speeds, has no such factor.
    """
    if degrees_of_freedom == math.inf:
        return 1.0
    half = 0.5 * checks.number(degrees_of_freedom, "degrees_of_freedom", low=0, open_low=True)
    return math.exp(0.5 * math.log(half) + math.lgamma(half) - math.lgamma(half + 0.5))


def crystal_finite_size_shift(packing_fraction: Any, n: int, equation: Equation) -> Any:
    """``Z_N - Z`` of N particles that form one crystal in a periodic box, to leading order in 1 / N.

    Parameters and errors are those of :func:`finite_size_shift`.

    Notes
    -----
    ``-(Z - 1) / N``: of N particles N - 1 vibrate, and all modes contribute equally to the pressure. It is
    exact in 1D. It is exact to leading order near close packing, where the volume of configurations scales as
    ``(V - V_0)^(d (N - 1))``. Long waves depend more on the volume than others, so that the true shift is
    somewhat larger. For fcc it is larger by 2.3 / N at eta = 0.56 (of 13.4 / N), and by 1.1 / N at 0.65 (of
    24.3 / N). These figures are from ``carom eos --eta 0.56,0.65 --n 108,256,500,1372 --relative-error
    2e-4``.
    """
    return -(equation(checked(packing_fraction)) - 1.0) / checks.number(n, "n", low=1)


def constant_pressure_shift(packing_fraction: Any, n: int, equation: Equation) -> Any:
    """``P <V> / N kT`` at constant pressure less Z_N in a box of that mean volume, to leading order in 1 / N.

    Parameters and errors are those of :func:`finite_size_shift`.

    Notes
    -----
    ``1 / N + (1 / 2N) d ln[d(eta Z)/d eta] / d ln eta``. The weight of a volume is ``exp(g)`` with ``g = ln Q
    - P V / kT``. At its maximum the pressure at fixed volume is P, and the mean lies ``g3 / (2 g2^2)`` beyond
    it, with the second and third derivative of g. In a fluid this shift and :func:`finite_size_shift` add up
    to 1 / N, as in an ideal gas, where ``P <V> = (N + 1) kT``.
    """
    number = checks.number(n, "n", low=1)
    return 1.0 / number - finite_size_shift(packing_fraction, n, equation)
