"""A billion collisions: does anything drift, overlap or get lost? Do several workers keep the bits of one?

    python tests/benchmarks/soak.py --collisions 1e9
    python tests/benchmarks/soak.py --dimension 2 --cells 224 --packing-fraction 0.4 --workers 2

prints a line every twenty million collisions. Figures of such runs are in docs/benchmarks.md.
"""

import argparse
import time

import numpy as np

import carom
from carom.simulation.measuring import stretches


def soak(sims, collisions, every):
    """Run simulations of one scene for so many collisions, in turn; print a line, and compare, every so
    often.
    """
    walls = [0.0 for _ in sims]
    while sims[0].collisions < collisions:
        for k, sim in enumerate(sims):
            began = time.perf_counter()
            sim.run(collisions=round(every))
            walls[k] += time.perf_counter() - began
        for other in sims[1:]:
            compare(sims[0], other)
        found, frame = sims[0].statistics, sims[0].frame()
        assert np.isfinite(frame.positions).all()
        sims[0].scene.replace(positions=frame.positions)  # refuses overlaps
        print(
            f"{sims[0].collisions:.3g} collisions, time {sims[0].time:.6g}, wall time "
            f"{' and '.join(f'{wall:.0f} s' for wall in walls)}: "
            f"overlap {found.worst_overlap:.1e}, energy {found.energy_drift:.1e}, "
            f"momentum {found.momentum_drift:.1e}, advancements {found.advancement_fraction:.4f}, "
            f"clamped roots {found.clamped_roots}",
            flush=True,
        )


def compare(one, several):
    """Raise AssertionError if two simulations differ in a bit of their state or of their sums."""
    assert (one.time, one.collisions) == (several.time, several.collisions)
    assert stretches.tally(one) == stretches.tally(several)
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
    parser.add_argument("--workers", type=int, default=1, help="so many, too, with the bits of one")
    given = parser.parse_args()
    size = {"dimension": given.dimension, "cells": given.cells}
    scene = carom.Scene.crystal(**size, packing_fraction=given.packing_fraction)
    sims = [carom.Simulation(scene, seed=1, cores=k) for k in sorted({1, given.workers})]
    soak(sims, given.collisions, given.every)
    if given.workers > 1:
        timings = sims[1]._state.executive.timings
        print(
            f"n {scene.n}: {given.workers} workers have the bits of one; {timings.windows} windows kept, "
            f"{timings.repeats} run again"
        )
        sims[1].close()


if __name__ == "__main__":
    main()
