"""A few scenes in one to four dimensions, and the digest of their bits: ``python tests/smoke.py [DIGEST]``.

It is the same with every version of Numba and NumPy on a machine. Given that of another run, this one fails
if it comes to other bits.
Run by ``.ci/run`` with the lowest versions that pyproject.toml allows and with the newest.
"""

import hashlib
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numba
import numpy as np

import carom
from carom.models import Ball

SCENES = {
    "rods": (carom.Scene(np.arange(10.0)[:, None] * 1.5, box=15.0), {}),
    "a mixture of disks with walls and a ball": (
        carom.Scene.random(
            species=[carom.Species(count=16), carom.Species(count=4, diameter=1.4)],
            packing_fraction=0.3,
            dimension=2,
            seed=1,
            walls="y",
            obstacles=[Ball((1.0, 3.0), 0.3)],
        ),
        {},
    ),
    "spheres": (
        carom.Scene.crystal(cells=3, packing_fraction=0.3),
        {"tuning": carom.Tuning(neighbors="lists")},
    ),
    "spheres in four dimensions": (carom.Scene.random(16, 0.05, 4, seed=1), {}),
}


def main(expected: str | None) -> int:
    """Run the scenes and print the digest; return 1 where another was expected, or the physics is wrong."""
    digest = hashlib.sha256()
    for name, (scene, options) in SCENES.items():
        sim = carom.Simulation(scene, seed=2, **options)
        sim.run(collisions=500)
        with tempfile.TemporaryDirectory() as folder:
            sim.save(Path(folder) / "state.h5")
            again = carom.Simulation.load(Path(folder) / "state.h5", obstacles=scene.obstacles)
        for each in (sim, again):
            each.run(collisions=500)
        frames = [each.frame() for each in (sim, again)]
        done = sim.statistics
        right = (frames[0].positions == frames[1].positions).all() and done.collisions == 1000
        if not right or done.worst_overlap > 1e-12 or done.energy_drift > 1e-12:
            print(f"{name}: {done}")
            return 1
        digest.update(frames[0].positions.tobytes() + frames[0].velocities.tobytes())
        print(f"{name}: {time.process_time():.0f} s", file=sys.stderr)
    print(f"Numba {numba.__version__}, NumPy {np.__version__}", file=sys.stderr)
    print(digest.hexdigest())
    return int(expected not in (None, digest.hexdigest()))


if __name__ == "__main__":
    warnings.simplefilter("default")
    sys.exit(main(*(sys.argv[1:] or [None])))
