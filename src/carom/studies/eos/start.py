"""What a run of a study begins with."""

from __future__ import annotations

import numpy as np

from carom import initial, theory
from carom.scene import Scene
from carom.specs import SceneSpec

NEAR_FREEZING = 0.93
"""Part of the freezing density from which order is watched, and nothing starts as a crystal to be melted."""

ROOM = 0.9
"""Part of a lattice's densest packing up to which it is filled: beyond it there is no room to melt in."""


def start(asked: SceneSpec, rng: np.random.Generator) -> Scene:
    """Return the scene that is asked for, with the faster one of two ways to a random start.

    Parameters
    ----------
    asked : SceneSpec
    rng : numpy.random.Generator
        Source of randomness.

    Notes
    -----
    Spheres placed at random take the time of some hundred thousand collisions (N = 4000) to be moved apart.
    Well below freezing a crystal, with as many random vacancies as n asks for, is gone after ten to a hundred
    collisions a sphere, of the thousand that a run is equilibrated for; and a run whose spheres still are
    where they began is flagged. So equal spheres from three dimensions on start as one.
    """
    melts = _melting(asked)
    if melts is None:
        return asked.build(rng)
    lattice, cells = melts
    assert asked.n is not None
    assert asked.packing_fraction is not None
    sites = lattice.count(initial.cells_along(lattice, cells))
    crystal = Scene.on(
        lattice,
        cells,
        packing_fraction=asked.packing_fraction * sites / asked.n,
        diameter=asked.diameter or 1.0,
        mass=asked.mass or 1.0,
    )
    kept = np.sort(rng.permutation(sites)[: asked.n])
    return Scene(crystal.positions[kept], crystal.box, diameter=crystal.diameter, mass=crystal.mass)


def _melting(asked: SceneSpec) -> tuple[initial.Lattice, int] | None:
    """Return a lattice, and its cells along an edge, that melts at once; None where there may be none."""
    d = asked.dimension or 3
    given = (asked.species, asked.obstacles, asked.periodic, asked.restitution, asked.box, asked.density)
    if asked.initial != "random" or any(value not in (None, ()) for value in given) or d < 3:
        return None
    assert asked.n is not None
    assert asked.packing_fraction is not None
    if d not in theory.FREEZING or asked.packing_fraction > NEAR_FREEZING * theory.FREEZING[d]:
        return None
    lattice, cells = initial.dn(d), 1
    while (sites := lattice.count(initial.cells_along(lattice, cells))) < asked.n:
        cells += 1
    return (lattice, cells) if asked.packing_fraction * sites / asked.n <= ROOM * lattice.limit else None
