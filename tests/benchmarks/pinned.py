"""Rates with pinned components, compared with as many that move, in turn: pair collisions a CPU second.

python tests/benchmarks/pinned.py                      # 20 to 100 000 pinned disks at 0.15
python tests/benchmarks/pinned.py --dimension 3 --fixed 1000
"""

import argparse
import statistics
import time

import numpy as np

import carom


def rate(sim, seconds):
    """Return collisions a CPU second."""
    before, began = sim.collisions, time.process_time()
    sim.run(walltime=seconds)
    return (sim.collisions - before) / (time.process_time() - began)


def main():
    """Print a line for each number of pinned components."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dimension", type=int, default=2)
    parser.add_argument("--fixed", type=int, nargs="+", default=[20, 200, 1000, 10_000, 100_000])
    parser.add_argument("--packing-fraction", type=float, default=0.15)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=1.0)
    options = parser.parse_args()
    print("pinned   movers   all move     pinned   ratio")
    for fixed in options.fixed:
        n = fixed + max(fixed, 200) if fixed > 1000 else fixed + 200
        scene = carom.Scene.random(
            n, dimension=options.dimension, packing_fraction=options.packing_fraction, seed=1
        )
        who = np.random.default_rng(0).permutation(n)[:fixed]
        sims = [carom.Simulation(each, seed=1) for each in (scene, scene.replace(pinned=who))]
        for sim in sims:
            sim.run(collisions=500)
        rates = [[rate(sim, options.seconds) for sim in sims] for _ in range(options.turns)]
        free, held = (statistics.median(column) for column in zip(*rates, strict=True))
        print(f"{fixed:6d} {n - fixed:8d} {free:10.3g} {held:10.3g} {held / free:7.2f}", flush=True)


if __name__ == "__main__":
    main()
