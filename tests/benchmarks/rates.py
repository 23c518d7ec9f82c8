"""What the benchmarks measure of a simulation."""

import time

import carom
from carom.engine.build import arrays


def rate(sim: carom.Simulation, collisions: int, repeats: int = 1) -> float:
    """Return the best of some rates [10^6 pair collisions per CPU second]."""
    best = 0.0
    for _ in range(repeats):
        began = time.process_time()
        block = sim.run(collisions=collisions)
        best = max(best, block.collisions / (time.process_time() - began))
    return best / 1e6


def size_of(sim: carom.Simulation) -> float:
    """Return bytes a particle, of all arrays."""
    return sum(array.nbytes for array in arrays(sim._state.engine).values()) / sim.scene.n
