"""What a contact of rough particles exchanges along their surfaces (``carom.models.contacts.rough``)."""

from __future__ import annotations

import math

import numpy as np

from carom.models.contacts.rough import Rubbing, add_spin, slip_to_impulse, update_spin
from carom.models.interactions.pinned import PinnedCores
from carom.models.obstacles.surfaces import RoughSurface


def rub(impact, model, state, i, j, ref, rr, virial, now):
    """Exchange momentum along the surfaces of i and j, if they are rough, after the normal part."""
    if not isinstance(impact, Rubbing):
        return
    me, other = state.rows[i], state.rows[j]
    dimension = len(model.boundary.edges)
    distance = math.sqrt(rr)
    for axis in range(dimension):
        r = model.motion.contact_vector(model.boundary, i, ref, axis, me, other, now)
        impact.normal[axis] = r / distance
        impact.slip[axis] = model.motion.contact_velocity(model.boundary, i, ref, axis, me, other)
    # The distance is the sum of the radii, but for rounding: angular momentum is kept to the last digit.
    mine = distance * (impact.radii[i] / (impact.radii[i] + impact.radii[j]))
    add_spin(impact, i, mine)
    add_spin(impact, j, distance - mine)
    a, turns_a = mobility(model.pair, impact, i)
    b, turns_b = mobility(model.pair, impact, j)
    compliance = a + b + turns_a + turns_b
    slip_to_impulse(impact, impact.tangential, impact.friction, compliance, virial / distance, dimension)
    energy = 0.0
    for axis in range(dimension):
        p = impact.slip[axis]
        v = np.float64(other.v[axis]) - np.float64(me.v[axis])
        energy += p * (v + 0.5 * (a + b) * p)
        me.v[axis] -= a * p
        other.v[axis] += b * p
    if turns_a > 0.0:
        update_spin(impact, i, mine)
    if turns_b > 0.0:
        update_spin(impact, j, distance - mine)
    model.observers.gain(energy, now)


def mobility(pair, impact, i):
    """Return ``1 / m`` and ``R^2 / I`` of component i [1 / mass]."""
    if not isinstance(pair, PinnedCores):
        return 1.0 / pair.mass_of(i), 1.0 / impact.inertia[i]
    inverse = pair.inverse[i]
    return inverse, (1.0 / impact.inertia[i] if inverse > 0.0 else 0.0)


def rub_obstacle(obstacle, impact, model, state, i, now):
    """Exchange momentum along the surfaces of an obstacle and i, if they are rough."""
    if not isinstance(obstacle, RoughSurface):
        return
    there = model.obstacles
    dimension = len(model.boundary.edges)
    momentum = 0.0
    for axis in range(dimension):
        v = there.v[axis]
        momentum += there.image[axis] * (v - np.float64(state.rows[i].v[axis]))
        impact.normal[axis] = -there.image[axis]
        impact.slip[axis] = obstacle.body.body.surface_velocity(axis, now) - v
    arm = impact.radii[i]
    add_spin(impact, i, arm)
    a, turns = mobility(model.pair, impact, i)
    slip_to_impulse(impact, obstacle.tangential, obstacle.friction, a + turns, momentum / a, dimension)
    for axis in range(dimension):
        there.v[axis] -= a * impact.slip[axis]
    update_spin(impact, i, arm)
