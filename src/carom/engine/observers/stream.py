"""Energy and pressure tensor of a sheared box (``carom.models.motions.shear``), exact between contacts.

Of peculiar velocities u about that of the center of mass ``M_ab = sum m u_a u_b`` changes in flight, as u_0
falls by ``rate u_1`` a time: ``M_0b`` is linear in time, ``M_00`` a parabola. So their integrals are sums
over contacts. The velocity of the center of mass falls likewise.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from carom.engine.observers.energy import drift_of
from carom.engine.observers.interface import Observer
from carom.models.interfaces.memory import copied, kept, parameter, present


class StreamSums(Observer):
    """Sums over the peculiar velocities of all components."""

    rate: Annotated[float, parameter(-1)]  # shear rate
    drift: Annotated[np.ndarray, present(-1)]
    """Velocity of the center of mass at the time ``since``, zero where no momentum is conserved, (d,)."""
    moments: Annotated[np.ndarray, present(-2)]  # ``sum m u_a u_b`` at the time ``since``, (d, d)
    integral: Annotated[np.ndarray, kept(-1)]  # its integral from the start of the run to ``since``, (d, d)
    virial: Annotated[np.ndarray, kept(-1)]
    """``sum r_a dp_b`` over contacts: r to the partner, dp what the partner gained, (d, d)."""
    since: Annotated[np.ndarray, present(1)]  # time of the last change, in the epoch, (1,)
    r: Annotated[np.ndarray, present()]  # vector to the partner of the last contact, (d,)

    def before_pair(self, model, state, event):
        fly(self, event.now)
        me, other = state.rows[event.i], state.rows[event.j]
        for axis in range(len(self.r)):
            self.r[axis] = model.motion.contact_vector(
                model.boundary, event.i, event.ref, axis, me, other, event.now
            )
        enter_pair(self, model, state, event, -1.0)

    def after_pair(self, model, state, event):
        enter_pair(self, model, state, event, 1.0)

    def before_kick(self, model, state, i, now):
        fly(self, now)
        enter(self, model.pair.mass_of(i), state.rows[i].v, -1.0)

    def after_kick(self, model, state, i, now):
        enter(self, model.pair.mass_of(i), state.rows[i].v, 1.0)

    def at_epoch(self, model, state, length):
        # From the velocities again: rounding errors do not accumulate.
        fly(self, length)
        self.moments[:] = 0.0
        for i in range(len(state.rows) - 1):  # the last row is padding
            enter(self, model.pair.mass_of(i), state.rows[i].v, 1.0)
        self.since[0] = 0.0

    def at_rest(self, now, since):
        fly(self, now)
        self.since[0] = since


def make_stream_sums(rate: float, masses: np.ndarray, velocities: np.ndarray, still) -> StreamSums:
    """Return the sums of components (n,) with peculiar velocities (n, d), before anything has happened.

    ``still`` are the axes that conserve momentum.
    """
    d = velocities.shape[1]
    drift = np.where(still, drift_of(masses, velocities), 0.0)
    u = velocities - drift
    moments = np.einsum("i,ia,ib->ab", masses, u, u)
    return StreamSums(rate, drift, moments, np.zeros((d, d)), np.zeros((d, d)), np.zeros(1), np.zeros(d))


def fly(sums, now):
    """Let the time until now pass."""
    moments, integral, d = sums.moments, sums.integral, len(sums.r)
    t = now - sums.since[0]
    sums.since[0] = now
    strain = sums.rate * t
    sums.drift[0] -= strain * sums.drift[1]
    for a in range(d):
        for b in range(d):
            integral[a, b] += moments[a, b] * t
    integral[0, 0] += (moments[1, 1] * strain / 3.0 - moments[0, 1]) * strain * t
    moments[0, 0] += (moments[1, 1] * strain - 2.0 * moments[0, 1]) * strain
    for b in range(1, d):
        integral[0, b] -= 0.5 * moments[1, b] * strain * t
        moments[0, b] -= moments[1, b] * strain
        integral[b, 0] = integral[0, b]
        moments[b, 0] = moments[0, b]


def enter(sums, weight, v, sign):
    """Add a velocity of a mass to the sums, or take it out."""
    for a in range(len(sums.r)):
        for b in range(len(sums.r)):
            u, w = np.float64(v[a]) - sums.drift[a], np.float64(v[b]) - sums.drift[b]
            sums.moments[a, b] += sign * weight * u * w


def enter_pair(sums, model, state, event, sign):
    """Add the velocities of a pair and the momentum of the partner, or take them out."""
    me, other = state.rows[event.i], state.rows[event.j]
    enter(sums, model.pair.mass_of(event.i), me.v, sign)
    weight = model.pair.mass_of(event.j)
    enter(sums, weight, other.v, sign)
    for a in range(len(sums.r)):
        for b in range(len(sums.r)):
            sums.virial[a, b] += sign * sums.r[a] * weight * np.float64(other.v[b])


def totals(sums: StreamSums, now: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the integral of the moments and the sum of the virial until a time of the epoch, (d, d) each."""
    present = copied(sums)
    fly(present, now)
    return present.integral, present.virial
