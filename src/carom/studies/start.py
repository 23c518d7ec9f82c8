"""The start of a run of a study."""

from __future__ import annotations

import numpy as np

from carom import densities, theory
from carom.declared import fields_of
from carom.errors import InputError
from carom.scene import lattices, placement
from carom.scene.scene import Scene
from carom.scene_file.sections import SceneSpec
from carom.simulation.moves.growth import grown

LOOSE, LONG = 0.8, 20.0
"""Fraction of the freezing density at which crystals melt for a start near freezing, before the spheres grow
to the requested one; and collisions per component that this takes."""

OF_SPHERES = ("n", "packing_fraction", "dimension", "diameter", "mass")
"""Keys of the scenes that may start as a crystal, which is made with these alone."""

ROOM = 0.9
"""Largest packing fraction of the full lattice over its densest one: beyond it there is no room to melt."""


def start(asked: SceneSpec, rng: np.random.Generator) -> Scene:
    """Return the requested scene, by the fastest way to a random start.

    Spheres placed at random take some hundred thousand collisions to move apart (N = 4000); a crystal with
    random vacancies melts within ten to a hundred per sphere, near freezing with smaller spheres that then
    grow.
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
    positions, reached = grown(crystal, np.full(crystal.n, diameter), rng, melting=LONG)
    if positions is None:
        raise InputError(
            f"The spheres jam at packing fraction {reached:.4g}, and {asked.packing_fraction:.4g} is asked "
            "for: lower packing_fraction."
        )
    return crystal.replace(positions=positions, diameter=diameter)


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
    """Return a lattice, its cells along an edge, and a packing fraction at which it melts quickly.

    That is the requested one where it is low enough. None: the scene cannot start as a crystal.
    """
    d = asked.dimension or 3
    others = fields_of(SceneSpec).keys() - {*OF_SPHERES}
    if d < 3 or any(getattr(asked, name) not in (None, ()) for name in others):
        return None
    assert asked.n is not None
    assert asked.packing_fraction is not None
    if d not in theory.FREEZING or asked.packing_fraction > placement.random_limit(d):
        return None
    lattice, cells = lattices.dn(d), 1
    while (sites := lattice.count(lattices.cells_along(lattice, cells))) < asked.n:
        cells += 1
    freezing = theory.FREEZING[d]
    near = asked.packing_fraction > theory.NEAR_FREEZING * freezing
    fraction = LOOSE * freezing if near else asked.packing_fraction
    return (lattice, cells, fraction) if fraction * sites / asked.n <= ROOM * lattice.limit else None
