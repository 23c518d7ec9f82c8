"""The currents of momentum and heat, and their exact integrals over time: Helfand's moments.

Their frame is that of the center of mass. Between collisions currents are constant; a collision adds the
momentum and energy that it transfers over the distance of the centers (E. Helfand, Phys. Rev. 119, 1 (1960);
B. J. Alder, D. M. Gass and T. E. Wainwright, J. Chem. Phys. 53, 3813 (1970)). With steps each component holds
half of the energy of its pairs, u_i, and the current of energy is ``sum m v^2 v / 2 + sum u_i v_i``; the
second part changes at collisions only. Hard cores hold None.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from carom.engine.observers.energy import drift_of
from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import ROOM, parameter, present
from carom.models.interfaces.particles import NEVER


class Held(NamedTuple):
    """The energies that components hold."""

    halves: Annotated[np.ndarray, present(-2)]
    """Half of the energies of the pairs of each component, (n + 1,) float64."""
    energies: Annotated[np.ndarray, parameter(-2)]
    """Energy of a pair on each step, float64."""
    start: int
    """Where the current of energy begins in ``Currents.flow``."""


class Currents(Observer):
    """Currents now, their integrals so far, and samples of these at equal times.

    A tensor is symmetric and kept as its upper triangle, row by row: s = d (d + 1) / 2 numbers.
    """

    drift: Annotated[np.ndarray, present(-1)]
    """Velocity of the center of mass, (d,) float64."""
    species: np.ndarray
    """Species of each component, (n + 1,) int64."""
    flow: Annotated[np.ndarray, present()]
    """Currents now, (s + d + K d,): sum of m v_a v_b; sum of the energy of each component times its v_a; sum
    of v_a of each species."""
    carried: Annotated[np.ndarray, present()]
    """Their integrals from the start of the run to ``since``, in the same order."""
    thrown: Annotated[np.ndarray, present()]
    """What collisions carried, (s + d,): momentum dp_a r_b, energy dE r_a."""
    since: Annotated[np.ndarray, present(1)]
    """Time of the last change, in the epoch, (1,) float64."""
    upcoming: Annotated[np.ndarray, ROOM]
    """Time of the next sample, in the epoch, and from one sample to the next, (2,) float64.
    Samples that are being taken end with the run, and a loaded one takes none."""
    used: Annotated[np.ndarray, ROOM]
    """Samples written, (1,) int64."""
    samples: Annotated[np.ndarray, ROOM]
    """(count, 2 s + 2 d + K d) float64: ``carried`` and ``thrown`` at the times of the samples."""
    room: Annotated[np.ndarray, ROOM]
    """Room for r, and for the velocities of two before and after a collision, (5, d) float64."""
    held: Held | None
    """Energies of pairs with steps that components hold, or None."""

    def before_pair(self, model, state, event):
        currents, i, j, a, b = self, event.i, event.j, event.a, event.b
        carry(currents, event.now)
        me = state.rows[i]
        other = state.rows[j]
        r, v, after, w, later = (
            currents.room[0],
            currents.room[1],
            currents.room[2],
            currents.room[3],
            currents.room[4],
        )
        d = len(model.boundary.edges)
        for p in range(d):
            x = model.boundary.separation(i, event.ref, p, np.float64(other.x[p]) - np.float64(me.x[p]))
            r[p] = x
            v[p] = np.float64(me.v[p]) - currents.drift[p]
            w[p] = np.float64(other.v[p]) - currents.drift[p]
            after[p] = v[p] + a * x
            later[p] = w[p] - b * x
        first = model.pair.mass_of(i)
        second = model.pair.mass_of(j)
        kind, other_kind = currents.species[i], currents.species[j]
        gained = -enter(currents, first, kind, v, -1.0) + enter(currents, first, kind, after, 1.0)
        lost = enter(currents, second, other_kind, w, -1.0) - enter(currents, second, other_kind, later, 1.0)
        pass_over(currents.held, currents.flow, i, j, event.before, event.after, v, after, w, later)
        c = 0
        for p in range(d):
            for q in range(p, d):
                currents.thrown[c] -= first * a * r[p] * r[q]
                c += 1
        for p in range(d):
            # Where a pair takes up energy, or gives it, each of the two has half of it.
            currents.thrown[c + p] -= r[p] * 0.5 * (gained + lost)

    def at_epoch(self, model, state, length):
        # From the velocities again, so that rounding does not add up.
        currents, rows = self, state.rows
        carry(currents, length)
        currents.since[0] = 0.0
        currents.upcoming[0] -= length
        currents.flow[:] = 0.0
        v = currents.room[1]
        for i in range(len(rows) - 1):  # the last row is padding
            for p in range(len(v)):
                v[p] = np.float64(rows[i].v[p]) - currents.drift[p]
            enter(currents, model.pair.mass_of(i), currents.species[i], v, 1.0)
            carry_held(currents.held, currents.flow, i, v)

    def at_rest(self, now, since):
        carry(self, now)
        self.since[0] = since
        self.upcoming[0] -= now - since


def make_currents(masses, velocities, species, held=None) -> Currents:
    """Return the currents of components with velocities (n, d) and species or None, without energy yet."""
    n, d = velocities.shape
    count = 0 if species is None else int(species.max()) + 1
    size = d * (d + 1) // 2 + d
    currents = Currents(
        drift=drift_of(masses, velocities),
        species=np.zeros(n + 1, np.int64) if species is None else species,
        flow=np.zeros(size + count * d),
        carried=np.zeros(size + count * d),
        thrown=np.zeros(size),
        since=np.zeros(1),
        upcoming=np.array([NEVER, NEVER]),
        used=np.zeros(1, np.int64),
        samples=np.zeros((0, 2 * size + count * d)),
        room=np.zeros((5, d)),
        held=held,
    )
    v = velocities - currents.drift
    tensor = np.einsum("i,ia,ib->ab", masses, v, v)
    heat = 0.5 * np.einsum("i,ib,ib,ia->a", masses, v, v, v)
    momenta = [v[species[:n] == k].sum(axis=0) for k in range(count)]
    currents.flow[:] = np.concatenate([tensor[np.triu_indices(d)], heat, *momenta])
    return currents


def make_held(n: int, dimension: int, energies: np.ndarray) -> Held:
    """Return that n components hold nothing."""
    return Held(np.zeros(n + 1), energies, dimension * (dimension + 1) // 2)


def fill(currents, pairs: np.ndarray, steps: np.ndarray, velocities: np.ndarray) -> None:
    """Let components hold the energies of pairs (m, 2) on their steps (m,), with the velocities of now."""
    held = currents.held
    shares = 0.5 * held.energies[steps]
    halves = np.zeros(len(held.halves))
    np.add.at(halves, pairs[:, 0], shares)
    np.add.at(halves, pairs[:, 1], shares)
    moved = (halves - held.halves)[: len(velocities)] @ (velocities - currents.drift)
    currents.flow[held.start : held.start + len(currents.drift)] += moved
    held.halves[:] = halves


def observe(currents, now):
    """Write the samples that are due up to the time now: every current was constant until then."""
    size = len(currents.flow)
    while currents.used[0] < len(currents.samples) and currents.upcoming[0] <= now:
        row = currents.samples[currents.used[0]]
        passed = currents.upcoming[0] - currents.since[0]
        for c in range(size):
            row[c] = currents.carried[c] + currents.flow[c] * passed
        for c in range(len(currents.thrown)):
            row[size + c] = currents.thrown[c]
        currents.used[0] += 1
        currents.upcoming[0] += currents.upcoming[1]


def carry(currents, now):
    """Add the currents since the last change to their integrals."""
    observe(currents, now)
    passed = now - currents.since[0]
    for c in range(len(currents.flow)):
        currents.carried[c] += currents.flow[c] * passed
    currents.since[0] = now


def enter(currents, m, kind, v, sign):
    """Add to the currents what a component of mass m with velocity v is to them, times ``sign``."""
    d = len(v)
    twice = 0.0
    c = 0
    for p in range(d):
        twice += v[p] * v[p]
        for q in range(p, d):
            currents.flow[c] += sign * m * v[p] * v[q]
            c += 1
    for p in range(d):
        currents.flow[c + p] += sign * 0.5 * m * twice * v[p]
    c += d
    if len(currents.flow) > c:
        for p in range(d):
            currents.flow[c + kind * d + p] += sign * v[p]
    return 0.5 * m * twice


def carry_held(held, flow, i, v):
    """Add to the current of energy what component i with velocity v holds."""
    if held is None:
        return
    for p in range(len(v)):
        flow[held.start + p] += held.halves[i] * v[p]


def pass_over(held, flow, i, j, before, step, v, after, w, later):
    """Record that i and j change step, and their velocities from v to ``after`` and w to ``later``."""
    if held is None:
        return
    mine, other = held.halves[i], held.halves[j]
    change = 0.5 * (held.energies[step] - held.energies[before])
    held.halves[i] = mine + change
    held.halves[j] = other + change
    for p in range(len(v)):
        flow[held.start + p] += (mine + change) * after[p] - mine * v[p]
        flow[held.start + p] += (other + change) * later[p] - other * w[p]
