"""Times that are fixed before a run: epochs, the calendar's buckets, and how long a scheme will do."""

from __future__ import annotations

import math

from carom.engine.neighbors import cost_model
from carom.engine.neighbors.list_ranges import ListRanges
from carom.engine.system import System

SMALLEST_GROWTH = 2.0**-30
"""Part of their diameter by which components must be able to grow before they are as wide as the box."""

LONGEST_PLUNGE = 1024.0
"""Diameters that a pair would fly in an epoch at the speed it has in its deepest well, at most: times are
then rounded by 1e-13 of a diameter.
"""


def power_of_two(x: float) -> float:
    """Return the power of two just below a number, or the number."""
    return 2.0 ** math.floor(math.log2(x))


def short(x: float) -> float:
    """Return a number of twenty binary digits just below, so that sums and differences of a few are exact."""
    if not math.isfinite(x):
        return x
    digit = power_of_two(x) * 2.0**-20
    return math.floor(x / digit) * digit


def lengths_of(system: System, speed: float, rate: float, alone: bool) -> tuple[float, float]:
    """Return the length of an epoch and the width of the calendar's buckets; ``alone`` without sectors."""
    epoch = 1.0
    if speed > 0.0:
        crossing = 4.0 * max(system.box) / speed
        epoch = power_of_two(min(16.0 / rate, crossing) if rate > 0.0 else crossing)
    if system.plunge > 0.0:
        epoch = min(epoch, power_of_two(LONGEST_PLUNGE * system.smallest / system.plunge))
    if alone and speed > 0.0:
        epoch = cost_model.epoch_of(system, speed, rate)
    longest = getattr(system.motion, "longest_epoch", lambda: math.inf)()
    if longest < math.inf:
        epoch = min(epoch, power_of_two(float(system.unit.to_kernel(longest, 1))))
    width = epoch
    if speed > 0.0 and rate > 0.0:
        width = min(power_of_two(4.0 / (system.n * rate)), epoch)
    return epoch, width


def horizon_of(system: System, neighbors: str, shape: tuple[int, ...], ranges: ListRanges) -> float:
    """Return the time after which components that grow need another scheme."""
    if system.rates is None:
        return math.inf
    box, diameter = system.box, system.diameter
    if neighbors == "lists":  # until somebody has grown over half of its margin
        return 0.5 * (0.5 * (ranges.list_range - diameter)) / float((system.rates / system.paces).max())
    if neighbors != "sectors":
        return math.inf
    # Along an axis of a lattice that tilts, sectors must be wider than a diameter.
    narrow = min(edge / size / axis for edge, size, axis in zip(box, shape, system.stretch, strict=True))
    horizon = (1.0 - 2.0**-20) * (narrow - diameter) / (2.0 * float(system.rates.max()))
    if horizon * 2.0 * float(system.rates.max()) < SMALLEST_GROWTH * diameter:
        raise ValueError(
            f"The components have grown to a diameter of {diameter:g} in a box of edges "
            f"{', '.join(f'{edge:g}' for edge in box)}: one as wide as the box would meet itself. Use "
            "more of them, or a box more nearly cubic."
        )
    return horizon
