"""Velocities of Maxwell's distribution, and the temperature of velocities.

Temperature is twice the kinetic energy about the motion of the center of mass, per degree of freedom. That
motion counts only along axes where momentum is not conserved (walls). All of Carom uses this.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom import checks, seeds
from carom.errors import InputError
from carom.scene.fields import standing

if TYPE_CHECKING:
    from carom.scene.scene import Scene


def velocities_of(scene: Scene, kT: float, seed: int | np.random.Generator) -> np.ndarray:
    """Draw velocities (n, d) of exact kT [energy], tangent to the surface of the motion, if any.

    They have no momentum along the axes on which it is conserved; pinned components rest.
    """
    kT = checks.number(kT, "kT", low=0, high=checks.HOTTEST)
    still, masses = np.asarray(conserved(scene)), scene.masses[:, None]
    rng, moving = seeds.generator(seed, "velocities"), scene.n
    velocities = rng.standard_normal((scene.n, scene.dimension)) / np.sqrt(masses)
    if scene.pinned is not None:
        velocities[scene.pinned] = 0.0
        moving -= int(scene.pinned.sum())
    if still.any():
        for _ in range(2):  # the second time removes what rounding left
            velocities -= np.where(still, np.sum(masses * velocities, axis=0), 0.0) / masses.sum()
    # Sums with the same bits on every processor, which products of matrices are not.
    twice_kinetic = float(np.sum(masses * velocities * velocities))
    freedoms = scene.dimension * moving - int(still.sum())
    velocities *= math.sqrt(kT * freedoms / twice_kinetic)
    if hasattr(scene.motion, "tangent") and kT > 0.0:
        velocities = scene.motion.tangent(scene.positions, velocities, scene.box)
        velocities = at_temperature(scene, velocities, kT)
    return velocities


def conserved(scene: Scene) -> tuple[bool, ...]:
    """Tell for every axis whether the total momentum along it is conserved; a single component is free.

    Planes take it up along their normals, cylinders across their axis, own obstacles along all unless they
    have ``glides``, pinned components along all. Range rules and drives of single particles conserve none, a
    motion such as gravity some.
    """
    decides = not getattr(scene.interaction, "keeps_momentum", True)
    kicked = scene.drive is not None and not getattr(scene.drive, "conserves_momentum", False)
    if scene.n == 1 or scene.pinned is not None or decides or kicked:
        return (False,) * scene.dimension

    def glides(obstacle: Any, axis: int) -> bool:
        return hasattr(obstacle, "glides") and obstacle.glides(axis)

    return tuple(
        wraps and kept and all(glides(obstacle, axis) for obstacle in standing(scene))
        for axis, (wraps, kept) in enumerate(zip(scene.periodic, kept_by_motion(scene), strict=True))
    )


def kept_by_motion(scene: Scene) -> tuple[bool, ...]:
    """Tell for every axis whether the motion between contacts keeps the total momentum along it."""
    keeps = getattr(scene.motion, "conserves", lambda axis: True)
    return tuple(bool(keeps(axis)) for axis in range(scene.dimension))


def degrees_of_freedom(scene: Scene) -> int:
    """Return how many coordinates of velocity are free: :attr:`carom.Simulation.degrees_of_freedom`."""
    own = getattr(scene.motion, "degrees_of_freedom", None)
    if own is not None:
        return int(own(scene.n, scene.dimension))
    free = scene.n if scene.pinned is None else scene.n - int(scene.pinned.sum())
    return scene.dimension * free - sum(conserved(scene))


def peculiar(scene: Scene, velocities: np.ndarray) -> np.ndarray:
    """Return velocities (n, d) about that of the center of mass, where the momentum is conserved.

    A drift is subtracted together with its rounding: equal velocities leave exactly zero.
    """
    still, masses = np.asarray(conserved(scene)), scene.masses[:, None]

    def without_drift(v: np.ndarray) -> np.ndarray:
        return v - np.where(still, np.sum(masses * v, axis=0), 0.0) / masses.sum()

    rest = without_drift(velocities)
    drift = np.abs(velocities - rest).max(axis=0)
    if (drift > np.abs(rest).max(axis=0)).any():
        # Differences of nearly equal velocities are exact; differences from a rounded mean are not.
        rest = without_drift(velocities - np.where(still, velocities[0], 0.0))
    return rest


class Thermal(NamedTuple):
    """What is thermal of the velocities of a scene."""

    conserved: tuple[bool, ...]  # along which axes the total momentum is conserved
    degrees_of_freedom: int
    masses: np.ndarray  # of each component, (n,) [mass]
    velocities: np.ndarray  # of each component, (n, d) [length / time]
    peculiar: np.ndarray
    """Velocities about that of the center of mass, (n, d) [length / time]: :func:`peculiar`."""

    @property
    def drift(self) -> float:
        """The largest difference of a velocity from its peculiar one, along an axis [length / time]."""
        return float(np.abs(self.velocities - self.peculiar).max())

    @property
    def kT(self) -> float:
        """Twice the kinetic energy of ``peculiar`` over the degrees of freedom [energy]."""
        v = self.peculiar
        return float(np.sum(self.masses[:, None] * v * v) / self.degrees_of_freedom)


def thermal_of(scene: Scene, velocities: np.ndarray) -> Thermal:
    """Return what is thermal of velocities (n, d) [length / time]."""
    rest = peculiar(scene, velocities)
    return Thermal(conserved(scene), degrees_of_freedom(scene), scene.masses, velocities, rest)


def temperature(scene: Scene, velocities: np.ndarray) -> float:
    """Return kT [energy]: twice the energy about the center of mass over :func:`degrees_of_freedom`."""
    return thermal_of(scene, velocities).kT


def at_temperature(scene: Scene, velocities: np.ndarray, kT: float) -> np.ndarray:
    """Return velocities, scaled so that the temperature is ``kT``, without momentum that is conserved."""
    velocities = peculiar(scene, velocities)
    twice = float(np.sum(scene.masses[:, None] * velocities * velocities))
    if twice == 0.0:
        raise InputError("Nothing moves, so there is no temperature to scale; give the scene velocities.")
    half = math.frexp(twice)[1] // 2  # a temperature over another may be no double; their roots are
    factor = math.sqrt(kT * degrees_of_freedom(scene) / math.ldexp(twice, -2 * half))
    return np.ldexp(factor * velocities, -half)
