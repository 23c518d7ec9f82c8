"""Whether a run can reach its end: without room, components collide infinitely often in a finite time."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import InputError
from carom.scene.velocities import peculiar

if TYPE_CHECKING:
    from carom.simulation.run_state import RunState

WINDOW = 100  # events a component over which their rate is taken

CLUSTER = 1000
"""Events a component that may come at one time besides: n touching rods in a row sort out n / 2 each."""

SQUEEZED, MOST_SQUEEZED = 16, 1e8
"""Light components that are squeezed between heavy ones at one time, and events that they may take: each up
to pi sqrt(M / m) (Galperin, Regul. Chaotic Dyn. 8, 375 (2003)), the fastest of them in a time that may be too
short for the clock.
"""

MOST_EVENTS = 1e15
"""Events that no run gets through: years of them."""

NARROW = 1e-3
"""Mean free path in mean diameters below which components that grow have jammed, or are a dense crystal."""

BEYOND = 100.0
"""Growth in mean free paths for which neither has room: there is room for about two."""


class StallDetector:
    """Looks now and then whether the end of a run, the instant ``end``, comes nearer."""

    def __init__(self, run_state: RunState, end: Fraction):
        self._run_state, self._end = run_state, end
        self._at_once = _at_one_time(run_state.scene.masses)
        self._begin()

    def _begin(self) -> None:
        self._since, (self._contacts, self._transits) = self._run_state.clock.instant, self._counts()

    def _counts(self) -> tuple[int, int]:
        """Return the contacts of every component, added up, and the crossings of sectors."""
        tally, obstacles = self._run_state.engine.tallies[0], self._run_state.engine.model.obstacles
        hits = 0 if obstacles is None else int(obstacles.hits.sum())
        return 2 * int(tally.collisions) + hits, int(tally.transits)

    def look(self) -> None:
        """Look, if there have been enough events since the last time."""
        contacts, transits = self._counts()
        contacts, transits = contacts - self._contacts, transits - self._transits
        events, n = contacts + transits, self._run_state.scene.n
        if events < WINDOW * n:
            return
        refusal = self._refusal(contacts, events)
        if refusal is None:
            self._begin()
        elif events >= (WINDOW + min(n, CLUSTER)) * n + self._at_once:
            raise InputError(refusal)

    def _refusal(self, contacts: int, events: int) -> str | None:
        """Return why the end is out of reach, or None."""
        run_state, now = self._run_state, self._run_state.clock.instant
        elapsed = float(run_state.unit.to_kernel(now - self._since, 1))
        left = float(run_state.unit.to_kernel(max(self._end - now, Fraction(0)), 1))
        if run_state.system.rates is not None and contacts:
            speed = math.sqrt(
                float(np.mean(np.sum(peculiar(run_state.scene, run_state.speeds) ** 2, axis=1)))
            )
            path = speed * elapsed * run_state.scene.n / contacts
            growth = 2.0 * float(run_state.system.rates.mean()) * left
            diameter = float(run_state.diameters.mean())
            if path < NARROW * diameter and growth > BEYOND * path:
                return (
                    f"The components jam: they fly {path / diameter:.2g} diameters between contacts, and "
                    f"would grow by {growth / diameter:.2g} until the time asked for. Ask for less time or "
                    "for collisions=, or let them grow less."
                )
        if events * left > MOST_EVENTS * elapsed:
            ahead = f"{events * left / elapsed:.2g}" if elapsed > 0.0 else "infinitely many"
            if run_state.engine.model.rules is not None:
                return (
                    f"The run would take {ahead} crossings of circles more; expected at most "
                    f"{MOST_EVENTS:g}. See whether a rule turns round whenever somebody enters, or makes "
                    "units ever faster: act on one circle, and forget at a larger one, or after a time."
                )
            return (
                f"The run would take {ahead} collisions and crossings more; expected at most "
                f"{MOST_EVENTS:g}. Ask for less time, or for walltime=, and see whether components have next "
                "to no room, slide along a container, or drift far faster than they move apart."
            )
        return None


def _at_one_time(masses: np.ndarray) -> float:
    """Return how many events may come at one time because light components are between heavy ones."""
    ratio = math.sqrt(float(masses.max() / masses.min()))
    # Two for a collision, one for the hit of a wall: 2 pi covers both kinds of squeezing.
    return min(min(SQUEEZED, len(masses)) * 2.0 * math.pi * (ratio - 1.0), MOST_SQUEEZED)
