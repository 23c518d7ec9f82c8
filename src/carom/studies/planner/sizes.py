"""Possible sizes, and the bias that remains after the correction to infinite size."""

from __future__ import annotations

import math

from carom import theory
from carom.studies.planner.system import System

SMALLEST = 64
"""Smallest number of particles: fewer spheres are neighbors of their own images."""

LARGEST = 10**6

RATIO = 2.0**0.5
"""Ratio of successive sizes."""

IMAGES = {2: (1.0, 20.0, 3.6), 3: (2.2, 6.0, 1.0)}
"""Relative bias of Z by images, ``a (eta / eta_freezing)^p exp(-L / xi)``, as (a, p, xi); L is the edge in
mean diameters. Three dimensions also stand for more. It is an upper bound of the bias that remains after the
correction of order 1 / N, measured for 64 to 256 spheres at eta = 0.2 to 0.49 and 56 to 120 disks at 0.3 to
0.66. The sign of the bias changes with L (``python tests/benchmarks/sizes.py``).
"""

SECOND_ORDER = 2.0
"""The next order may add this number times the shift over N."""

OF_MIXTURE, OF_CRYSTAL, OF_WELLS = 0.05, 0.2, 0.5
"""Fraction of the shift that theory may miss. Equations of state of mixtures are accurate to a percent; in
crystals theory underestimates the effect of the volume on long waves
(:func:`carom.theory.crystal_finite_size_shift`); of wells it knows the second virial coefficient."""


def sizes(system: System) -> list[int]:
    """Return the numbers of particles that a plan may choose, in ascending order."""
    steps = int(math.log(LARGEST / SMALLEST) / math.log(RATIO)) + 1
    return sorted({system.filling(round(SMALLEST * RATIO**k)) for k in range(steps)})


def residual(system: System, n: int) -> float:
    """Return the possible bias of Z after the correction of order 1 / N, as one standard error."""
    shift = abs(system.shift(n))
    missed = OF_CRYSTAL if system.crystal else OF_MIXTURE if system.mixture else 0.0
    if system.wells:
        missed = OF_WELLS
    parts = [missed * shift, SECOND_ORDER / n * shift]
    if not system.crystal:
        parts.append(images(system, n) * system.z())
    if system.mixture:
        exact = system.shift(n, system.counts(n))
        parts.append(OF_MIXTURE * abs(exact - system.shift(n)))
    return math.hypot(*parts)


def images(system: System, n: int) -> float:
    """Return the relative bias of Z by the correlation of particles with the shells of their own images."""
    d = system.dimension
    dense = system.packing_fraction / theory.FREEZING.get(d, 1.0)
    edge = (n * theory.ball_volume(d) / system.packing_fraction) ** (1.0 / d)
    amplitude, power, reach = IMAGES[2 if d == 2 else 3]
    return amplitude * dense**power * math.exp(-edge / reach)
