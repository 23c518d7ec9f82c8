"""Scenes of the same density as the one that is compared: a small one for the oracle, another for g(r)."""

from __future__ import annotations

import math

from carom.errors import InputError
from carom.scene import lattices
from carom.scene.scene import Scene

SMALL = 64
"""Largest number of particles that the 50-digit oracle follows."""


def small_scene(scene: Scene) -> Scene:
    """Return a scene of the same density that the oracle can follow: the scene itself, if it is small."""
    if scene.n <= SMALL:
        return scene.replace(velocities=None)
    d, eta = scene.dimension, scene.packing_fraction
    for lattice in (lattices.cubic(d), lattices.densest(d)):
        cells = 1
        while lattice.count(lattices.cells_along(lattice, cells + 1)) <= SMALL:
            cells += 1
        if eta < 0.95 * lattice.limit:
            return Scene.crystal(
                lattice=lattice, cells=cells, packing_fraction=eta, diameter=scene.diameter, mass=scene.mass
            )
    raise InputError(
        f"A packing fraction of {eta:.6g} is too near close packing for the oracle's small scene; lower it."
    )


def medium_scene(scene: Scene) -> Scene:
    """Return a scene of the same density with about 500 particles, for g(r)."""
    lattice = lattices.densest(scene.dimension)
    cells = max(2, round((500 / len(lattice.basis) * math.prod(lattice.shape)) ** (1.0 / scene.dimension)))
    return Scene.crystal(
        cells=cells,
        dimension=scene.dimension,
        packing_fraction=scene.packing_fraction,
        diameter=scene.diameter,
        mass=scene.mass,
    )
