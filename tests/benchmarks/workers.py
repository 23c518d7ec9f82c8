"""One worker against several, in turn in one run: wall time, and where the time of several goes.

    python tests/benchmarks/workers.py                       # a million spheres at 0.30, two workers
    python tests/benchmarks/workers.py 2 0.70 600000 2        # dimension, packing fraction, n, workers
    python tests/benchmarks/workers.py 2 0.70 600000 2 12     # in twelve rounds, and their median
    python tests/benchmarks/workers.py 2 0.70 600000 1        # windows of a single part, which has no borders
    python tests/benchmarks/workers.py table                  # two workers, from ten thousand to a million
    python tests/benchmarks/workers.py separate 2 0.70 1e6    # two runs that share nothing but the machine
    python tests/benchmarks/workers.py 3 0.49 256000 2 6 --busy 1    # beside a process that keeps a core busy

With ``--windows`` several workers go on also where one is faster, as in the table. Both runs must come out
with the same bits. "One worker" is what happens outside of windows: the last collisions before a given
number, and stretches in which one is faster. The last lines of the table are a model, not a measurement.
"""

import argparse
import contextlib
import itertools
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from soak import compare

import carom
from carom.engine.domains.decomposition import BORDERS, most_slabs, slabs_of
from carom.simulation.workers.executive import Executive
from carom.simulation.workers.timings import Settings, Timings

ROUNDS = 3
PER_ROUND, LEAST = 24.0, 3_000_000
"""Collisions for each particle in a round, and in all at least."""

FITTED = 90_000
"""Components from which on a scene counts for the model."""

SCENES = ((2, 0.40), (2, 0.70), (3, 0.30), (3, 0.49))
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
"""Dimension, packing fraction and n of the table."""


def scene_of(dimension, packing_fraction, n):
    """Return a lattice of about n spheres, or disks at random."""
    if dimension == 3:
        return carom.Scene.crystal(cells=round((n / 4) ** (1 / 3)), packing_fraction=packing_fraction)
    return carom.Scene.random(n=n, dimension=dimension, packing_fraction=packing_fraction, seed=1)


def wall(sim):
    """Return the wall time of a round [s]."""
    began = time.perf_counter()
    sim.run(collisions_per_particle=max(PER_ROUND, 2.0 * LEAST / sim.scene.n))
    return time.perf_counter() - began


def warm_up(sim):
    """Compile all that a round runs, a new epoch included, touch the memory, and leave the lattice."""
    sim.run(collisions_per_particle=30)
    while sim._state.clock.epoch == 0:
        sim.run(collisions_per_particle=5)


class Measured(NamedTuple):
    """What came out of one scene."""

    executive: Executive
    ratios: list[float]
    """Wall time of one worker over that of several, in each round."""
    passed: float
    """Wall time of several [s]."""


@contextlib.contextmanager
def beside(busy):
    """Let so many other processes keep a core busy each."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def measure(scene, workers, rounds=ROUNDS, windows=True):
    """Run a scene with one worker and with several in turn, and compare the bits.

    With ``windows`` the several never leave the run to one of them, as they do where that is faster.
    """
    one, several = carom.Simulation(scene, seed=3), carom.Simulation(scene, seed=3)
    executive = Executive(several._state, workers, Settings(compare=not windows))
    several._state.executive = executive
    for sim in (one, several):
        warm_up(sim)
    executive.timings = Timings()
    ratios, passed = [], 0.0
    for _ in range(rounds):
        alone, together = wall(one), wall(several)
        passed += together
        ratios.append(alone / together)
        print(f"one {alone:.2f} s, {workers} {together:.2f} s, ratio {ratios[-1]:.2f}", file=sys.stderr)
    compare(one, several)
    several.close()
    return Measured(executive, ratios, passed)


def zone_of(machine, workers):
    """Return the part of the box that is in zones of borders, or None where there is no room for so many."""
    neighbors, scene = machine.engine.neighbors, machine.scene
    if workers > most_slabs(neighbors, scene.box):
        return None
    masks = slabs_of(neighbors, scene.box, scene.periodic, workers).masks
    return float(np.mean(np.bitwise_or.reduce(masks) & BORDERS != 0))


def table():
    """Print a row for each scene and size, for two workers, and the model."""
    print("| d | packing fraction | N | ratio, each round | " + " | ".join(COLUMNS) + " |")
    print("|---" * (4 + len(COLUMNS)) + "|")
    zones, costs = [], []
    for (dimension, packing_fraction), n in itertools.product(SCENES, SIZES):
        scene = scene_of(dimension, packing_fraction, n)
        measured = measure(scene, 2)
        print(row_of(scene, measured), flush=True)
        if scene.n >= FITTED:
            zones.append(zone_of(measured.executive._state, 2))
            costs.append(2.0 / statistics.median(measured.ratios))
    model(zones, costs)


def model(zones, costs):
    """Print what more workers would do, if all of them together cost what two did for the same zones.

    Parameters
    ----------
    zones, costs : lists of floats
        Part of the box in zones, and wall time of two workers times two over that of one.
    """
    slope, base = np.polyfit(zones, costs, 1)
    print(f"model: workers times wall time = {base:.2f} + {slope:.2f} zones")
    for (dimension, packing_fraction), n in itertools.product(SCENES, (1_000_000, 10_000_000)):
        small = carom.Simulation(scene_of(dimension, packing_fraction, 30_000), seed=3)._state
        edge = (n / small.scene.n) ** (1 / dimension)
        ratios = []
        for workers in (4, 16, 64):  # zones are as deep in a larger box
            zone = min(zone_of(small, 2) * workers / 2 / edge, 1.0)
            ratios.append(f"{workers} workers {workers / (base + slope * zone):.1f}" if zone < 1.0 else "-")
        print(f"model: d = {dimension}, {packing_fraction:.2f}, N = {n}: " + ", ".join(ratios))


def separate(dimension, packing_fraction, n):
    """Print the rate of two separate runs at once, over that of one of them alone."""
    scene = scene_of(int(dimension), packing_fraction, int(n))
    sims = [carom.Simulation(scene, seed=seed) for seed in (3, 4)]
    for sim in sims:
        warm_up(sim)
    with ThreadPoolExecutor(2) as pool:
        for _ in range(ROUNDS):
            alone, began = wall(sims[0]), time.perf_counter()
            list(pool.map(wall, sims))
            both = time.perf_counter() - began
            print(f"one {alone:.2f} s, two at once {both:.2f} s, ratio {2.0 * alone / both:.2f}", flush=True)


COLUMNS = ("running", "state kept", "adding up", "new epochs", "run again", "one worker")


def row_of(scene, measured):
    """Return the row of a scene: ratios, and parts of the wall time of several workers."""
    timings, passed = measured.executive.timings, measured.passed
    parts = (
        timings.run,
        timings.save_state,
        timings.merge,
        timings.epochs,
        timings.rolled_back,
        passed - timings.wall,
    )
    cells = [f"{scene.dimension}", f"{scene.packing_fraction:.2f}", f"{scene.n}"]
    cells += [", ".join(f"{ratio:.2f}" for ratio in measured.ratios)]
    return "| " + " | ".join(cells + [f"{part / passed:.3f}" for part in parts]) + " |"


def main():
    """Print the table, or one row of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("words", nargs="*", metavar="table | [separate] d packing_fraction n workers rounds")
    parser.add_argument("--busy", type=int, default=0, help="other processes that keep a core busy each")
    parser.add_argument("--windows", action="store_true", help="several workers also where one is faster")
    given = parser.parse_args()
    with beside(given.busy):
        if given.words == ["table"]:
            table()
        elif given.words[:1] == ["separate"]:
            separate(*map(float, given.words[1:]))
        else:
            one_row([float(word) for word in given.words], given.windows)


def one_row(given, windows):
    """Print the row of a scene, given by numbers, and what became of its windows."""
    defaults = [3, 0.30, 1_000_000, 2, ROUNDS]
    dimension, packing_fraction, n, workers, rounds = (given + defaults[len(given) :])[:5]
    scene = scene_of(int(dimension), packing_fraction, int(n))
    measured = measure(scene, int(workers), int(rounds), windows)
    timings = measured.executive.timings
    print(row_of(scene, measured))
    print(f"median of {len(measured.ratios)} rounds: {statistics.median(measured.ratios):.2f}")
    print(f"{timings.windows} windows, {timings.repeats} run again; {measured.executive.workers} slabs")


if __name__ == "__main__":
    main()
