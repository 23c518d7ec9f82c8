"""The units of time of the scene and of the engine: their ratio is a power of two, so runs do not change.

The engine multiplies up to four velocities, which leaves the range of doubles for speeds of 1e±150. In its
unit the fastest component flies about one diameter. Lengths and masses have the same units.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

USUAL = 20
"""If the fastest component flies 2^-20 to 2^20 diameters per unit of time, the two units are the same."""


class TimeUnit(NamedTuple):
    """The engine's unit of time: ``2**exponent`` of the scene's."""

    exponent: int = 0

    @classmethod
    def of(cls, fastest: float, diameter: float) -> TimeUnit:
        """Return the unit for the fastest component (along an axis) or surface and the largest diameter."""
        if fastest == 0.0:
            return cls()
        pace = math.frexp(fastest)[1] - math.frexp(diameter)[1]
        return cls(0 if abs(pace) <= USUAL else -pace)

    def to_kernel(self, value: Any, power: int) -> Any:
        """Return a number, an array or a Fraction of the dimension ``time**power`` in the engine's units.

        ``power`` is 1 for times, -1 for velocities, impulses and virials, -2 for energies. What falls below
        the smallest double becomes zero: a speed of 1e-308 of the fastest.
        """
        return _shifted(value, -power * self.exponent)

    def to_scene(self, value: Any, power: int) -> Any:
        """Return in the scene's units a ``value`` in the engine's; ``power`` as for :meth:`to_kernel`."""
        return _shifted(value, power * self.exponent)


def _shifted(value: Any, exponent: int) -> Any:
    """Return ``value * 2**exponent``, without rounding unless it leaves the range of normal doubles."""
    if isinstance(value, Fraction):
        return value * Fraction(2) ** exponent if exponent else value
    with np.errstate(over="ignore"):
        result = np.ldexp(value, exponent)
    return float(result) if isinstance(value, float) else result
