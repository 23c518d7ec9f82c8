"""The balance of energy where contacts change it: kinetic energy and its integral over time.

Between two contacts the kinetic energy is constant, so that its integral is a sum over contacts. A balance is
kept where contacts lose energy, or surfaces that grow do work; else there is none, and it costs nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner
from carom.engine.observers.interface import at_epoch, at_rest, before_pair, gain
from carom.models.questions.interaction import mass
from carom.models.questions.memory import copy_state


class Balance(NamedTuple):
    """The kinetic energy about the motion of the centre of mass."""

    drift: np.ndarray
    """Velocity of the centre of mass, zero where its momentum is not conserved, (d,) float64."""
    energy: np.ndarray
    """Kinetic energy now, (1,) float64."""
    action: np.ndarray
    """Its integral from the start of the run to ``since``, (1,) float64."""
    since: np.ndarray
    """Time of the last change, in the epoch, (1,) float64."""


def drift_of(masses, velocities) -> np.ndarray:
    """Return the velocity of the centre of mass of components (n,) with velocities (n, d)."""
    drift = np.zeros(velocities.shape[1])
    for _ in range(2):  # the second time with the digits that a fast drift has taken
        drift += masses @ (velocities - drift) / masses.sum()
    return drift


def make_balance(masses, velocities, still) -> Balance:
    """Return the balance of components (n,) with velocities (n, d), before anything has changed.

    ``still`` says for each axis whether the momentum along it is conserved.
    """
    drift = np.where(still, drift_of(masses, velocities), 0.0)
    energy = 0.5 * float(masses @ ((velocities - drift) ** 2).sum(axis=1))
    return Balance(drift, np.array([energy]), np.zeros(1), np.zeros(1))


@inner
def hold(balance, now):
    """Add the energy since the last change to its integral."""
    balance.action[0] += balance.energy[0] * (now - balance.since[0])
    balance.since[0] = now


@inner
def book(balance, change, now):
    """Enter a change of the energy."""
    hold(balance, now)
    balance.energy[0] += change


@before_pair.register
def _(observer: Balance, model, state, event):
    book(observer, event.virial * (event.rv / event.rr - 0.5 * (event.a + event.b)), event.now)


@gain.register
def _(observer: Balance, energy, now):
    book(observer, energy, now)


@at_epoch.register
def _(observer: Balance, model, state, length):
    # From the velocities again: rounding errors do not accumulate, and a gas may cool by any number of
    # decades.
    hold(observer, length)
    rows = state.rows
    twice = 0.0
    for i in range(len(rows) - 1):  # the last row is the ghost
        square = 0.0
        for axis in range(len(observer.drift)):
            v = np.float64(rows[i].v[axis]) - observer.drift[axis]
            square += v * v
        twice += mass(model.pair, i) * square
    observer.energy[0] = 0.5 * twice
    observer.since[0] = 0.0


@at_rest.register
def _(observer: Balance, now, since):
    hold(observer, now)
    observer.since[0] = since


@copy_state.register
def _(model: Balance, before, instant, passed, slower):
    action = before.action[0] + before.energy[0] * (passed - before.since[0])
    model.action[0] = np.ldexp(action, slower)
