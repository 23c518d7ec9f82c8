"""Which sizes there are, and what bias each leaves behind the correction to infinite size."""

from __future__ import annotations

import math

from carom import theory
from carom.studies.planner.system import System

SMALLEST = 64
"""Fewer spheres meet their own images all round."""

LARGEST = 10**6

RATIO = 2.0**0.5
"""From one size to the next."""

IMAGES = {2: (1.0, 20.0, 3.6), 3: (2.2, 6.0, 1.0)}
"""Relative bias that images leave: ``a (eta / eta_freezing)^p exp(-L / xi)`` with the edge L in mean
diameters, as (a, p, xi); that of three dimensions is taken for more. It encloses what 64 to 256 spheres at
eta = 0.2 to 0.49 and 56 to 120 disks at 0.3 to 0.66 have beyond the correction of order 1 / N; the sign
changes with L (``python tests/benchmarks/sizes.py``).
"""

SECOND_ORDER = 2.0
"""Part of the shift, times 1 / N, that the next order may add."""

OF_MIXTURE, OF_CRYSTAL = 0.05, 0.2
"""Part of the shift that theory may miss: where an equation of state of a mixture is good to a percent, and
where long waves feel the volume more than theory says (:func:`carom.theory.crystal_finite_size_shift`)."""


def sizes(system: System) -> list[int]:
    """Return the numbers of particles that a plan may choose, in ascending order."""
    steps = int(math.log(LARGEST / SMALLEST) / math.log(RATIO)) + 1
    return sorted({system.filling(round(SMALLEST * RATIO**k)) for k in range(steps)})


def residual(system: System, n: int) -> float:
    """Return the bias of Z that the correction of order 1 / N leaves: one error of what is not known."""
    shift = abs(system.shift(n))
    missed = OF_CRYSTAL if system.crystal else OF_MIXTURE if system.mixture else 0.0
    parts = [missed * shift, SECOND_ORDER / n * shift]
    if not system.crystal:
        parts.append(images(system, n) * system.z())
    if system.mixture:
        exact = system.shift(n, system.counts(n))
        parts.append(OF_MIXTURE * abs(exact - system.shift(n)))
    return math.hypot(*parts)


def images(system: System, n: int) -> float:
    """Return the relative bias of Z because particles meet the shells around their own images."""
    d = system.dimension
    dense = system.packing_fraction / theory.FREEZING.get(d, 1.0)
    edge = (n * theory.ball_volume(d) / system.packing_fraction) ** (1.0 / d)
    amplitude, power, reach = IMAGES[2 if d == 2 else 3]
    return amplitude * dense**power * math.exp(-edge / reach)
