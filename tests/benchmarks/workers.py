"""One worker against several, in turn in one run: wall time, and where the time of several goes.

    python tests/benchmarks/workers.py                       # a million spheres at 0.30, two workers
    python tests/benchmarks/workers.py 2 0.70 600000 2        # dimension, packing fraction, n, workers
    python tests/benchmarks/workers.py table                  # two workers, from ten thousand to a million

Both runs must come out with the same bits. The last lines are a model, not a measurement: what the shares of
these workers mean for more of them, and what the same windows would send between hosts.
"""

import itertools
import statistics
import sys
import time
from typing import NamedTuple

import numpy as np
from soak import compare

import carom
from carom.engine.windows.partition import layout_of, share_out
from carom.engine.windows.shares import ABSENT, OWN, ZONE
from carom.simulation.workers.shares import Settings, Shares
from carom.simulation.workers.team import Team

ROUNDS = 3
PER_ROUND, LEAST = 12.0, 3_000_000
"""Collisions for each particle in a round, and in all at least."""

SCENES = ((2, 0.40), (2, 0.70), (3, 0.30), (3, 0.49))
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
"""Dimension, packing fraction and n of the table."""


def scene_of(dimension, packing_fraction, n):
    """Return a lattice of about n spheres, or disks at random."""
    if dimension == 3:
        return carom.Scene.fcc(cells=round((n / 4) ** (1 / 3)), packing_fraction=packing_fraction)
    return carom.Scene.random(n=n, dimension=dimension, packing_fraction=packing_fraction, seed=1)


def wall(sim):
    """Return the wall time of a round [s]."""
    began = time.perf_counter()
    sim.run(collisions_per_particle=max(PER_ROUND, 2.0 * LEAST / sim.scene.n))
    return time.perf_counter() - began


class Measured(NamedTuple):
    """What came out of one scene."""

    team: Team
    ratios: list[float]
    """Wall time of one worker over that of several, in each round."""
    passed: float
    """Wall time of several [s]."""


def measure(scene, workers, window=None):
    """Run a scene with one worker and with several in turn, and compare the bits."""
    one, several = (carom.Simulation(scene, seed=3) for _ in range(2))
    team = Team(several.machine, workers, Settings(collisions=window))
    several.machine.team = team
    for sim in (one, several):  # compile, touch the memory, leave the lattice, go over into an epoch
        sim.run(collisions_per_particle=20)
    team.shares = Shares()
    ratios, passed = [], 0.0
    for _ in range(ROUNDS):
        alone, together = wall(one), wall(several)
        passed += together
        ratios.append(alone / together)
        print(f"one {alone:.2f} s, {workers} {together:.2f} s, ratio {ratios[-1]:.2f}", file=sys.stderr)
    compare(one, several)
    several.close()
    return Measured(team, ratios, passed)


def size(value):
    """Return the bytes of all arrays in a value."""
    if isinstance(value, tuple):
        return sum(map(size, value))
    return getattr(value, "nbytes", 0)


def model(team, workers, ratio):
    """Print what more workers would do, by volumes of rims and by the shares measured.

    Running takes what it takes here for each cell that is held; everything else takes as long as here, with
    any number of workers. Nothing is assumed to be lost to a memory that all share.
    """
    machine, shares = team.machine, team.shares
    engine = machine.engine
    layout = layout_of(engine.neighbors, machine.scene.box, machine.scene.periodic)
    each = size((engine.state, engine.neighbors)) / machine.scene.n

    def held(parts):
        flags = share_out(layout, parts, *team.depths()).flags
        return flags, np.count_nonzero(flags != ABSENT) / flags.shape[1]

    run, rest = shares.run, shares.wall - shares.run - shares.lost
    alone = ratio * (run + rest)
    for parts in (workers, 4, 16, 64):
        flags, volume = held(parts)
        wall = run * volume / held(workers)[1] * workers / parts + rest
        rim, zone = (
            np.count_nonzero(which, axis=1).max() / flags.shape[1] * machine.scene.n * each / 1e6
            for which in ((flags != ABSENT) & (flags != OWN), flags == ZONE)
        )
        print(
            f"model: {parts:3d} workers: volume with rims {volume:.2f}, ratio {alone / wall:.1f}; "
            f"between hosts {rim:.1f} MB of rims and {zone:.1f} MB of zones for each and a window"
        )


def table():
    """Print a row for each scene and size, for two workers."""
    print(
        "| d | packing fraction | N | ratio, each round | processed for one kept | "
        + " | ".join(COLUMNS)
        + " |"
    )
    print("|---" * (5 + len(COLUMNS)) + "|")
    for (dimension, packing_fraction), n in itertools.product(SCENES, SIZES):
        scene = scene_of(dimension, packing_fraction, n)
        team, ratios, passed = measure(scene, 2)
        shares = team.shares
        row = [str(dimension), f"{packing_fraction:.2f}", str(scene.n)]
        row += [", ".join(f"{ratio:.2f}" for ratio in ratios)]
        row += [f"{shares.processed / max(shares.collisions, 1):.2f}"]
        row += [f"{part / passed:.3f}" for part in columns(shares, passed, 2)]
        print("| " + " | ".join(row) + " |", flush=True)


COLUMNS = (
    "running",
    "of it waiting",
    "rims and copies",
    "comparing",
    "merging",
    "new epochs",
    "repeats",
    "one worker",
)
"""Of the wall time of several workers."""


def columns(shares, passed, workers):
    """Return the seconds of ``COLUMNS``."""
    waiting = max(shares.run - shares.busy / workers, 0.0)
    copies = shares.load + shares.store
    ends = (shares.compare, shares.merge, shares.turn, shares.lost)
    return (shares.run, waiting, copies, *ends, passed - shares.wall)


def main(dimension=3, packing_fraction=0.30, n=1_000_000, workers=2, window=None):
    scene, workers = scene_of(int(dimension), float(packing_fraction), int(n)), int(workers)
    team, ratios, passed = measure(scene, workers, window)
    shares = team.shares
    processed = shares.processed / max(shares.collisions, 1)
    print(f"median {statistics.median(ratios):.2f}; processed {processed:.3f} a collision")
    print(f"windows {shares.windows}, run again {shares.repeats}; of {passed:.2f} s:")
    for name, part in zip(COLUMNS, columns(shares, passed, workers), strict=True):
        print(f"  {name:15} {part / passed:.3f}")
    model(team, workers, statistics.median(ratios))


if __name__ == "__main__":
    if sys.argv[1:] == ["table"]:
        table()
    else:
        main(*map(float, sys.argv[1:]))
