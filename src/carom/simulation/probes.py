"""Single questions to an interaction of one's own, in plain Python: where two act on each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom import checks
from carom.models.interface import NEVER, interaction_time

SPEEDS = (1.0, 1024.0)
"""Speeds of head-on approaches, in units of the thermal speed: an interaction may depend on the speed."""


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
        The approach begins at four times this distance.
    speed : float
        The usual speed.
    """
    far = np.float64(4.0 * reach)
    found = [far - v * time(pair, i, j, far, v) for v in np.multiply(SPEEDS, speed)]
    return max(0.0, *map(float, found))


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
