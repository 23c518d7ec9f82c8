"""The balance of energy where contacts change it: kinetic energy and its integral over time.

Between two contacts the kinetic energy is constant, so that its integral is a sum over contacts. A balance is
kept where contacts lose energy, or surfaces that grow do work; else there is none, and it costs nothing.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import kept, present


class Balance(Observer):
    """The kinetic energy about the motion of the center of mass."""

    drift: Annotated[np.ndarray, present(-1)]
    """Velocity of the center of mass, zero where its momentum is not conserved, (d,) float64."""
    energy: Annotated[np.ndarray, present(-2)]
    """Kinetic energy now, (1,) float64."""
    action: Annotated[np.ndarray, kept(-1)]
    """Its integral from the start of the run to ``since``, (1,) float64."""
    since: Annotated[np.ndarray, present(1)]
    """Time of the last change, in the epoch, (1,) float64."""

    def before_pair(self, model, state, event):
        book(self, event.virial * (event.rv / event.rr - 0.5 * (event.a + event.b)), event.now)

    def gain(self, energy, now):
        book(self, energy, now)

    def at_epoch(self, model, state, length):
        # From the velocities again: rounding errors do not accumulate, and a gas may cool by any number of
        # decades.
        hold(self, length)
        rows = state.rows
        twice = 0.0
        for i in range(len(rows) - 1):  # the last row is padding
            square = 0.0
            for axis in range(len(self.drift)):
                v = np.float64(rows[i].v[axis]) - self.drift[axis]
                square += v * v
            twice += model.pair.mass_of(i) * square
        self.energy[0] = 0.5 * twice
        self.since[0] = 0.0

    def at_rest(self, now, since):
        hold(self, now)
        self.since[0] = since


def drift_of(masses, velocities) -> np.ndarray:
    """Return the velocity of the center of mass of components (n,) with velocities (n, d)."""
    drift = np.zeros(velocities.shape[1])
    for _ in range(2):  # the second time with the digits that a fast drift has taken
        drift += masses @ (velocities - drift) / masses.sum()
    return drift


def make_balance(masses, velocities, still) -> Balance:
    """Return the balance before any change; ``still`` are the axes that conserve momentum."""
    drift = np.where(still, drift_of(masses, velocities), 0.0)
    energy = 0.5 * float(masses @ np.square(velocities - drift).sum(axis=1))
    return Balance(drift, np.array([energy]), np.zeros(1), np.zeros(1))


def hold(balance, now):
    """Add the energy since the last change to its integral."""
    balance.action[0] += balance.energy[0] * (now - balance.since[0])
    balance.since[0] = now


def book(balance, change, now):
    """Enter a change of the energy."""
    hold(balance, now)
    balance.energy[0] += change
