"""The scan behind the rule that chooses the neighbour scheme: rate over packing fraction and reach.

python tests/benchmarks/scan.py --dimension 3 --n 4000 --packing-fractions 0.05 0.3 0.49
"""

import argparse
import time

import carom
from carom.kernel.scheme import arrays


def rate(scene: carom.Scene, collisions: int, **choice) -> tuple[float, float]:
    """Return the rate [10^6 pair collisions per CPU second, the better of two] and bytes a particle."""
    sim = carom.Simulation(scene, seed=1, **choice)
    sim.run(collisions_per_particle=40)
    best = 0.0
    for _ in range(2):
        began = time.process_time()
        block = sim.run(collisions=collisions)
        best = max(best, block.collisions / (time.process_time() - began))
    size = sum(array.nbytes for array in arrays(sim.machine.engine).values()) / scene.n
    return best / 1e6, size


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--dimension", type=int, default=3)
    parser.add_argument("--cells", type=int, default=10, help="cells of the densest lattice along an edge")
    parser.add_argument(
        "--packing-fractions", type=float, nargs="+", default=[0.05, 0.2, 0.3, 0.4, 0.49, 0.6]
    )
    parser.add_argument("--shells", type=float, nargs="+", default=[1.4, 1.5, 1.6, 1.8, 2.0, 2.4])
    parser.add_argument("--collisions", type=float, default=5e5)
    given = parser.parse_args()
    for eta in given.packing_fractions:
        scene = carom.Scene.lattice(given.cells, dimension=given.dimension, packing_fraction=eta)
        rows = [("auto", {}), ("sectors", {"neighbors": "sectors"})]
        rows += [(f"lists {shell}", {"neighbors": "lists", "shell": shell}) for shell in given.shells]
        for name, choice in rows:
            try:
                speed, size = rate(scene, int(given.collisions), **choice)
            except carom.InputError:
                continue
            print(
                f"d={given.dimension} eta={eta:<5} n={scene.n} {name:10} {speed:7.3f} M/s {size:5.0f} B",
                flush=True,
            )


if __name__ == "__main__":
    main()
