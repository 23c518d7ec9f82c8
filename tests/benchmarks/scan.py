"""The scan behind the rule that chooses the neighbor scheme: rate over packing fraction and reach.

python tests/benchmarks/scan.py --dimension 3 --cells 10 --packing-fraction 0.05 0.3 0.49
"""

import argparse
import contextlib

from rates import rate, size_of

import carom

ROUNDS = 7
"""Times that every choice has its turn: the best of them counts, so that a busy moment harms nobody."""


def begin(scene: carom.Scene, **choice) -> carom.Simulation:
    """Return a simulation that has left the lattice."""
    sim = carom.Simulation(scene, seed=1, **choice)
    sim.run(collisions_per_particle=40)
    return sim


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--dimension", type=int, default=3)
    parser.add_argument("--cells", type=int, default=10, help="cells of the densest lattice along an edge")
    parser.add_argument("--packing-fraction", type=float, nargs="+", default=[0.05, 0.2, 0.3, 0.4, 0.49, 0.6])
    parser.add_argument("--shells", type=float, nargs="+", default=[1.4, 1.5, 1.6, 1.8, 2.0, 2.4])
    parser.add_argument("--collisions", type=float, default=2e5)
    given = parser.parse_args()
    for eta in given.packing_fraction:
        scene = carom.Scene.crystal(cells=given.cells, dimension=given.dimension, packing_fraction=eta)
        choices = {"sectors": {"tuning": carom.Tuning(neighbors="sectors")}}
        choices |= {
            f"lists {shell}": {"tuning": carom.Tuning(neighbors="lists", shell=shell)}
            for shell in given.shells
        }
        sims = {}
        for name, choice in choices.items():
            with contextlib.suppress(carom.InputError):  # lists that reach around the box
                sims[name] = begin(scene, **choice)
        best = dict.fromkeys(sims, 0.0)
        for _ in range(ROUNDS):
            for name, sim in sims.items():
                best[name] = max(best[name], rate(sim, int(given.collisions)))
        for name, sim in sims.items():
            print(
                f"d={given.dimension} eta={eta:<5} n={scene.n} {name:10} "
                f"{best[name]:7.3f} M/s {size_of(sim):5.0f} B",
                flush=True,
            )


if __name__ == "__main__":
    main()
