"""High dimensions, mass ratios and cooling: overlaps, energy drift and rate, each in a few seconds.

python tests/benchmarks/extremes.py
"""

from __future__ import annotations

import time

import numpy as np

import carom

COLLISIONS = 20.0
"""Collisions per particle of each scene."""


def heavy(ratio: float) -> carom.Scene:
    """Return 500 spheres at 0.3, every second one heavier by a ratio."""
    scene = carom.Scene.crystal(cells=5, packing_fraction=0.3)
    masses = np.where(np.arange(scene.n) % 2, ratio, 1.0)
    return scene.replace(mass=masses)


def scenes() -> dict[str, carom.Scene]:
    """Return the scenes by what is extreme about them."""
    return {
        "masses 1 : 10^4": heavy(1e4),
        "masses 1 : 10^8": heavy(1e8),
        "cooling, restitution 0.9": carom.Scene.crystal(cells=5, packing_fraction=0.1).replace(impact=0.9),
        "cooling, restitution 0.6": carom.Scene.crystal(cells=5, packing_fraction=0.1).replace(impact=0.6),
        "d = 10, N = 100, edge 2.3": carom.Scene.random(100, box=(2.3,) * 10, diameter=1.0, seed=1),
    }


def main() -> None:
    """Print the table."""
    print("| extreme | worst overlap [diameters] | energy drift | T / T0 | collisions / s |")
    print("|---|---|---|---|---|", flush=True)
    for name, scene in scenes().items():
        sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(images=False))
        sim.run(collisions=10)  # compiles
        start, began = sim.kT, time.process_time()
        sim.run(collisions_per_particle=COLLISIONS)
        rate = (sim.collisions - 10) / (time.process_time() - began)
        statistics = sim.statistics
        drift = f"{statistics.energy_drift:.1e}" if scene.impact.restitution == 1.0 else "-"
        print(
            f"| {name} | {statistics.worst_overlap:.1e} | {drift} | {sim.kT / start:.4g} | {rate:.2g} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
