"""Independent streams of random numbers from one seed, one for each purpose: places say nothing of speeds.

All are apart from ``numpy.random.default_rng(seed)``, with which users draw places themselves.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator, SeedSequence, default_rng

from carom import checks

PURPOSES = {
    "places": 0, "velocities": 1, "pinned": 2, "growth": 3, "thermal surfaces": 4, "drives": 5,
    "directions": 6, "sizes": 7, "swaps": 8, "volume": 9,
}  # fmt: skip
"""The purposes and their numbers, which determine the bits of runs."""


def stream(seed: Any, purpose: str, *counted: int) -> SeedSequence:
    """Return the source of randomness of an integer seed for a purpose, or for each of many by counting."""
    return SeedSequence(checks.integer(seed, "seed", low=0), spawn_key=(PURPOSES[purpose], *counted))


def generator(seed: Any, purpose: str) -> Generator:
    """Return a random generator from a seed for a purpose, or the Generator given."""
    return seed if isinstance(seed, Generator) else default_rng(stream(seed, purpose))


def word(seed: int, purpose: str) -> int:
    """Return 63 random bits from a seed for a purpose, for draws in compiled code."""
    return int(stream(seed, purpose).generate_state(1, np.uint64)[0] >> np.uint64(1))
