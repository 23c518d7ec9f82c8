"""CPU time of a collision of sheared dense spheres, with lists and with sectors, in turn.

``python tests/benchmarks/shear_lists.py``
"""

import time

import carom
from carom.models import Andersen, Shear

TURNS, COLLISIONS = 4, 100_000


def compare(packing_fraction):
    """Return the CPU time of a collision with each scheme [us], without the first turn, which compiles."""
    bath = Andersen(kT=1.0, rate=2.0)
    scene = carom.Scene.random(4000, packing_fraction, 3, seed=1, motion=Shear(0.5), drive=bath)
    sims = {
        kind: carom.Simulation(scene, kT=1.0, seed=1, tuning=carom.Tuning(neighbors=kind))
        for kind in ("lists", "sectors")
    }
    used = dict.fromkeys(sims, 0.0)
    for turn in range(TURNS):
        for kind, sim in sims.items():
            start = time.process_time()
            sim.run(collisions=COLLISIONS)
            used[kind] += time.process_time() - start if turn else 0.0
    return {kind: 1e6 * seconds / ((TURNS - 1) * COLLISIONS) for kind, seconds in used.items()}


if __name__ == "__main__":
    for packing_fraction in (0.49, 0.55):
        times = compare(packing_fraction)
        ratio = times["sectors"] / times["lists"]
        print(packing_fraction, {kind: round(each, 3) for kind, each in times.items()}, round(ratio, 2))
