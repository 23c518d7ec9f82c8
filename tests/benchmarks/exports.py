"""CPU time of exports and of g(r), of frames of 10^5 spheres.

python tests/benchmarks/exports.py
"""

import tempfile
import time
from pathlib import Path

import numpy as np

import carom.io
from carom.frame import Frame
from carom.observables import RDF

N, FRAMES, EDGE = 100_000, 5, 56.0


def frames():
    """Spheres on a grid with velocities."""
    rng = np.random.default_rng(1)
    cells = int(np.ceil(N ** (1 / 3)))
    places = np.stack(np.meshgrid(*[np.arange(cells)] * 3), -1).reshape(-1, 3)[:N] * (EDGE / cells) + 0.01
    ones, images = np.ones(N), np.zeros((N, 3), np.int32)
    for k in range(FRAMES):
        velocities = rng.standard_normal((N, 3))
        yield Frame(float(k), k, places, velocities, (EDGE,) * 3, ones, ones, images=images)


def told(what, work):
    """Do it, and print the CPU time."""
    began = time.process_time()
    work()
    print(f"{what}: {time.process_time() - began:.2f} CPU s for {FRAMES} frames", flush=True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "run.h5md"

        def write():
            with carom.io.open(source, "w") as writer:
                for frame in frames():
                    writer.write(frame)

        def distances():
            with carom.io.open(source) as reader:
                RDF().over(iter(reader))

        told("write H5MD", write)
        told("g(r), compiled or loaded", distances)
        told("g(r)", distances)
        for suffix in ("extxyz", "gsd", "lammpstrj", "data", "dcd", "pdb"):
            target = source.with_suffix(f".{suffix}")
            told(f"export to {suffix}", lambda target=target: carom.io.convert(source, target))


if __name__ == "__main__":
    main()
