"""g(r) of one frame beside freud and a k-d tree, in turn: CPU seconds on one core, and the ratios.

python tests/benchmarks/rdf.py                          # 10^5 hard spheres at 0.45, to 5 diameters
python tests/benchmarks/rdf.py --dimension 2 --n 20000 --turns 5
"""

import argparse
import statistics
import time

import numpy as np

from carom import Scene
from carom.cells import Grid, SortedCells
from carom.observables.analysis.pair_counts import distance_counts


def carom_counts(positions, box, edges, threads=1):
    """Return the pairs in each bin by sorted cells."""
    periodic = np.ones(len(box), dtype=bool)
    cells = SortedCells.of(Grid.of(box, periodic, len(positions), edges[-1]), positions)
    return distance_counts(cells, None, edges, threads=threads)[0]


def freud_counts(positions, box, edges):
    """Return the same by freud (single precision), from r = 0 on."""
    import freud

    freud.parallel.set_num_threads(1)
    flat = len(box) == 2
    place = np.zeros((len(positions), 3))
    place[:, : len(box)] = positions - 0.5 * box
    bins = round(edges[-1] / (edges[1] - edges[0]))
    rdf = freud.density.RDF(bins, edges[-1])
    rdf.compute((freud.box.Box(*box, is2D=flat), place))
    return rdf.bin_counts[-len(edges) + 1 :] // 2


def tree_counts(positions, box, edges):
    """Return the same by scipy's k-d tree, in portions of some four million pairs."""
    from scipy.spatial import cKDTree

    tree = cKDTree(positions, boxsize=box)
    counts = np.zeros(len(edges) - 1, dtype=np.int64)
    for part in np.array_split(positions, max(len(positions) // 5000, 1)):
        pairs = cKDTree(part, boxsize=box).sparse_distance_matrix(tree, edges[-1], output_type="ndarray")
        # Each component with itself is closer than all bins.
        counts += np.histogram(pairs["v"], bins=len(edges) - 1, range=(edges[0], edges[-1]))[0]
    return counts // 2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--n", type=int, default=100_000)
    parser.add_argument("--dimension", type=int, default=3)
    parser.add_argument("--packing-fraction", type=float, default=0.45)
    parser.add_argument("--reach", type=float, default=5.0, help="last distance [diameters]")
    parser.add_argument("--turns", type=int, default=5)
    given = parser.parse_args()
    scene = Scene.random(given.n, dimension=given.dimension, packing_fraction=given.packing_fraction)
    box = np.array(scene.box)
    edges = np.linspace(1.0, given.reach, round((given.reach - 1.0) / 0.02) + 1)
    ways = {"carom": carom_counts, "k-d tree": tree_counts}
    if given.dimension in (2, 3):
        ways["freud"] = freud_counts
    counts, seconds = {}, {name: [] for name in ways}
    carom_counts(scene.positions, box, edges)
    for _ in range(given.turns):
        for name, way in ways.items():
            start = time.process_time()
            counts[name] = way(scene.positions, box, edges)
            seconds[name].append(time.process_time() - start)
    pairs = int(counts["carom"].sum())
    print(f"{given.n} in {given.dimension}D to {given.reach:g} diameters: {pairs / 1e6:.1f} million pairs")
    for name in ways:
        ratios = sorted(b / a for a, b in zip(seconds["carom"], seconds[name], strict=True))
        print(
            f"{name:>8}: {statistics.median(seconds[name]):6.3f} s of one core, "
            f"{statistics.median(ratios):5.1f} ({ratios[0]:.1f} to {ratios[-1]:.1f}) of carom, "
            f"counts {'equal' if np.array_equal(counts[name], counts['carom']) else 'differ'}"
        )
    start = time.perf_counter()
    carom_counts(scene.positions, box, edges, threads=None)
    print(f"carom, all threads: {time.perf_counter() - start:.3f} s of wall time")


if __name__ == "__main__":
    main()
