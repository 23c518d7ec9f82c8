"""Rules asked again for a replay: what the engine does in :mod:`carom.engine.agents`, in plain Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from carom.models.interface import IN
from carom.models.units import (
    ENTERED,
    LEFT,
    NO_AGENT,
    Units,
    apply,
    call_rule,
    cause_of,
    fill_agent,
    fill_event,
    place_other,
    recount,
)


class Near(Protocol):
    """Who is within reach of whom."""

    def around(self, i: int) -> list[tuple[int, int]]:
        """Return who is on a step with unit i, and on which."""

    def forget_partner(self, i: int) -> None:
        """Forget the pairs of unit i."""


def on_crossing(
    pair: Units,
    components: tuple[int, int],
    crossed: int,
    kind: int,
    x: np.ndarray,
    v: np.ndarray,
    r: np.ndarray,
    now: float,
    start: float,
    steps: Near,
) -> None:
    """Ask the rules of those whose circle a pair has crossed.

    Parameters
    ----------
    pair : Units
        The units.
    who : tuple of two ints
        The pair.
    crossed, kind : int
        Which distance of all circles' it was, and IN or OUT.
    x, v : (n, d) arrays
        Places and velocities of all; those of the pair are of now. Velocities are changed.
    r : (d,) array
        From the first to the second [length].
    now, start : float
        Time since the beginning of the epoch, and that since the start of the run.
    steps : Near
        Who is within reach of whom.
    """
    circles = [int(pair.watch[pair.kinds[i], crossed]) for i in components]
    cause = ENTERED if kind == IN else LEFT
    both = [
        (slot, i, circle)
        for slot, (i, circle) in enumerate(zip(components, circles, strict=True))
        if circle >= 0
    ]
    for slot, i, circle in both:
        other, sense = components[1 - slot], 1.0 if slot == 0 else -1.0
        fill_agent(pair, slot, i, x[i], v[i], now)
        fill_event(pair, slot, cause, circle, other, start + now)
        for axis in range(len(r)):
            place_other(pair, slot, axis, sense * r[axis], v[other, axis])
    for slot, _, _ in both:
        call_rule(pair.rule, pair.units[slot], pair.told[slot])
    for slot, i, _ in both:
        _settle(pair, slot, i, v, now, steps)


def on_timer(
    pair: Units,
    i: int,
    x: np.ndarray,
    v: np.ndarray,
    found: Callable[[int, int], tuple[np.ndarray, np.ndarray]],
    now: float,
    start: float,
    steps: Near,
) -> None:
    """Ask unit i alone; ``found(i, j)`` returns the vector to another, and its velocity."""
    cause, other = cause_of(pair, i, now)
    fill_agent(pair, 0, i, x[i], v[i], now)
    fill_event(pair, 0, cause, NO_AGENT, other, start + now)
    if other != NO_AGENT:
        for axis, (a, b) in enumerate(zip(*found(i, int(other)), strict=True)):
            place_other(pair, 0, axis, a, b)
    call_rule(pair.rule, pair.units[0], pair.told[0])
    _settle(pair, 0, i, v, now, steps)


def _settle(pair: Units, slot: int, i: int, v: np.ndarray, now: float, steps: Near) -> None:
    was = apply(pair, slot, i, v[i], now)
    if was != NO_AGENT:
        for j, step in steps.around(i):
            recount(pair, i, j, step, was)
        if pair.present[i] == 0:
            steps.forget_partner(i)
        pair.queued[0] = 0  # who is told when is in the log
