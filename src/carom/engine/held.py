"""Potential energy that components carry: each component of a pair holds half of the energy of the pair.

If pairs have steps, the current of energy is ``sum m v^2 v / 2 + sum u_i v_i``, in which ``u_i`` is half of
the energies of all pairs of component i. The second part changes at collisions only. Hard cores hold no
energy, and have None in this place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.compiling.registry import required


class Held(NamedTuple):
    """The energies that components hold."""

    halves: np.ndarray
    """Half of the energies of the pairs of each component, (n + 1,) float64."""
    energies: np.ndarray
    """Energy of a pair on each step, float64."""
    start: int
    """Where the current of energy begins in ``Currents.flow``."""


def make_held(n: int, dimension: int, energies: np.ndarray) -> Held:
    """Return that n components hold nothing."""
    return Held(np.zeros(n + 1), energies, dimension * (dimension + 1) // 2)


def fill(currents, pairs: np.ndarray, steps: np.ndarray, velocities: np.ndarray) -> None:
    """Let components hold the energies of pairs (m, 2) on their steps (m,), and move with velocities (n, d),
    those that the run has at this moment.
    """
    held = currents.held
    shares = 0.5 * held.energies[steps]
    halves = np.zeros(len(held.halves))
    np.add.at(halves, pairs[:, 0], shares)
    np.add.at(halves, pairs[:, 1], shares)
    moved = (halves - held.halves)[: len(velocities)] @ (velocities - currents.drift)
    currents.flow[held.start : held.start + len(currents.drift)] += moved
    held.halves[:] = halves


@required
def carry_held(held, flow, i, v):
    """Add to the current of energy what component i with velocity v holds."""


@carry_held.register
def _(held: None, flow, i, v):
    return None


@carry_held.register
def _(held: Held, flow, i, v):
    for p in range(len(v)):
        flow[held.start + p] += held.halves[i] * v[p]


@required
def pass_over(held, flow, i, j, before, step, v, after, w, later):
    """Record that i and j go from one step to another, and their velocities from v to ``after`` and from w to
    ``later``.
    """


@pass_over.register
def _(held: None, flow, i, j, before, step, v, after, w, later):
    return None


@pass_over.register
def _(held: Held, flow, i, j, before, step, v, after, w, later):
    mine, other = held.halves[i], held.halves[j]
    change = 0.5 * (held.energies[step] - held.energies[before])
    held.halves[i] = mine + change
    held.halves[j] = other + change
    for p in range(len(v)):
        flow[held.start + p] += (mine + change) * after[p] - mine * v[p]
        flow[held.start + p] += (other + change) * later[p] - other * w[p]
