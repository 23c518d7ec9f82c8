"""The nearest neighbors of all components of a frame, by sorted cells, a k-d tree and freud, in turn.

    python tests/benchmarks/neighbors.py                       # 10^4 and 10^5 hard disks and spheres
    python tests/benchmarks/neighbors.py --dimensions 4 --sizes 10000

prints CPU seconds of one core, and the ratios.
"""

import argparse
import os
import statistics
import time
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads that wait for each other would be counted

import numpy as np

from carom import Scene
from carom.geometry.neighbors import nearest
from carom.geometry.overlaps import Geometry
from carom.observables.bond_order import NEAREST

PACKING = {1: 0.5, 2: 0.65, 3: 0.45, 4: 0.2}


def by_tree(room: Geometry, places: np.ndarray, count: int) -> np.ndarray:
    """Return the same by SciPy's k-d tree."""
    from scipy.spatial import cKDTree

    return cKDTree(places, boxsize=room.box).query(places, k=count + 1)[1][:, 1:]


def by_freud(room: Geometry, places: np.ndarray, count: int) -> np.ndarray:
    """Return the same by freud, in single precision."""
    import freud

    freud.parallel.set_num_threads(1)
    d = places.shape[1]
    points = np.zeros((len(places), 3))
    points[:, :d] = places - 0.5 * room.box
    query = freud.locality.AABBQuery(freud.box.Box(*room.box, is2D=d == 2), points)
    found = query.query(points, {"num_neighbors": count, "exclude_ii": True}).toNeighborList()
    return np.asarray(found.point_indices).reshape(len(places), count)


def main() -> None:
    """Print a row for each dimension and size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--dimensions", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--sizes", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--turns", type=int, default=5)
    given = parser.parse_args()
    print("| d | n | nearest | carom, s | k-d tree / carom | freud / carom | the same as the tree's |")
    print("|---|---|---|---|---|---|---|")
    for d in given.dimensions:
        for n in given.sizes:
            count = NEAREST.get(d, 2)
            scene = Scene.random(n, dimension=d, packing_fraction=PACKING[d])
            room = Geometry(np.array(scene.box), np.ones(d, bool))
            places = room.wrapped(scene.positions)
            ways: dict[str, Any] = {"carom": nearest, "tree": by_tree}
            if d in (2, 3):
                ways["freud"] = by_freud
            found = {"carom": nearest(room, places, count)}
            seconds: dict[str, list[float]] = {name: [] for name in ways}
            for _ in range(given.turns):
                for name, way in ways.items():
                    start = time.process_time()
                    found[name] = way(room, places, count)
                    seconds[name].append(time.process_time() - start)
            ours, ratios = seconds["carom"], {"freud": ""}
            for name in ways:
                each = [b / a for a, b in zip(ours, seconds[name], strict=True)]
                ratios[name] = f"{statistics.median(each):.1f}"
            same = (np.sort(found["carom"], axis=1) == np.sort(found["tree"], axis=1)).all(axis=1).mean()
            columns = (d, n, count, f"{min(ours):.4f}", ratios["tree"], ratios["freud"], f"{same:.2%}")
            print("| " + " | ".join(map(str, columns)) + " |", flush=True)


if __name__ == "__main__":
    main()
