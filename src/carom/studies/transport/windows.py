"""The rule for the window of time in which the slope of a mean square is taken.

The mean square change of a Helfand moment grows as ``2 C t + b`` at times t long compared with the decay of
the current's correlation; C is half of the slope from ``t_1`` to ``t_2 = 2 t_1``. A short t_1 cuts off the
decay; a long one costs precision, as ``sqrt(t_2)``.

Collective coefficients: t_1 is the first of 10, 20 and 40 mean free times whose slope agrees with the next
within two standard errors of the difference. The slowest decay of the dilute gas, 1.9 mean free times, leaves
9e-4 of the kinetic part behind the first window.

Self-diffusion: the slowest decay is that of the longest wave of the box, ``tau = L^2 / (4 pi^2 (D + nu))``.
t_1 is 4 tau, and at least 10 mean free times: the six longest waves leave behind less than ``e^-4`` of what
they add.
"""

from __future__ import annotations

import math

from carom import checks, theory
from carom.scene.scene import Scene

PER_FREE_TIME = 2
"""Samples of the moments per mean free time."""

LAGS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 30, 40, 60, 80, 120, 160)
"""Times of the mean squares [samples]."""

STARTS = (20, 40, 80)
"""Values of t_1 that the rule tries [samples]."""

AGREE = 2.0
"""Standard errors by which the slopes of two windows in agreement may differ."""

FRAME = 8
"""Samples from one frame to the next, for self-diffusion."""

WAVES = 4.0
"""t_1 of self-diffusion [decay times of the longest wave]."""

SHORTEST = 4
"""Smallest length of a block [longest lag]."""

FEWEST_BLOCKS = 16
"""Blocks of the shortest run that :func:`blocks_within` cuts to hold all lags."""


def blocks_within(free_times: float, most: int) -> int:
    """Return into how many blocks a run of so many mean free times is cut: ``most`` if all hold every lag."""
    within = int(free_times * PER_FREE_TIME / (SHORTEST * LAGS[-1]))
    return min(most, max(within, FEWEST_BLOCKS))


def relative_variance(components: int, time: float, begin: float = 10.0, end: float = 20.0) -> float:
    """Return the squared relative error of a coefficient after a ``time``, by default in mean free times.

    The slope weighs the current's correlation at s by ``w(s)``: 1 up to t_1, then falling to 0 at t_2. For
    white noise the variance is ``4 C^2 / T`` times the integral of ``w^2``, hence ``4 (t_1 + (t_2 - t_1) / 3)
    / T``, with t_1 = ``begin`` and t_2 = ``end``. A current with a memory has at least as large an error.
    """
    return 4.0 * (begin + (end - begin) / 3.0) / (components * time)


def free_time(packing_fraction: float, diameters: list[float], masses: list[float], fractions: list[float],
              dimension: int, kT: float) -> float:  # fmt: skip
    """Return the mean time between two collisions of a component, averaged over the mixture [time]."""
    checks.number(packing_fraction, "packing_fraction", low=1.0 / checks.MAGNITUDE)
    checks.number(kT, "kT", low=1.0 / checks.HOTTEST, high=checks.HOTTEST)
    d = dimension
    if len(diameters) == 1:
        z = _compressibility_factor(packing_fraction, d)
        return float(theory.mean_free_time(z, d, diameter=diameters[0], mass=masses[0], kT=kT))
    volume = sum(x * theory.ball_volume(d, s) for x, s in zip(fractions, diameters, strict=True))
    density = packing_fraction / volume
    contact = (1.0 - 0.5 * packing_fraction) / (1.0 - packing_fraction) ** d
    rates = [
        x * theory.species_collision_rate(density * y, contact, 0.5 * (s + t), m * k / (m + k), d, kT=kT)
        for x, s, m in zip(fractions, diameters, masses, strict=True)
        for y, t, k in zip(fractions, diameters, masses, strict=True)
    ]
    return 1.0 / sum(rates)


def _compressibility_factor(eta: float, d: int) -> float:
    """Return Z of the fluid; to second virial order where no equation of state is known."""
    return float(theory.best(d)(eta)) if d in theory.FREEZING else 1.0 + 2.0 ** (d - 1) * eta


def mean_fluid(scene: Scene, kT: float) -> tuple[theory.Enskog, float]:
    """Return Enskog's coefficients and the collisions of one particle a time, of a fluid like a scene's.

    Its spheres are equal, have the mean mass, and fill as much of the box.
    """
    density, mass = scene.n / scene.volume, float(scene.masses.mean())
    return equal_fluid(scene.packing_fraction, density, mass, scene.dimension, kT)


def equal_fluid(eta: float, density: float, mass: float, d: int, kT: float) -> tuple[theory.Enskog, float]:
    """Return Enskog's coefficients and the collisions of one particle a time, of equal spheres."""
    sigma = (eta / density / theory.ball_volume(d)) ** (1.0 / d)
    z = _compressibility_factor(eta, d)
    found = theory.enskog(z, eta, d, diameter=sigma, mass=mass, kT=kT)
    return found, float(theory.collision_rate(z, d, diameter=sigma, mass=mass, kT=kT))


def wave_time(scene: Scene, kT: float) -> float:
    """Return the decay time of the longest wave in the box by Enskog's theory [time]."""
    density, mass = scene.n / scene.volume, float(scene.masses.mean())
    return longest_wave(max(scene.box), scene.packing_fraction, density, mass, scene.dimension, kT)


def longest_wave(edge: float, eta: float, density: float, mass: float, d: int, kT: float) -> float:
    """Return the decay time of the longest wave in a box, for particles of a mean mass [time]."""
    found, _ = equal_fluid(eta, density, mass, d, kT)
    nu = found.shear_viscosity / (mass * density)
    return edge**2 / (4.0 * math.pi**2 * (found.self_diffusion + nu))
