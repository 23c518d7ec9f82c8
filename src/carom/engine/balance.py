"""The balance of energy where contacts change it: kinetic energy and its integral over time.

Between two contacts the kinetic energy is constant, so that its integral is a sum over contacts. A balance is
kept where contacts lose energy, or surfaces that grow do work; else there is none, and it costs nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import inner, required
from carom.models.interface import mass


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


def make_balance(masses, velocities, still) -> Balance:
    """Return the balance of components (n,) with velocities (n, d), before anything has changed.

    ``still`` says for each axis whether the momentum along it is conserved.
    """
    drift = np.zeros(len(still))
    for _ in range(2):  # the second time with the digits that a fast drift has taken
        drift += np.where(still, masses @ (velocities - drift) / masses.sum(), 0.0)
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


@required
def exchanged(balance, a, b, virial, rr, rv, now):
    """Record the change of energy at a contact of two components.

    ``a``, ``b`` and ``virial`` are those of ``jump``, in the part that is exchanged; ``rv`` is r.v of the
    centres before the contact.
    """


@exchanged.register
def _(balance: None, a, b, virial, rr, rv, now):
    return None


@exchanged.register
def _(balance: Balance, a, b, virial, rr, rv, now):
    book(balance, virial * (rv / rr - 0.5 * (a + b)), now)


@required
def pushed(balance, energy, now):
    """Record the energy that a component gains at an obstacle."""


@pushed.register
def _(balance: None, energy, now):
    return None


@pushed.register
def _(balance: Balance, energy, now):
    book(balance, energy, now)


@required
def audit(balance, pair, rows, duration):
    """At the end of an epoch, compute the energy from the velocities again.

    Rounding errors therefore do not accumulate, and a gas may cool by any number of decades.
    """


@audit.register
def _(balance: None, pair, rows, duration):
    return None


@audit.register
def _(balance: Balance, pair, rows, duration):
    hold(balance, duration)
    twice = 0.0
    for i in range(len(rows) - 1):  # the last row is the ghost
        square = 0.0
        for axis in range(len(balance.drift)):
            v = np.float64(rows[i].v[axis]) - balance.drift[axis]
            square += v * v
        twice += mass(pair, i) * square
    balance.energy[0] = 0.5 * twice
    balance.since[0] = 0.0
