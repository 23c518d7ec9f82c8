"""CPU seconds to place many spheres at random, with the compiled code in the cache.

python tests/benchmarks/random_scenes.py
python tests/benchmarks/random_scenes.py --n 1000000 --dimension 3 --packing-fraction 0.3
"""

import argparse
import time

import carom
from carom.geometry import overlaps


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--n", type=int, nargs="+", default=[100_000, 1_000_000])
    parser.add_argument("--dimension", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--packing-fraction", type=float, nargs="+", default=[0.3, 0.45])
    given = parser.parse_args()
    for dimension in given.dimension:
        carom.Scene.random(overlaps.MANY, dimension=dimension, packing_fraction=0.1)  # loads or compiles
        for n in given.n:
            for fraction in given.packing_fraction:
                began = time.process_time()
                scene = carom.Scene.random(n, fraction, dimension, seed=1)
                placed = time.process_time()
                carom.Scene(scene.positions, scene.box)
                checked = time.process_time() - placed
                print(
                    f"d = {dimension}, N = {n}, {fraction}: {placed - began:.2f} s, "
                    f"of which a check of the scene {checked:.2f} s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
