"""The momentum balance of walls and containers: what they took up, freed of the sound in the box.

A wall takes up momentum in pulses, because sound runs to and fro between it and the other wall. Let u be a
field that is the unit normal at the wall's contacts, pointing out of the fluid, and zero at the other walls.
The weighted momentum ``M = sum_i p_i . u(r_i)`` changes by what the wall takes up and by the stress in the
fluid::

    dM/dt = -F + sum of (stress : grad u) over the fluid

So ``F + dM/dt`` is the stress averaged with the weight grad u. M is bounded, so its change adds nothing to
the mean of a long stretch. Where div u is the same everywhere, sound waves, whose density averages to zero,
cancel in that average to first order: what is left is correlated for a mean free time or two, not for the
time that sound takes through the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.models.obstacles import Ball, CylindricalContainer, Plane, SphericalContainer

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.scene.scene import Scene


def balanced_by_field(obstacle: object) -> bool:
    """Return whether a field is known that balances the momentum which the obstacle takes up."""
    if isinstance(obstacle, Plane):  # other walls would see a slanting field, and their sound with it
        return np.count_nonzero(obstacle.normal) == 1
    return isinstance(obstacle, Ball | SphericalContainer | CylindricalContainer)


def weighted_momenta(frame: Frame, scene: Scene) -> tuple[float, ...]:
    """Return the weighted momentum M of the components for each wall and obstacle.

    Parameters
    ----------
    frame : Frame
        Positions and velocities at one time.
    scene : Scene

    Returns
    -------
    tuple of float
        In the order of :attr:`carom.Simulation.obstacles` [mass length / time]. Zero for slanting planes and
        obstacles of one's own, for which no such field is known (``carom.observables.surface_changes``).

    Notes
    -----
    Between walls at 0 and L the weight of the lower one is ``(L - sigma_i / 2 - x) / (L - sigma_i)``, from 1
    where component i touches it to 0 where i touches the upper one. In a container of radius R about c it is
    ``(r - c) / (R - sigma_i / 2)``, of a cylinder without the component along its axis. Around a ball the
    field is radial, of constant divergence up to half of the box, and zero beyond. A plane's goes to zero at
    the height of the highest component, where another plane may be.
    """
    momenta, places, radii = frame.masses[:, None] * frame.velocities, frame.positions, 0.5 * frame.diameters
    found: list[float] = []
    for axis, wraps in enumerate(scene.periodic):
        if wraps:
            continue
        edge = scene.box[axis]
        upper = _over(places[:, axis] - radii, edge - 2.0 * radii)
        toward = float(momenta[:, axis] @ upper)
        found += [toward - float(momenta[:, axis].sum()), toward]
    for obstacle in scene.obstacles:
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
    # Of constant divergence: r^(d-1) u falls linearly with r^d.
    weight = _over(end**d - distance**d, end**d - contact**d) * (contact / distance) ** (d - 1)
    weight[distance >= end] = 0.0
    return float(np.sum(momenta * toward, axis=1) / distance @ weight)


def _above(plane: Plane, momenta: np.ndarray, places: np.ndarray, radii: np.ndarray) -> float:
    """Return the momentum towards a plane, weighted from 1 at contact to 0 where the highest component is."""
    toward = -momenta @ np.sign(plane.normal)
    height = plane.gap(places, radii, (), ())
    return float(toward @ (1.0 - _over(height, np.full_like(height, height.max()))))


def _over(values: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Return values / room, and zero for components that fill all of the room and cannot move."""
    return np.divide(values, room, out=np.zeros_like(values), where=room > 0.0)
