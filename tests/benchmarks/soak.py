"""A billion collisions: does anything drift, overlap or get lost? Do several workers keep the bits of one?

    python tests/benchmarks/soak.py --collisions 1e9
    python tests/benchmarks/soak.py --dimension 2 --cells 160 --packing-fraction 0.7 --workers 2

prints a line every twenty million collisions. Figures of such runs are in docs/extremes.md and
docs/parallel.md.
"""

import argparse
import time

import numpy as np

import carom


def scene_of(dimension, cells, packing_fraction):
    """Return spheres on the fcc lattice, or disks on the triangular one."""
    place = carom.Scene.triangular if dimension == 2 else carom.Scene.fcc
    return place(cells=cells, packing_fraction=packing_fraction)


def soaked(scene, collisions, every, workers):
    """Run a scene for so many collisions, print a line every so often, and return the simulation."""
    sim = carom.Simulation(scene, seed=1, workers=workers)
    cpu, wall = time.process_time(), time.perf_counter()
    while sim.collisions < collisions:
        sim.run(collisions=round(every))
        found, frame = sim.statistics, sim.frame()
        assert np.isfinite(frame.positions).all()
        sim.scene.with_(positions=frame.positions)  # refuses overlaps
        print(
            f"{sim.collisions:.3g} collisions, time {sim.time:.6g}, {time.process_time() - cpu:.0f} s "
            f"({time.perf_counter() - wall:.0f} s of wall time): "
            f"overlap {found.worst_overlap:.1e}, energy {found.energy_drift:.1e}, "
            f"momentum {found.momentum_drift:.1e}, advancements {found.advancement_fraction:.4f}, "
            f"clamped roots {found.clamped_roots}",
            flush=True,
        )
    return sim


def compare(one, several):
    """Raise AssertionError if two simulations differ in a bit of their state or of their sums."""
    assert (one.time, one.collisions) == (several.time, several.collisions)
    assert one.tally == several.tally
    alone, together = one.frame(), several.frame()
    for name in ("positions", "velocities", "images"):
        assert np.array_equal(getattr(alone, name), getattr(together, name)), f"{name} differ"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--collisions", type=float, default=1e9)
    parser.add_argument("--dimension", type=int, choices=(2, 3), default=3)
    parser.add_argument("--cells", type=int, default=10, help="along an edge, of 4 spheres or 2 disks")
    parser.add_argument("--packing-fraction", type=float, default=0.45)
    parser.add_argument("--every", type=float, default=2e7, help="collisions between two lines")
    parser.add_argument("--workers", type=int, default=1, help="so many, too, and the same bits at the end")
    given = parser.parse_args()
    scene = scene_of(given.dimension, given.cells, given.packing_fraction)
    one = soaked(scene, given.collisions, given.every, 1)
    if given.workers > 1:
        with soaked(scene, given.collisions, given.every, given.workers) as several:
            compare(one, several)
            shares = several.machine.team.shares
            print(
                f"n {scene.n}: {given.workers} workers have the bits of one; {shares.windows} windows "
                f"kept, {shares.repeats} run again"
            )


if __name__ == "__main__":
    main()
