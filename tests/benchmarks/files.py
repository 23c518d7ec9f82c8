"""What files cost beside their bytes: python tests/benchmarks/files.py [N [.h5md .gsd .extxyz]].

For each format the seconds of CPU that a frame takes to write and to read, and their ratio to those of the
same arrays written and read by h5py or gsd without anything of Carom; extended XYZ is compared with nothing.
Last, the opening of a file to append, and what checksums cost in time and bytes.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gsd.hoomd
import h5py
import numpy as np

import carom.io
from carom.frame import Frame
from carom.io.gsd import _to_gsd

REPEATS = 3
SUFFIXES = sys.argv[2:] or [".h5md", ".gsd", ".extxyz"]


def seconds(work: Callable[[], Any]) -> float:
    """Return the least CPU time of a few calls."""
    best = np.inf
    for _ in range(REPEATS):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return float(best)


def frame_of(n: int) -> Frame:
    """Return a frame of random doubles."""
    rng = np.random.default_rng(0)
    edge = float(n ** (1 / 3))
    return Frame(
        time=1.0,
        step=1,
        positions=rng.random((n, 3)) * edge,
        velocities=rng.normal(size=(n, 3)),
        box=(edge,) * 3,
        diameters=np.ones(n),
        masses=np.ones(n),
        images=rng.integers(-9, 9, (n, 3)).astype(np.int32),
    )


def write(path: Path, frame: Frame) -> None:
    """Write a file of one frame."""
    with carom.io.open(path, "w") as writer:
        writer.write(frame)


def write_bare(path: Path, frame: Frame, checksums: bool) -> None:
    """Write the same arrays with h5py alone."""
    with h5py.File(path, "w") as file:
        for name in ("positions", "velocities", "images", "diameters", "masses"):
            array = getattr(frame, name)
            file.create_dataset(name, data=array, chunks=array.shape, fletcher32=checksums)


def read_bare(path: Path) -> None:
    """Read them."""
    with h5py.File(path) as file:
        for name in file:
            file[name][:]


def write_bare_gsd(path: Path, stored: gsd.hoomd.Frame) -> None:
    """Write a frame that is float32 already with gsd alone."""
    with gsd.hoomd.open(str(path), "w") as file:
        file.append(stored)


def read_bare_gsd(path: Path) -> None:
    """Read it."""
    with gsd.hoomd.open(str(path), "r") as file:
        file[0]


def main() -> None:
    """Print the table."""
    n = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000
    frame = frame_of(n)
    stored = _to_gsd(frame)
    with tempfile.TemporaryDirectory() as folder:
        bare, bare_gsd = Path(folder, "bare.h5"), Path(folder, "bare.gsd")
        plain = Path(folder, "plain.h5")
        floors = {
            ".h5md": (
                seconds(lambda: write_bare(bare, frame, checksums=True)),
                seconds(lambda: read_bare(bare)),
            ),
            ".gsd": (
                seconds(lambda: write_bare_gsd(bare_gsd, stored)),
                seconds(lambda: read_bare_gsd(bare_gsd)),
            ),
        }
        without = (
            seconds(lambda: write_bare(plain, frame, checksums=False)),
            seconds(lambda: read_bare(plain)),
        )
        print(f"N = {n}, one frame; CPU seconds, and their ratio to the bare bytes")
        print(f"{'':10}{'MB':>8}{'write':>9}{'ratio':>7}{'read':>9}{'ratio':>7}")
        for suffix in SUFFIXES:
            path = Path(folder, f"a{suffix}")
            took = (
                seconds(lambda path=path: write(path, frame)),
                seconds(lambda path=path: carom.io.read(path)),
            )
            cells = "".join(
                f"{value:9.3f}" + (f"{value / floors[suffix][k]:7.2f}" if suffix in floors else f"{'':7}")
                for k, value in enumerate(took)
            )
            print(f"{suffix:10}{path.stat().st_size / 1e6:8.1f}{cells}")
        opening = seconds(lambda: carom.io.open(Path(folder, "a.h5md"), "a").close())
        print(f"opening the .h5md to append, all frames verified: {opening:.3f} s")
        print(
            "checksums of bare h5py: "
            f"write {floors['.h5md'][0] / without[0]:.2f}x, read {floors['.h5md'][1] / without[1]:.2f}x, "
            f"{bare.stat().st_size - plain.stat().st_size} bytes more"
        )


if __name__ == "__main__":
    main()
