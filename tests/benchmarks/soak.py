"""A billion collisions: does anything drift, overlap or get lost?

    python tests/benchmarks/soak.py --collisions 1e9

prints a line every twenty million collisions. Figures of such a run are in docs/extremes.md.
"""

import argparse
import time

import numpy as np

import carom


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--collisions", type=float, default=1e9)
    parser.add_argument("--cells", type=int, default=10, help="fcc cells along an edge; four spheres each")
    parser.add_argument("--packing-fraction", type=float, default=0.45)
    parser.add_argument("--every", type=float, default=2e7, help="collisions between two lines")
    given = parser.parse_args()
    sim = carom.Simulation(
        carom.Scene.fcc(cells=given.cells, packing_fraction=given.packing_fraction), seed=1
    )
    began = time.process_time()
    while sim.collisions < given.collisions:
        sim.run(collisions=round(given.every))
        found, frame = sim.statistics, sim.frame()
        assert np.isfinite(frame.positions).all()
        sim.scene.with_(positions=frame.positions)  # refuses overlaps
        print(
            f"{sim.collisions:.3g} collisions, time {sim.time:.6g}, {time.process_time() - began:.0f} s: "
            f"overlap {found.worst_overlap:.1e}, energy {found.energy_drift:.1e}, "
            f"momentum {found.momentum_drift:.1e}, advancements {found.advancement_fraction:.4f}, "
            f"clamped roots {found.clamped_roots}",
            flush=True,
        )


if __name__ == "__main__":
    main()
