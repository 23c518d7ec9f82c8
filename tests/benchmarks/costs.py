"""What things cost: tables of rate, memory and compilation.

    python tests/benchmarks/costs.py size       rate and bytes a particle against N
    python tests/benchmarks/costs.py million    a million spheres and 4000 in turn
    python tests/benchmarks/costs.py features   rate, bytes a particle and compilation of each feature
    python tests/benchmarks/costs.py start      from nothing to the first event, compiled and from the cache
    python tests/benchmarks/costs.py peak       peak memory of the command carom run, and of a million spheres
    python tests/benchmarks/costs.py sampling   rate against the interval between frames
    python tests/benchmarks/costs.py threads    two simulations on two cores against one
    python tests/benchmarks/costs.py mixtures   two sizes against one at the same packing fraction
    python tests/benchmarks/costs.py precision  single precision against double, at 4000 and a million
    python tests/benchmarks/costs.py thin       thin systems, with the scheme chosen and with sectors
    python tests/benchmarks/costs.py sphere     caps on great circles, of several numbers
    python tests/benchmarks/costs.py observables  what a frame costs each observable, in collisions
    python tests/benchmarks/costs.py counted    currents and free flights beside the plain scene, in turn
    python tests/benchmarks/costs.py volumes    what a move of the volume costs, and how far it goes
    python tests/benchmarks/costs.py tasks      what a task of a study takes beside its events

Rates are million pair collisions per second of CPU time; only ratios within one table mean anything.
"""

import argparse
import contextlib
import itertools
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.mixtures import mixture
from rates import rate, size_of

import carom
from carom.block import Block
from carom.models import ENTERED, Kind, Ranges, SquareWell, Steps, StepTable
from carom.models.contacts.restitution import Restitution
from carom.models.motions.gravity import Gravity
from carom.observables import BondOrder, DensityProfile, Dynamics, HelfandCurrents
from carom.simulation import run_loop
from carom.simulation.measuring import flying, stretches
from carom.simulation.run_state import RunState
from carom.studies.eos.measure import Point
from carom.studies.eos.spec import StudySpec
from carom.studies.scenes import scene_spec
from carom.studies.start import start as begin
from carom.studies.study import perform
from carom.theory import pieprzyk

BARE = carom.Tuning(images=False)


def size(given: argparse.Namespace) -> None:
    """Print the table against N, with the CPU hours of 10^4 collisions of every particle."""
    print(
        "| packing fraction | N | M/s | 10^4 each [h] | bytes a particle | set up [s] |\n" + 6 * "|---" + "|"
    )
    for eta in (0.05, 0.30, 0.49):
        for cells in (3, 6, 14, 30, 63):
            began = time.perf_counter()
            sim = carom.Simulation(carom.Scene.crystal(cells=cells, packing_fraction=eta), seed=1)
            seconds = time.perf_counter() - began
            n = sim.scene.n
            sim.run(collisions_per_particle=min(40.0, 4e6 / n))
            speed = rate(sim, max(200_000, n // 4), repeats=2)
            hours = 1e4 * n / 2 / speed / 1e6 / 3600  # a collision is one of two particles
            row = [eta, n, f"{speed:.2f}", f"{hours:.2g}", f"{size_of(sim):.0f}", f"{seconds:.1f}"]
            print("|", " | ".join(map(str, row)), "|", flush=True)


def thin(given: argparse.Namespace) -> None:
    """Print the rate of thin systems with the scheme that is chosen for them, and with sectors."""
    print("| d | N | packing fraction | scheme | M/s | with sectors |\n|---|---|---|---|---|---|", flush=True)
    for dimension, numbers in ((2, (100, 500, 2000)), (3, (100, 500, 2000, 10_000))):
        for eta in (1e-4, 1e-3, 1e-2):
            for n in numbers:
                scene = carom.Scene.random(n, eta, dimension, seed=1)
                sims = [
                    carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=wish))
                    for wish in ("auto", "sectors")
                ]
                for sim in sims:
                    sim.run(walltime=0.2)
                rates = np.median([[seconds_rate(sim, 0.2) for sim in sims] for _ in range(3)], axis=0)
                chosen = sims[0]._state.scheme
                shape = "everybody" if chosen.kind == "all" else " x ".join(map(str, chosen.shape))
                print(
                    f"| {dimension} | {n} | {eta:g} | {shape} | {rates[0]:.2g} | {rates[1]:.2g} |", flush=True
                )


def seconds_rate(sim: carom.Simulation, seconds: float) -> float:
    """Return million pair collisions a CPU second, over some seconds of wall time."""
    began = time.process_time()
    block = sim.run(walltime=seconds)
    return block.collisions / (time.process_time() - began) / 1e6


def million(given: argparse.Namespace) -> None:
    """Print the rate of a million spheres in parts of that of 4000, in turn."""
    print("| packing fraction | 4000 [M/s] | 1 000 188 [M/s] | ratio |\n|---|---|---|---|")
    for eta in (0.05, 0.30, 0.49):
        sims = [
            carom.Simulation(carom.Scene.crystal(cells=cells, packing_fraction=eta), seed=1)
            for cells in (10, 63)
        ]
        for sim, collisions in zip(sims, (200.0, 6.0), strict=True):
            sim.run(collisions_per_particle=collisions)
        rates = np.array([[rate(sim, 200_000) for sim in sims] for _ in range(21)])
        few, many = np.median(rates, axis=0)
        ratio = np.median(rates[:, 1] / rates[:, 0])
        print(f"| {eta} | {few:.2f} | {many:.2f} | {ratio:.2f} |", flush=True)


def precision(given: argparse.Namespace) -> None:
    """Print the rate in single precision over that in double, in turn, and bytes per particle."""
    print("| N | packing fraction | single / double | bytes, double | bytes, single |\n|---|---|---|---|---|")
    for cells, eta in itertools.product((10, 63), (0.05, 0.30, 0.49)):
        scene = carom.Scene.crystal(cells=cells, packing_fraction=eta)
        sims = [
            carom.Simulation(scene, seed=1, tuning=carom.Tuning(images=False, precision=kind))
            for kind in ("double", "single")
        ]
        for sim in sims:
            sim.run(collisions_per_particle=2.0)
        ratios = [rate(sims[1], 100_000) / rate(sims[0], 100_000) for _ in range(11)]
        double, single = (size_of(sim) for sim in sims)
        middle = np.median(ratios)
        print(f"| {scene.n} | {eta} | {middle:.2f} | {double:.0f} | {single:.0f} |", flush=True)


def scenes() -> dict[str, tuple[carom.Scene, dict]]:
    """Return the same fluid, and with one feature more each: a scene and the simulation's settings."""
    plain = carom.Scene.crystal(cells=10, packing_fraction=0.45)
    n = plain.n
    hair = np.full(n, 1.0)
    hair[0] -= 1e-9
    shrunk = plain.positions * 0.98 + 0.01 * plain.box[0]
    species = np.arange(n) % 2
    ball = carom.models.obstacles.Ball((0.0, 0.0, 0.0), 1e-3)
    return {
        "plain": (plain, {"tuning": BARE}),
        "image counts": (plain, {}),
        "single precision": (plain, {"tuning": carom.Tuning(images=False, precision="single")}),
        "a diameter and a mass for each particle": (
            plain.replace(diameter=hair),
            {"tuning": BARE},
        ),
        "species, contact matrix": (
            plain.replace(species=species, contact=np.full((2, 2), 1.0)),
            {"tuning": BARE},
        ),
        "restitution": (
            plain.replace(impact=Restitution(1.0 - 1e-9, elastic_below=1e-3)),
            {"tuning": BARE},
        ),
        "walls": (
            carom.Scene(shrunk, plain.box, diameter=0.98, walls=True),
            {"tuning": BARE},
        ),
        "a fixed ball": (
            carom.Scene(plain.positions + 0.25, plain.box, diameter=0.98, obstacles=(ball,)),
            {"tuning": BARE},
        ),
        "square well": (
            plain.replace(interaction=SquareWell(1.5, 1.0)),
            {"tuning": BARE},
        ),
        "a tenth pinned": (plain.replace(pinned=np.arange(0, n, 10)), {"tuning": BARE}),
        "sectors": (plain, {"tuning": carom.Tuning(images=False, neighbors="sectors")}),
        "gravity": (
            plain.replace(motion=Gravity((0.0, 0.0, -1e-9))),
            {"tuning": BARE},
        ),
        "growth": (plain.replace(diameter=0.99), {"tuning": BARE, "growth": 1e-9}),
        "event log": (plain, {"tuning": BARE, "event_log": True}),
        "currents of momentum and heat": (plain, {"tuning": BARE, "observers": [HelfandCurrents()]}),
    }


def wells(given: argparse.Namespace) -> None:
    """Print the rate of all events in a square well, in parts of that of hard spheres, in turn."""
    print("| density | kT | hard spheres [M/s] | square well [M/s] | ratio |\n|---|---|---|---|---|")
    for density in (0.3, 0.6, 0.8):
        plain = carom.Scene.crystal(cells=10, density=density)
        sims = [
            carom.Simulation(scene, kT=kT, seed=1)
            for scene, kT in ((plain, 1.0), (plain.replace(interaction=SquareWell(1.5, 1.0)), 1.5))
        ]
        for sim in sims:
            sim.run(collisions_per_particle=100.0)
        sims[1].rescale(1.5)
        sims[1].run(collisions_per_particle=20.0)
        rates = np.array([[rate(sim, 200_000) for sim in sims] for _ in range(9)])
        few, many = np.median(rates, axis=0)
        ratio = np.median(rates[:, 1] / rates[:, 0])
        print(f"| {density} | {sims[1].kT:.2f} | {few:.2f} | {many:.2f} | {ratio:.2f} |", flush=True)


def aim(unit, event) -> None:
    """A rule of average size: it looks at a counter, and turns to who has come."""
    if event.cause == ENTERED and unit.counts[0, 0] > 20:
        unit.target = event.other
        unit.velocity[0], unit.velocity[1] = -unit.velocity[1], unit.velocity[0]


def ranges(given: argparse.Namespace) -> None:
    """Print the rate of crossings where both units are asked a rule, in parts of that without, in turn."""
    rng = np.random.default_rng(1)
    n, edge = 4000, 40.0
    places, circle = rng.uniform(0.0, edge, (n, 2)), StepTable(Steps([1.0], [0.0]))
    plain = carom.Scene(places, edge, diameter=0.1, interaction=circle)
    sims, took = [], []
    for scene in (plain, plain.replace(interaction=Ranges([Kind("unit", [1.0])], aim))):
        began = time.process_time()
        sims.append(carom.Simulation(scene, kT=1.0, seed=1, tuning=carom.Tuning(images=False)))
        sims[-1].run(collisions=10)
        took.append(time.process_time() - began)
        sims[-1].run(collisions=20_000)
    rates = np.array([[rate(sim, 50_000) for sim in sims] for _ in range(9)])
    few, many = np.median(rates, axis=0)
    ratio = np.median(rates[:, 1] / rates[:, 0])
    print("| crossings [M/s] | with a rule [M/s] | ratio | bytes a unit | compiled in [CPU s] |")
    print("|---|---|---|---|---|")
    sizes = " and ".join(f"{size_of(sim):.0f}" for sim in sims)
    print(f"| {few:.2f} | {many:.2f} | {ratio:.2f} | {sizes} | {took[0]:.1f} and {took[1]:.1f} |")


def sphere(given: argparse.Namespace) -> None:
    """Print the table of caps on great circles that cover a fifth of the sphere."""
    from carom.studies.spherical_codes.compression import random_points, scene_of, tiling_diameter

    print("| n | thousand collisions / s | bytes a particle | compiled in [CPU s] |\n|---|---|---|---|")
    for n in (12, 24, 48, 96):
        wide = np.sqrt(0.2) * tiling_diameter(n, 3)
        points = random_points(n, 3, wide, np.random.default_rng(n))
        began = time.process_time()
        sim = carom.Simulation(scene_of(points, wide), seed=1, tuning=carom.Tuning(images=False))
        sim.run(collisions=10)
        compiled = time.process_time() - began
        speed = 1e3 * rate(sim, 20_000, 3)
        print(f"| {n} | {speed:.0f} | {size_of(sim):.0f} | {compiled:.1f} |", flush=True)


def features(given: argparse.Namespace) -> None:
    """Print the table of features; each is compiled in a process of its own."""
    if given.one is None:
        print("| scene | M/s | of plain | bytes a particle | compiled in [CPU s] |\n|---|---|---|---|---|")
        plain = 0.0
        for name in scenes():
            with tempfile.TemporaryDirectory() as cache:
                done = subprocess.run(
                    [sys.executable, __file__, "features", "--one", name],
                    env={**os.environ, "NUMBA_CACHE_DIR": cache},
                    capture_output=True,
                    text=True,
                    check=True,
                )
            speed, memory, compiled = map(float, done.stdout.split())
            plain = plain or speed
            print(
                f"| {name} | {speed:.2f} | {speed / plain:.2f} | {memory:.0f} | {compiled:.1f} |", flush=True
            )
        return
    scene, settings = scenes()[given.one]
    with tempfile.TemporaryDirectory() as folder:
        if settings.pop("event_log", False):
            settings["event_log"] = os.path.join(folder, "events.h5")
        began = time.process_time()
        sim = carom.Simulation(scene, seed=1, **settings)
        sim.run(collisions=10)
        compiled = time.process_time() - began
        sim.run(collisions_per_particle=40)
        print(rate(sim, 400_000, 3), size_of(sim), compiled)
        sim.close()


START = """
import time
began = time.process_time()
import carom
import carom.simulation.simulation
import carom.engine.cycle
imported = time.process_time()
scene = carom.Scene.crystal(2048, packing_fraction=0.45)
made = time.process_time()
carom.Simulation(scene, kT=1.0, seed=1).run(collisions=1)
done = time.process_time()
print(imported - began, made - imported, done - made)
"""


def start(given: argparse.Namespace) -> None:
    """Print the time to the first event."""
    print("| | imports | scene | first event | in all [CPU s] |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as cache:
        for name in ("nothing compiled", "from the cache"):
            done = subprocess.run(
                [sys.executable, "-c", START],
                env={**os.environ, "NUMBA_CACHE_DIR": cache},
                capture_output=True,
                text=True,
                check=True,
            )
            parts = [float(x) for x in done.stdout.split()]
            print(f"| {name} | {' | '.join(f'{part:.2f}' for part in [*parts, sum(parts)])} |")


PEAK = """
import atexit

@atexit.register
def tell():
    with open("/proc/self/status") as status:
        kilobytes = dict(line.split(":") for line in status)
    print(*(int(kilobytes[name].split()[0]) * 1024e-6 for name in ("VmHWM", "RssFile")))

"""
"""Prints the peak memory of a process, and what of it are pages of files: the used parts of libraries, which
all processes share [MB]. Linux alone, where ``ru_maxrss`` would begin at the peak of the parent."""


def peak(given: argparse.Namespace) -> None:
    """Print the peak memory of whole processes. Each runs twice: what is compiled is in the cache then."""
    rest = "scipy.special, scipy.spatial, matplotlib.figure, matplotlib.backends.backend_agg, typer.main"
    command = "from carom.cli import main; main()"
    spheres = (
        "import carom; scene = carom.Scene.crystal(cells={}, packing_fraction=0.49); "
        "carom.Simulation(scene).run(collisions=4000)"
    )
    print("| | peak [MB] | of it files of libraries [MB] |\n|---|---|---|")
    for name, code, words in (
        ("numpy, numba, h5py imported", "import numpy, numba, h5py", []),
        ("and scipy, matplotlib, typer", f"import numpy, numba, h5py, {rest}", []),
        ("carom run", command, ["run"]),
        ("carom run --no-pictures", command, ["run", "--no-pictures"]),
        ("256 spheres", spheres.format(4), []),
        ("1 000 188 spheres", spheres.format(63), []),
    ):
        for _ in range(2):
            with tempfile.TemporaryDirectory() as folder:
                out = ["--quiet", "--out", str(Path(folder, "out"))] if words else []
                done = subprocess.run(
                    [sys.executable, "-c", PEAK + code, *words, *out],
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
        whole, files = map(float, done.stdout.split()[-2:])
        print(f"| {name} | {whole:.0f} | {files:.0f} |", flush=True)


def melted(seed: int) -> carom.Simulation:
    """Return a simulation of 4000 spheres that has left the lattice."""
    sim = carom.Simulation(carom.Scene.crystal(cells=10, packing_fraction=0.49), seed=seed)
    sim.run(collisions_per_particle=40)
    return sim


def sampling(given: argparse.Namespace) -> None:
    """Print what frames cost."""
    print("| collisions a particle between frames | CPU time, of a run without frames |\n|---|---|")
    sim = melted(1)
    span = stretches.time_for(sim, 100 * sim.scene.n)

    def seconds(frames: int) -> float:
        began = time.process_time()
        if frames:
            for _ in sim.sample(every=span / frames, count=frames):
                pass
        else:
            sim.run(time=span)
        return time.process_time() - began

    for frames in (2, 20, 200, 2000):
        ratio = seconds(frames) / seconds(0)
        print(f"| {200 / frames:g} | {ratio:.3f} |", flush=True)


def observables(given: argparse.Namespace) -> None:
    """Print what a frame costs each observable, in collisions a particle of the plain run."""
    sim = melted(1)
    collision = 0.5e-6 * sim.scene.n / rate(sim, 200_000, 5)
    frames = list(sim.sample(every=stretches.time_for(sim, sim.scene.n), count=40))
    kinds = {
        "Dynamics()": lambda: Dynamics(),
        "Dynamics(shells=8)": lambda: Dynamics(shells=8),
        "DensityProfile()": lambda: DensityProfile(),
        "BondOrder(6)": lambda: BondOrder(6),
        "BondOrder(6, reach=1.5)": lambda: BondOrder(6, reach=1.5),
        "BondOrder(6, rmax=4.0)": lambda: BondOrder(6, rmax=4.0),
    }
    print("| observable | collisions a particle |\n|---|---|")
    for name, make in kinds.items():
        observable = make()
        for frame in frames[:20]:
            observable.add(frame)
        print(f"| {name} | {quickest(observable.update, frames[20:]) / collision:.2f} |", flush=True)
    carom.RDF(rmax=5.0).over(frames[:2])
    cost = quickest(lambda frame: carom.RDF(rmax=5.0).over([frame]), frames[20:])
    print(f"| RDF(rmax=5.0) | {cost / collision:.2f} |")


def quickest(update: Callable[[Any], object], frames: list[Any]) -> float:
    """Return the least CPU time [s] of an update with a frame."""
    seconds = []
    for frame in frames:
        began = time.process_time()
        update(frame)
        seconds.append(time.process_time() - began)
    return min(seconds)


def counted(given: argparse.Namespace) -> None:
    """Print the rate with currents and with free flights, of the plain scene's, in turn."""
    settings: dict[str, dict[str, Any]] = {
        "plain": {}, "currents": {"observers": [HelfandCurrents()]}, "free flights": {},
    }  # fmt: skip
    sims = {name: carom.Simulation(scenes()["plain"][0], seed=1, **more) for name, more in settings.items()}
    with flying.keeping(sims["free flights"]._state):
        for sim in sims.values():
            sim.run(collisions_per_particle=40)
        rates = np.array([[rate(sim, 200_000) for sim in sims.values()] for _ in range(9)])
        print("| | rate, of plain | bytes a particle |\n|---|---|---|")
        for name, parts, sim in zip(sims, (rates / rates[:, :1]).T, sims.values(), strict=True):
            spread = f"{parts.min():.2f} to {parts.max():.2f}"
            print(f"| {name} | {np.median(parts):.2f} ({spread}) | {size_of(sim):.0f} |")


def work(sim: carom.Simulation) -> None:
    """Run a simulation for some time."""
    sim.run(collisions=2_000_000)


def take_one(seed: int) -> None:
    """Give a worker process a simulation of its own."""
    globals()["own"] = melted(seed)


def work_alone(_: int) -> None:
    """Run the simulation that a worker process has."""
    work(globals()["own"])


def threads(given: argparse.Namespace) -> None:
    """Print the throughput of two simulations in two threads and, as what the machine has to give, in two
    processes that share nothing.
    """
    sims = [melted(seed) for seed in (1, 2)]
    ways = {"one": [], "threads": [], "processes": []}
    with ThreadPoolExecutor(2) as pool, contextlib.ExitStack() as stack:
        alone = [
            stack.enter_context(ProcessPoolExecutor(1, initializer=take_one, initargs=(seed,)))
            for seed in (1, 2)
        ]
        for worker in alone:
            worker.submit(work_alone, 0).result()
        for _ in range(9):
            for way, run in (
                ("one", lambda: work(sims[0])),
                ("threads", lambda: list(pool.map(work, sims))),
                ("processes", lambda: [f.result() for f in [w.submit(work_alone, 0) for w in alone]]),
            ):
                began = time.perf_counter()
                run()
                ways[way].append(time.perf_counter() - began)
    one, *two = (np.array(seconds) for seconds in ways.values())
    for way, seconds in zip(("threads", "processes"), two, strict=True):
        ratios = 2.0 * one / seconds
        print(
            f"two {way} do {np.median(ratios):.2f} times the work of one "
            f"({ratios.min():.2f} to {ratios.max():.2f})"
        )


def mixtures(given: argparse.Namespace) -> None:
    """Print the rate of equal numbers of two sizes, in parts of that of equal spheres."""
    ratios = (1.4, 2.0, 3.0)
    print(f"| packing fraction | {' | '.join(f'{ratio:g} : 1' for ratio in ratios)} |\n|---|---|---|---|")
    for eta in (0.05, 0.30, 0.45, 0.49):
        scenes = [carom.Scene.random(4000, packing_fraction=eta, seed=1)]
        for ratio in ratios:
            sizes = {"diameters": [1.0, 1.0 / ratio], "masses": [1.0, ratio**-3]}
            scenes.append(mixture([2000, 2000], packing_fraction=eta, seed=1, **sizes))
        sims = [carom.Simulation(scene, seed=1) for scene in scenes]
        for sim in sims:
            sim.run(collisions_per_particle=20)
        best = np.max([[rate(sim, 200_000) for sim in sims] for _ in range(7)], axis=0)
        print(f"| {eta} | {' | '.join(f'{part:.2f}' for part in best[1:] / best[0])} |", flush=True)


@contextlib.contextmanager
def engine_seconds() -> Iterator[list[float]]:
    """Add up what all simulations spend in their events."""
    spent, advance = [0.0], run_loop.advance

    def timed(machine: RunState, *rest: Any) -> Block:
        before = machine.seconds
        block = advance(machine, *rest)
        spent[0] += machine.seconds - before
        return block

    run_loop.advance = timed
    try:
        yield spent
    finally:
        run_loop.advance = advance


def beside(work: Callable[[], object]) -> float:
    """Return the processor time that a piece of work takes beside its events."""
    with engine_seconds() as events:
        began = time.process_time()
        work()
        return time.process_time() - began - events[0]


def tasks(given: argparse.Namespace) -> None:
    """Print what tasks take beside their events, of which they have hardly any: 4000 spheres."""
    print("| packing fraction | s a task | of it start | of it order parameter |\n|---|---|---|---|")
    for eta in (0.05, 0.30, 0.45, 0.475, 0.49):
        found = []
        for frames in (0, None):
            study = StudySpec((eta,), replicas=8, collisions_per_particle=1, equilibration=1, frames=frames)
            seconds = [beside(partial(perform, Point.measure, task)) for task in study.tasks()]
            found.append(np.median(seconds[1:]))  # the first one loads what is compiled
        scene = scene_spec(next(iter(study.tasks()))["scene"])
        placing = np.median([beside(partial(begin, scene, np.random.default_rng(k))) for k in range(7)])
        print(f"| {eta} | {found[1]:.3f} | {placing:.3f} | {found[1] - found[0]:.3f} |", flush=True)


def volumes(given: argparse.Namespace) -> None:
    """Print what a move of the volume costs, in collisions of each particle, and its mean square."""
    print("| N | step | collisions of each | mean square change of ln V |\n|---|---|---|---|", flush=True)
    eta, interval = 0.45, 0.05
    pressure = float(pieprzyk(eta)) * eta * 6.0 / math.pi
    for n in (32, 108, 256, 1000):
        scene = carom.Scene.random(n, eta, seed=1)
        plain = carom.Simulation(scene, seed=1)
        plain.run(collisions_per_particle=200)
        speed = rate(plain, 200 * n, repeats=3) * 1e6
        for step in (None, 0.7 / n):
            sim = carom.Simulation(scene, seed=1, barostat=carom.Barostat(pressure, interval, step))
            sim.run(time=200 * interval)
            sizes, costs = [sim.scene.volume], []
            for _ in range(400):
                began = time.process_time()
                block = sim.run(time=interval)
                costs.append(time.process_time() - began - block.collisions / speed)
                sizes.append(sim.scene.volume)
            each = 2.0 * float(np.median(costs)) * speed / n
            square = float(np.mean(np.diff(np.log(sizes)) ** 2))
            print(
                f"| {n} | {'drawn' if step is None else f'{step:.2g}'} | {each:.0f} | {square:.2g} |",
                flush=True,
            )


def main() -> None:
    """Print a table."""
    tables = {
        "size": size, "million": million, "thin": thin, "features": features, "start": start,
        "peak": peak,
        "sampling": sampling, "threads": threads, "mixtures": mixtures, "tasks": tasks,
        "precision": precision, "wells": wells, "ranges": ranges,
        "observables": observables, "counted": counted,
        "sphere": sphere, "volumes": volumes,
    }  # fmt: skip
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", choices=tables)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    given = parser.parse_args()
    tables[given.table](given)


if __name__ == "__main__":
    main()
