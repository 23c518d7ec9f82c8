"""The momentum balance of walls and containers: the force on them, without the pulses of sound in the box.

Let u be a field that is the outward unit normal at the wall's contacts, and zero at other walls. The weighted
momentum ``M = sum_i p_i . u(r_i)`` changes by what the wall receives and by the stress in the fluid::

    dM/dt = -F + sum of (stress : grad u) over the fluid

So ``F + dM/dt`` is the stress averaged with the weight grad u; M is bounded and adds nothing to a long mean.
If div u is uniform, sound cancels to first order, and the rest is correlated for a mean free time or two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.arithmetic import dot, power
from carom.models.obstacles import Ball, CylindricalContainer, Plane, SphericalContainer
from carom.scene.fields import standing

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.scene.scene import Scene


def balanced_by_field(obstacle: object) -> bool:
    """Return whether a field is known that balances the momentum which the obstacle takes up."""
    if isinstance(obstacle, Plane):  # the field of a slanting plane would not vanish at other walls
        return np.count_nonzero(obstacle.normal) == 1
    return isinstance(obstacle, Ball | SphericalContainer | CylindricalContainer)


def weighted_momenta(frame: Frame, scene: Scene) -> tuple[float, ...]:
    """Return M [mass length / time] for each wall and obstacle, in the order of ``Simulation.obstacles``.

    It is zero for slanting planes and own obstacles (``analysis.surface_changes``). Between walls at
    0 and L the weight of the lower is ``(L - sigma_i / 2 - x) / (L - sigma_i)``; in a container of radius R
    about c the field is ``(r - c) / (R - sigma_i / 2)``, across the axis for a cylinder.
    """
    momenta, places, radii = frame.masses[:, None] * frame.velocities, frame.positions, 0.5 * frame.diameters
    found: list[float] = []
    for axis, wraps in enumerate(scene.periodic):
        if wraps:
            continue
        edge = scene.box[axis]
        upper = _over(places[:, axis] - radii, edge - 2.0 * radii)
        toward = dot(momenta[:, axis], upper)
        found += [toward - float(momenta[:, axis].sum()), toward]
    for obstacle in standing(scene):
        if not balanced_by_field(obstacle):
            found.append(0.0)
        elif isinstance(obstacle, SphericalContainer | CylindricalContainer):
            out = places - np.asarray(obstacle.center)
            if isinstance(obstacle, CylindricalContainer):
                out[:, obstacle.axis] = 0.0
            found.append(float(_over(np.sum(momenta * out, axis=1), obstacle.radius - radii).sum()))
        elif isinstance(obstacle, Ball):
            found.append(_around(obstacle, momenta, places, radii, scene))
        elif isinstance(obstacle, Plane):
            found.append(_above(obstacle, momenta, places, radii))
    return tuple(found)


def _around(ball: Ball, momenta: np.ndarray, places: np.ndarray, radii: np.ndarray, scene: Scene) -> float:
    """Return the momentum towards a ball, weighted from 1 at contact to 0 at half of the smallest edge."""
    edges = np.asarray(scene.box)
    toward = np.asarray(ball.center) - places
    toward -= np.where(scene.periodic, np.round(toward / edges) * edges, 0.0)
    distance = np.sqrt(np.sum(toward * toward, axis=1))
    d, contact, end = scene.dimension, ball.radius + radii, 0.5 * float(edges.min())
    # The divergence is constant if r^(d-1) u falls linearly with r^d.
    field = _over(end**d - power(distance, d), end**d - power(contact, d))
    weight = field * power(contact / distance, d - 1)
    weight[distance >= end] = 0.0
    return dot(np.sum(momenta * toward, axis=1) / distance, weight)


def _above(plane: Plane, momenta: np.ndarray, places: np.ndarray, radii: np.ndarray) -> float:
    """Return the momentum towards a plane, weighted from 1 at contact to 0 at the highest particle."""
    toward = -np.sum(momenta * np.sign(plane.normal), axis=1)
    height = plane.gap(places, radii, (), ())
    return dot(toward, 1.0 - _over(height, np.full_like(height, height.max())))


def _over(values: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Return values / room, and zero for particles that fill all of the room and cannot move."""
    return np.divide(values, room, out=np.zeros_like(values), where=room > 0.0)
