"""Dense fluids by growth: spheres placed where there is room grow, while they move, to the size wanted.

Random placement moves overlapping spheres apart, which takes ever more steps towards jamming, each a pass
over all pairs. Growing spheres get out of each other's way by themselves, and only where they meet.
"""

from __future__ import annotations

import math

import numpy as np

from carom import seeds
from carom.scene import placement
from carom.scene.scene import Scene

__all__ = ["Scene", "grown"]

FAST, SLOW = 1.0, 0.05
"""Growth of the mean diameter a time over the thermal speed, below the densities of random placement, and
beyond, where faster growth would jam.
"""

STILL = 1e-6
"""The same while a crystal melts: nearly zero, as a simulation without growth cannot take it up later."""

STRETCH = 0.02  # slow growth between two rescalings, as a part of the diameter

MOST = 1000
"""Collisions a component in one stretch, by far more than any fluid has, after which it counts as jammed."""

CLEAR = 1.0 + 1e-9  # diameters grow by so much too far, so that rounding leaves no overlap


def grown(
    start: Scene, diameters: np.ndarray, seed: int | np.random.Generator, melting: float = 0.0
) -> tuple[np.ndarray | None, float]:
    """Return positions (n, d) after growth, None if the spheres jam, and the packing fraction reached.

    The diameters of ``start`` are those given times one factor; ``melting`` is in collisions a component
    before.
    """
    from carom.simulation.simulation import Simulation  # only where spheres grow: it takes longer to load

    size, dimension = float(diameters.mean()), start.dimension
    unit = diameters / (size * np.sqrt(start.mass))
    velocities = int(seeds.generator(seed, "growth").integers(2**63))
    sim = Simulation(start, seed=velocities, growth=(STILL if melting else FAST) * unit)
    sim.run(collisions_per_particle=melting)
    fraction = start.packing_fraction * (size / float(start.diameters.mean())) ** dimension
    dense = min((placement.random_limit(dimension) / fraction) ** (1.0 / dimension), CLEAR)
    n_stretches = math.ceil((CLEAR - dense) / STRETCH)
    # Diameters at the ends of all stretches, as parts of the final ones, and the rate towards each.
    ends = [(dense, FAST)] + [
        (dense + (CLEAR - dense) * (k + 1) / n_stretches, SLOW) for k in range(n_stretches)
    ]
    for end, rate in ends:
        sim.rescale(1.0, growth=rate * unit)
        time = (end * size - float(sim.diameters.mean())) / (rate * float(unit.mean()))
        if sim.run(time=time, collisions=MOST * start.n).duration < time:
            return None, sim.packing_fraction
    return sim.frame().positions, fraction


Scene._grown = grown
