"""Rough contacts: spins, a tangential restitution, and Coulomb's cone of friction.

Walton, Int. J. Multiphase Flow 19 (1993) 343. Where i and j of radii R touch, the velocity of the surface of
j relative to that of i, with the spins w and the unit vector k from i to j, is

    g = v_j - v_i - (R_i w_i + R_j w_j) x k

A contact replaces its normal part by -e times itself and the tangential part by -beta times itself. The
tangential impulse is at most ``friction`` times the normal one, against the slip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.declared import number
from carom.errors import InputError
from carom.models.contacts.restitution import Restitution
from carom.models.declared_values import PART
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.memory import ROOM, kept, parameter
from carom.models.interfaces.particles import Particles


def _inertia(value: Any, name: str) -> float | tuple[float, ...]:
    """Return the moment of inertia of all particles, or of each, over that of a shell."""
    if not checks.several(value):
        return PART(value, name)
    each = checks.array(value, name, "(n,)", ndim=1)
    if not ((each > 0.0) & (each <= 1.0)).all():
        raise InputError("inertia of a particle lies in (0, 1], that of a shell of disks.")
    return tuple(each.tolist())


@dataclass(frozen=True)
class Rough(Restitution):
    """Contacts of rough particles, which spin, in two or three dimensions.

    Parameters
    ----------
    restitution : float
        Fraction e of the normal relative velocity that remains, in (0, 1]; 1 loses nothing.
    elastic_below : float, optional
        As of ``carom.models.Restitution``: the normal part of a slower contact is elastic [length / time].
    tangential : float
        Fraction beta of the tangential velocity of the surfaces that is reversed, from -1 (smooth) to 1
        (perfectly rough).
    friction : float, optional
        Largest ratio of the tangential to the normal impulse (Coulomb); by default there is no limit.
    inertia : float or (n,) sequence of floats, optional
        The moment of inertia of a particle is ``inertia m R^2``; by default that of a solid ball,
        2 / (d + 2): 1/2 for disks, 2/5 for spheres.

    Raises
    ------
    InputError
        If a value is out of range.

    Notes
    -----
    Particles begin with the ``spins`` of the scene, by default without any. With e = 1 and beta = 1 or -1,
    without friction, contacts keep the energy of translation and rotation.

    Examples
    --------
    >>> Rough(0.9, tangential=0.5, friction=0.3).friction
    0.3
    """

    type = "rough"
    tangential: Annotated[float, number(low=-1.0, high=1.0)] = 0.0
    friction: Annotated[float | None, number(low=0.0, high=checks.MAGNITUDE)] = None
    inertia: Annotated[Any, _inertia] = None

    @property
    def elastic(self) -> bool:
        """False: energy goes to and from the rotation."""
        return False

    @property
    def conserves_energy(self) -> bool:
        """Whether contacts keep the sum of the energies of translation and rotation."""
        return self.restitution == 1.0 and abs(self.tangential) == 1.0 and self.friction is None

    @property
    def largest_friction(self) -> float:
        """``friction``, infinite without it."""
        return math.inf if self.friction is None else self.friction

    def check(self, scene: Any) -> None:
        """Raise InputError if such contacts make no sense in a ``scene``."""
        if scene.dimension not in (2, 3):
            raise InputError(f"Rough contacts are of disks and spheres, found {scene.dimension} dimensions.")
        if scene.contact is not None or not getattr(scene.interaction, "by_radii", False):
            raise InputError(
                "Rough contacts need particles that touch at the sum of their radii: otherwise no point of "
                "contact is on both surfaces. Leave out contact or interaction, or Rough."
            )
        if getattr(scene.motion, "curved", False):
            name = type(scene.motion).__name__
            raise InputError(f"Spins of rough particles are not defined in {name}; leave out one of them.")
        if isinstance(self.inertia, tuple) and len(self.inertia) != scene.n:
            raise InputError(f"inertia holds {len(self.inertia)} values, and the scene {scene.n} particles.")

    def inertias(self, masses: np.ndarray, dimension: int) -> np.ndarray:
        """Return the moment of inertia over R^2 of particles of ``masses`` (n,) in a ``dimension`` [mass]."""
        part = 2.0 / (dimension + 2.0) if self.inertia is None else np.array(self.inertia)
        return part * masses

    def model(self, particles: Particles) -> Any:
        """Return the model that the engine compiles."""
        dimension = len(particles.box)
        return Rubbing(
            restitution=float(self.restitution),
            threshold=float(particles.speed(self.elastic_below)),
            spared=np.zeros(1, np.int64),
            tangential=self.tangential,
            friction=self.largest_friction,
            inertia=particles.with_padding(self.inertias(particles.masses, dimension)),
            radii=particles.with_padding(particles.radii),
            spins=np.zeros((len(particles.radii) + 1, spin_axes(dimension))),
            normal=np.zeros(3),
            slip=np.zeros(3),
        )


def spin_axes(dimension: int) -> int:
    """Return how many numbers a spin has: one in the plane, three in space."""
    return 1 if dimension == 2 else 3


class Rubbing(ImpactModel):
    """Contacts that exchange momentum along the surfaces, too."""

    restitution: float  # normal speed after over normal speed before a contact
    threshold: Annotated[float, parameter(-1)]  # normal speed below which the normal part is elastic
    spared: Annotated[np.ndarray, kept()]  # number of contacts that were elastic for that reason, (1,) int64
    tangential: float  # beta
    friction: float  # largest ratio of the tangential to the normal impulse
    inertia: np.ndarray  # moment of inertia over R^2, (n + 1,) [mass]
    radii: np.ndarray  # (n + 1,) [length]
    spins: Annotated[np.ndarray, kept(-1)]  # (n + 1, 1) in the plane, (n + 1, 3) in space [1 / time]
    normal: Annotated[np.ndarray, ROOM]  # room for the unit vector from one particle to the other, (3,)
    slip: Annotated[np.ndarray, ROOM]
    """Room for a velocity of the surfaces, which becomes the tangential impulse, (3,)."""

    def transfer(self, rr, rv):
        if rv * rv < self.threshold * self.threshold * rr:
            self.spared[0] += 1
            return 1.0
        return 0.5 * (1.0 + self.restitution)


def add_spin(impact, i, arm):
    """Take from the room's slip the surface velocity of particle i by its spin, ``arm`` along the normal."""
    w, k, slip = impact.spins[i], impact.normal, impact.slip
    if impact.spins.shape[1] == 1:
        slip[0] += arm * w[0] * k[1]
        slip[1] -= arm * w[0] * k[0]
    else:
        slip[0] -= arm * (w[1] * k[2] - w[2] * k[1])
        slip[1] -= arm * (w[2] * k[0] - w[0] * k[2])
        slip[2] -= arm * (w[0] * k[1] - w[1] * k[0])


def slip_to_impulse(impact, tangential, friction, compliance, normal_impulse, dimension):
    """Replace the room's relative velocity of the surfaces by the tangential impulse on the second.

    ``compliance`` is the sum of ``1 / m + R^2 / I`` of both [1 / mass]; the rest is as of :class:`Rough`.
    """
    k, slip = impact.normal, impact.slip
    along = 0.0
    for axis in range(dimension):
        along += slip[axis] * k[axis]
    square = 0.0
    for axis in range(dimension):
        slip[axis] -= along * k[axis]
        square += slip[axis] * slip[axis]
    part = (1.0 + tangential) / compliance
    limit = friction * abs(normal_impulse)
    if part * part * square > limit * limit:
        part = limit / math.sqrt(square)
    for axis in range(dimension):
        slip[axis] *= -part


def update_spin(impact, i, arm):
    """Turn particle i by the tangential impulse in the room, which acts at the ``arm`` from its center.

    Both partners turn alike: the impulse on the other is opposite, and so is the arm.
    """
    w, k, p = impact.spins[i], impact.normal, impact.slip
    # I = inertia R^2, where R is the arm of a contact.
    part = 1.0 / (impact.inertia[i] * arm)
    if impact.spins.shape[1] == 1:
        w[0] -= part * (k[0] * p[1] - k[1] * p[0])
    else:
        w[0] -= part * (k[1] * p[2] - k[2] * p[1])
        w[1] -= part * (k[2] * p[0] - k[0] * p[2])
        w[2] -= part * (k[0] * p[1] - k[1] * p[0])
