"""One worker against several, in turn in one run: wall time, and where the time of several goes.

    python tests/benchmarks/workers.py                       # a million spheres at 0.30, two workers
    python tests/benchmarks/workers.py 2 0.70 600000 2        # dimension, packing fraction, n, workers
    python tests/benchmarks/workers.py 2 0.70 600000 2 12     # in twelve rounds, and their median
    python tests/benchmarks/workers.py 2 0.70 600000 1        # windows of a single part, which has no borders
    python tests/benchmarks/workers.py table                  # two workers, from ten thousand to a million
    python tests/benchmarks/workers.py scaling 2 0.70 1e6     # 2, 4, 8, ... workers: a row
    python tests/benchmarks/workers.py separate 2 0.70 1e6    # two runs that share nothing but the machine
    python tests/benchmarks/workers.py separate 2 0.70 1e6 16 # sixteen
    python tests/benchmarks/workers.py 3 0.49 256000 2 6 --busy 1    # beside a process that keeps a core busy

With ``--windows`` several workers go on also where one is faster, as in the table. Both runs must come out
with the same bits. "One worker" is what happens outside of windows: the last collisions before a given
number, and stretches in which one is faster.
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

from soak import compare

import carom
from carom.engine.domains.decomposition import most_slabs
from carom.processors import cores
from carom.simulation.workers.executive import Executive, Settings, Timings

ROUNDS = 3
PER_ROUND, LEAST = 24.0, 3_000_000
"""Collisions for each particle in a round, and in all at least."""

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


def several_of(scene, workers, windows=True):
    """Return a run with several workers; with ``windows`` they go on also where one is faster."""
    sim = carom.Simulation(scene, seed=3)
    sim._state.executive = Executive(sim._state, workers, Settings(compare=not windows))
    return sim


def measure(scene, workers, rounds=ROUNDS, windows=True):
    """Run a scene with one worker and with several in turn, and compare the bits."""
    one, several = carom.Simulation(scene, seed=3), several_of(scene, workers, windows)
    executive = several._state.executive
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


def table():
    """Print a row for each scene and size, for two workers."""
    print("| d | packing fraction | N | ratio, each round | " + " | ".join(COLUMNS) + " |")
    print("|---" * (4 + len(COLUMNS)) + "|")
    for (dimension, packing_fraction), n in itertools.product(SCENES, SIZES):
        scene = scene_of(dimension, packing_fraction, n)
        print(row_of(scene, measure(scene, 2)), flush=True)


def scaling(dimension, packing_fraction, n, rounds=ROUNDS):
    """Print a row: the ratios of 2, 4, 8, ... workers to one, all in turn, as far as cores and slabs go."""
    scene = scene_of(int(dimension), packing_fraction, int(n))
    one = carom.Simulation(scene, seed=3)
    most = min(cores(), most_slabs(one._state.engine.neighbors, scene.box))
    counts = [2**k for k in range(1, most.bit_length())]
    sims = [one] + [several_of(scene, count) for count in counts]
    with ThreadPoolExecutor(len(sims)) as pool:
        list(pool.map(warm_up, sims))
    ratios = []
    for _ in range(int(rounds)):
        alone, *together = [wall(sim) for sim in sims]
        ratios.append([alone / passed for passed in together])
        print(f"one {alone:.2f} s, ratios {ratios[-1]}", file=sys.stderr)
    for sim in sims[1:]:
        compare(one, sim)
        sim.close()
    cells = [f"{scene.dimension}", f"{packing_fraction:.2f}", f"{scene.n}"]
    cells += [", ".join(f"{ratio:.2f}" for ratio in column) for column in zip(*ratios, strict=True)]
    print("| " + " | ".join(cells) + " |", flush=True)


def separate(dimension, packing_fraction, n, runs=2):
    """Print the rate of separate runs at once, over that of one of them alone."""
    scene, runs = scene_of(int(dimension), packing_fraction, int(n)), int(runs)
    sims = [carom.Simulation(scene, seed=3 + k) for k in range(runs)]
    warm_up(sims[0])
    with ThreadPoolExecutor(runs) as pool:
        list(pool.map(warm_up, sims[1:]))
        for _ in range(ROUNDS):
            alone, began = wall(sims[0]), time.perf_counter()
            list(pool.map(wall, sims))
            both = time.perf_counter() - began
            ratio = runs * alone / both
            print(f"one {alone:.2f} s, {runs} at once {both:.2f} s, ratio {ratio:.2f}", flush=True)


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
    parser.add_argument("words", nargs="*", metavar="table | [scaling | separate] d packing_fraction n ...")
    parser.add_argument("--busy", type=int, default=0, help="other processes that keep a core busy each")
    parser.add_argument("--windows", action="store_true", help="several workers also where one is faster")
    given = parser.parse_args()
    with beside(given.busy):
        if given.words == ["table"]:
            table()
        elif given.words[:1] in (["separate"], ["scaling"]):
            {"separate": separate, "scaling": scaling}[given.words[0]](*map(float, given.words[1:]))
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
