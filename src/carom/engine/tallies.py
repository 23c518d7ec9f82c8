"""Sums over processed events."""

from __future__ import annotations

import numpy as np

POWERS = {"virial": -1}  # which of them has the dimension ``time**power``

TALLY = np.dtype(
    [
        ("collisions", "i8"),
        ("advancements", "i8"),
        ("transits", "i8"),
        ("clamped", "i8"),
        ("returns", "i8"),
        ("virial", "f8"),
        ("depth", "f8"),
    ]
)
