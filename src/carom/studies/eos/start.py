"""What a run of a study begins with."""

from __future__ import annotations

import numpy as np

from carom import densities, theory
from carom.plan.sections import SceneSpec
from carom.scene import lattices, placement
from carom.scene.scene import Scene
from carom.simulation.growth import grown

NEAR_FREEZING = 0.93
"""Part of the freezing density from which order is watched, and crystals are melted before they are squeezed
to the density asked for.
"""

LOOSE, LONG = 0.8, 20.0
"""Part of the freezing density at which they are melted then, and collisions a component that takes."""

ROOM = 0.9
"""Part of a lattice's densest packing up to which it is filled: beyond it there is no room to melt in."""


def start(asked: SceneSpec, rng: np.random.Generator) -> Scene:
    """Return the scene that is asked for, with the fastest way to a random start.

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
    where they began is flagged. So equal spheres from three dimensions on start as one. Near freezing it
    would not melt: there it is melted in a larger box, and the spheres of the fluid grow.
    """
    melting = _melting(asked)
    if melting is None:
        return asked.build(rng)
    assert asked.packing_fraction is not None
    lattice, cells, fraction = melting
    diameter = asked.diameter or 1.0
    if fraction == asked.packing_fraction:
        return _crystal(asked, lattice, cells, fraction, diameter, rng)
    smaller = diameter * (fraction / asked.packing_fraction) ** (1.0 / lattice.dimension)
    crystal = _crystal(asked, lattice, cells, fraction, smaller, rng)
    positions = grown(crystal, np.full(crystal.n, diameter), rng, melting=LONG)
    return crystal.with_(positions=positions, diameter=diameter)


def _crystal(
    asked: SceneSpec,
    lattice: lattices.Lattice,
    cells: int,
    packing_fraction: float,
    diameter: float,
    rng: np.random.Generator,
) -> Scene:
    """Return a crystal with vacancies."""
    assert asked.n is not None
    block = lattices.cells_along(lattice, cells)
    sites = lattice.count(block)
    rho = densities.reduced_density(lattice.dimension, packing_fraction=packing_fraction * sites / asked.n)
    edge = lattice.edge(rho) * diameter
    kept = np.sort(rng.permutation(sites)[: asked.n])
    return Scene(
        lattice.points(block, edge)[kept],
        lattice.box(block, edge),
        diameter=diameter,
        mass=asked.mass or 1.0,
    )


def _melting(asked: SceneSpec) -> tuple[lattices.Lattice, int, float] | None:
    """Return a lattice, its cells along an edge and a packing fraction at which it melts at once, that asked
    for where it does; None where there may be none.
    """
    d = asked.dimension or 3
    given = (asked.species, asked.obstacles, asked.periodic, asked.restitution, asked.box, asked.density)
    if asked.initial != "random" or any(value not in (None, ()) for value in given) or d < 3:
        return None
    if any(value is not None for value in (asked.interaction, asked.motion, asked.impact)):
        return None
    assert asked.n is not None
    assert asked.packing_fraction is not None
    if d not in theory.FREEZING or asked.packing_fraction > placement.random_limit(d):
        return None
    lattice, cells = lattices.dn(d), 1
    while (sites := lattice.count(lattices.cells_along(lattice, cells))) < asked.n:
        cells += 1
    freezing = theory.FREEZING[d]
    near = asked.packing_fraction > NEAR_FREEZING * freezing
    fraction = LOOSE * freezing if near else asked.packing_fraction
    return (lattice, cells, fraction) if fraction * sites / asked.n <= ROOM * lattice.limit else None
