"""Velocities of Maxwell's distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from carom import checks, seeds
from carom.errors import InputError
from carom.models.interactions.pinned import mask
from carom.scene import temperature
from carom.scene.lattices import MOST

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.scene.scene import Scene


def velocities_of(scene: Scene, kT: float, seed: int | np.random.Generator) -> np.ndarray:
    """Draw velocities (n, d) by :func:`maxwell_velocities`, tangent to the surface of the motion, if any."""
    still = temperature.conserved(scene)
    velocities = maxwell_velocities(scene.n, scene.dimension, scene.masses, kT, seed, still, scene.pinned)
    if hasattr(scene.motion, "tangent") and kT > 0.0:
        velocities = scene.motion.tangent(scene.positions, velocities, scene.box)
        velocities = temperature.at_temperature(scene, velocities, kT)
    return velocities


def maxwell_velocities(
    n: int,
    dimension: int,
    masses: float | np.ndarray = 1.0,
    kT: float = 1.0,
    seed: int | np.random.Generator = 0,
    conserved: Sequence[bool] | None = None,
    pinned: ArrayLike | None = None,
) -> np.ndarray:
    """Return velocities (n, d) of exact kT [energy], with no momentum along the axes ``conserved``.

    ``2 K = kT (d n - c)`` for c such axes; one component alone keeps its momentum, ``2 K = kT d``. They are
    all by default, none with ``pinned`` components, which stay at rest.
    """
    n = checks.integer(n, "n", low=1, high=MOST)
    dimension = checks.integer(dimension, "dimension", low=1)
    kT = checks.number(kT, "kT", low=0, high=checks.HOTTEST)
    rng = seeds.generator(seed, "velocities")
    if np.ndim(masses) == 0:
        mass = np.full(n, checks.positive(masses, "masses"))
    else:
        mass = checks.array(masses, "masses", "(n,)", ndim=1)
        if len(mass) != n or (mass <= 0).any():
            least = mass.min(initial=np.inf)
            raise InputError(f"masses must be {n} positive numbers, found {len(mass)}, the least {least:g}.")
    velocities = rng.standard_normal((n, dimension)) / np.sqrt(mass)[:, None]
    fixed = mask(pinned, n)
    still = np.full(dimension, fixed is None) if conserved is None else np.array(conserved, bool)
    moving = n
    if fixed is not None:
        velocities[fixed] = 0.0
        moving -= int(fixed.sum())
        still[:] = False
    if n == 1:
        still[:] = False
    if still.any():
        for _ in range(2):  # the second time removes what rounding left
            momentum = np.sum(mass[:, None] * velocities, axis=0)
            velocities -= np.where(still, momentum, 0.0) / mass.sum()
    # Sums with the same bits on every processor, which products of matrices are not.
    twice_kinetic = float(np.sum(mass[:, None] * velocities * velocities))
    freedoms = dimension * moving - int(still.sum())
    return velocities * math.sqrt(kT * freedoms / twice_kinetic)
