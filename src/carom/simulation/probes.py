"""Single questions to an interaction of one's own, in plain Python: where two act on each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom import checks
from carom.models.interface import NEVER, interaction_time

SPEEDS = (1.0, 1024.0)
"""Speeds of head-on approaches, in units of the thermal speed: an interaction may depend on the speed."""

DOUBLINGS = 64
"""How often the distance at which an approach begins is doubled."""


def reach_of(interaction: Any, scene: Any) -> float:
    """Return the reach of an interaction in a scene, checked [length].

    Raises
    ------
    InputError
        If it is not a positive number.
    """
    name = f"reach(scene) of {type(interaction).__name__}"
    return checks.number(interaction.reach(scene), name, low=0.0, open_low=True)


def contact_distance(pair: Any, i: int, j: int, reach: float, speed: float = 1.0) -> float:
    """Return the largest distance [length] at which two act on each other in a head-on approach, or 0.

    Parameters
    ----------
    pair : model
        The interaction.
    i, j : int
        The two.
    reach : float
        The approach begins at four times this distance, or further away if they act on each other there.
    speed : float
        The usual speed.
    """
    return max(_distance(pair, i, j, 4.0 * reach, float(v)) for v in np.multiply(SPEEDS, speed))


def _distance(pair: Any, i: int, j: int, far: float, speed: float) -> float:
    """Return where two act on each other that approach from a distance ``far`` or more, or 0."""
    for _ in range(DOUBLINGS):
        t = time(pair, i, j, far, speed)
        if t > 0.0:
            return max(0.0, far - speed * t)
        far *= 2.0
    return far


def time(pair: Any, i: int, j: int, distance: Any, speed: Any) -> float:
    """Return the time until two act on each other that approach head-on from a distance [length]."""
    r, v = np.float64(distance), np.float64(speed)
    return asked(pair, i, j, r * r, -r * v, v * v, 0.0)


def asked(pair: Any, i: int, j: int, rr: Any, rv: Any, vv: Any, now: float) -> float:
    """Return :func:`interaction_time`; NEVER where Python finds no number, as compiled code would go on."""
    try:
        with np.errstate(all="ignore"):
            t = float(interaction_time(pair, i, j, rr, rv, vv, now))
    except (ArithmeticError, ValueError):
        return NEVER
    return NEVER if np.isnan(t) else t
