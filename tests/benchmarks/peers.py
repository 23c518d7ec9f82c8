"""The rate of Carom over those of other event-driven programs, in turn, from the same states.

    python tests/benchmarks/peers.py --edmd EDMD                   # a checkout of FSmallenburg/EDMD of GitHub
    python tests/benchmarks/peers.py --edmd EDMD --dynamo BUILD    # and square wells: where dynarun is
    python tests/benchmarks/peers.py                               # tables of what is stored, and no run
    python tests/benchmarks/peers.py --picture docs/images/rates.png

Results go to ``results/peers.json``, one entry a scene. README.md gets its table from there. EDMD has three
programs; all are built in a temporary folder, with its own flags and others, two of them with several shells
of their lists, and the fastest of each scene counts. Three lines are changed: how long a run takes, no
thermostat (one of the three has it on), and CPU time is printed beside the number of collisions. It has no
disks: spheres in a plane that do not leave it are disks. In each turn both start again, in processes of their
own. Rates are of CPU time, without set-up.
"""

import argparse
import datetime
import itertools
import json
import multiprocessing
import re
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pages import ROOT, processor, write_table

import carom
from carom.models import SquareWell

STORED = Path(__file__).parent / "results" / "peers.json"
PAGE = ROOT / "README.md"

SIZES = (4000, 32_000)
FREEZING = 0.545
"""Packing fraction of the melting crystal: a start below is a compressed fluid, above an fcc crystal."""

MELT = 100.0
"""Collisions a particle before both start."""

SETTLE = 2.0
"""Collisions a particle of Carom that are not timed, in each turn."""

KT, WELL = 2.0, 1.5
"""Temperature [depth] and width [diameter] of square wells."""

PLANE = 6.0
"""Edge of a box of disks across their plane [diameter]: room for the three cells that EDMD needs."""


class State(NamedTuple):
    """What both programs run."""

    scene: str
    """"spheres", "disks", "binary" or "square wells"."""
    packing_fraction: float
    n: int


def states(sizes: tuple[int, ...], scenes: tuple[str, ...]) -> list[State]:
    """Return what is compared with EDMD."""
    kinds = [("spheres", eta) for eta in (0.05, 0.30, 0.49, 0.55, 0.60)]
    kinds += [("disks", 0.30), ("disks", 0.70), ("binary", 0.30), ("binary", 0.49)]
    return [State(*kind, n) for kind, n in itertools.product(kinds, sizes) if kind[0] in scenes]


def melted(state: State) -> carom.Scene:
    """Return a fluid, or a crystal where that is stable, that has been run for a while.

    The binary mixture has as many spheres of diameter 1 as of 1 / 1.4, all of mass 1, as EDMD gives to all.
    """
    eta, n = state.packing_fraction, state.n
    if state.scene == "binary":
        species = [carom.Species(fraction=0.5), carom.Species(fraction=0.5, diameter=1.0 / 1.4)]
        scene = carom.Scene.random(n, packing_fraction=eta, species=species, seed=1)
    elif state.scene == "disks":
        scene = carom.Scene.random(n, packing_fraction=eta, dimension=2, seed=1)
    elif eta < FREEZING:
        scene = carom.Scene.random(n, packing_fraction=eta, seed=1)
    else:
        scene = carom.Scene.crystal(n, packing_fraction=eta)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=MELT)
    frame = sim.frame()
    return scene.replace(positions=frame.positions, velocities=frame.velocities)


def timed(scene: carom.Scene, seconds: float) -> float:
    """Return Carom's collisions per CPU second, from the start anew."""
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=SETTLE)
    count, began = 0, time.process_time()
    while time.process_time() - began < seconds:
        count += sim.run(collisions=1_000_000).collisions
    return count / (time.process_time() - began)


def carom_rate(scene: carom.Scene, seconds: float) -> float:
    """Return Carom's collisions per CPU second in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as fresh:
        return fresh.submit(timed, scene, seconds).result()


# EDMD ---------------------------------------------------------------------------------------------------

CHANGES = (
    (r"maxtime = \d+;", "maxtime = 1e9;"),
    (r"usethermostat = \d;", "usethermostat = 0;"),
    (r'printf\("Simtime: %lf,', 'setlinebuf(stdout), printf("CPU: %lf,'),
    (r"simtime, colcounter,", "(double)clock() / CLOCKS_PER_SEC, colcounter,"),
    (r"\A", "#include <time.h>\n"),
)
IN_A_PLANE = ((r"p->vz = imsq \* random_gaussian\(\);", "p->vz = 0;"),)

FLAGS = ("-Ofast -funroll-loops -march=native", "-O3 -march=native")
"""Flags of the compiler; the first are EDMD's own."""

SHELLS = (1.4, 1.5, 1.6, 1.7)
"""Reaches of the lists of Single and Multi [largest diameter]; theirs is 1.5."""


class Build(NamedTuple):
    """One of EDMD's programs, as it is built."""

    name: str  # "Cell", "Multi" or "Single"
    flags: str
    shell: float | None  # None where there is none

    def __str__(self) -> str:
        return f"EDMD, {self.name}"


BUILDS = [Build("Cell", flags, None) for flags in FLAGS]
BUILDS += [Build(*each) for each in itertools.product(("Multi", "Single"), FLAGS, SHELLS)]


def build(checkout: Path, what: Build, folder: Path, disks: bool) -> Path:
    """Return one of EDMD's programs, built in a folder."""
    name, flags, shell = what
    shutil.copytree(checkout / name, folder, dirs_exist_ok=True)
    source = folder / f"md{name}.c"
    text = source.read_text()
    reach = () if shell is None else ((r"shellsize = [\d.]+;", f"shellsize = {shell};"),)
    for before, after in (*CHANGES, *reach, *(IN_A_PLANE if disks else ())):
        text, count = re.subn(before, after.replace("\\", "\\\\"), text, count=1)
        if count == 0:
            raise SystemExit(f"{checkout / name / source.name} has no {before!r}: it is another version.")
    source.write_text(text)
    (folder / "md").unlink(missing_ok=True)
    subprocess.run(["make", f"CFLAGS={flags}"], cwd=folder, check=True, capture_output=True)
    return folder / "md"


def write_sph(scene: carom.Scene, path: Path) -> None:
    """Write a scene as EDMD's input: number, box, then type, position and radius of each."""
    box, x = list(scene.box), scene.positions
    if scene.dimension == 2:
        box, x = [*box, PLANE], np.column_stack([x, np.full(scene.n, 0.5 * PLANE)])
    diameters = np.broadcast_to(scene.diameters, scene.n)
    with path.open("w") as file:
        print(scene.n, file=file)
        print(*(f"{edge:.17g}" for edge in box), file=file)
        for position, diameter in zip(x, diameters, strict=True):
            kind = "a" if diameter == diameters.max() else "b"
            print(kind, *(f"{c:.17g}" for c in position), f"{diameter / 2:.17g}", file=file)


def edmd_rate(program: Path, start: Path, seconds: float) -> float:
    """Return the collisions per CPU second of one of EDMD's programs, from the first unit of time on; 0 where
    it ends before, as dense spheres with a wide shell do.
    """
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(start, Path(folder) / "init.sph")
        run = subprocess.Popen([program], cwd=folder, stdout=subprocess.PIPE, text=True)
        try:
            first = None
            assert run.stdout is not None
            for line in run.stdout:
                found = re.match(r"CPU: ([\d.]+), Collisions: (\d+)", line)
                cpu, count = (float(found[1]), int(found[2])) if found else (0.0, 0)
                if count > 0 and first is None:
                    first = cpu, count
                elif first is not None and cpu - first[0] >= seconds:
                    return (count - first[1]) / (cpu - first[0])
        finally:
            run.kill()
            run.communicate()
    return 0.0


def beside_edmd(checkout: Path, given: argparse.Namespace, folder: Path) -> Iterator[dict]:
    """Yield a row for each state: the fastest program of EDMD, and Carom in turn with it."""
    for state in states(tuple(given.sizes), tuple(given.scenes)):
        scene = melted(state)
        start = folder / "start.sph"
        write_sph(scene, start)
        programs = {}
        for number, each in enumerate(BUILDS):
            where = folder / f"{number}-{scene.dimension}"
            done = (where / "md").exists()
            programs[each] = where / "md" if done else build(checkout, each, where, scene.dimension == 2)
        fastest = max(programs, key=lambda each: edmd_rate(programs[each], start, given.seconds))
        print(fastest, flush=True)
        pairs = [
            (carom_rate(scene, given.seconds), edmd_rate(programs[fastest], start, given.seconds))
            for _ in range(given.turns)
        ]
        if all(theirs > 0.0 for _, theirs in pairs):
            yield row(state, str(fastest), pairs)


# DynamO -------------------------------------------------------------------------------------------------


def seconds_of(*command: object) -> float:
    """Run a program; return the CPU time that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def beside_dynamo(programs: Path, given: argparse.Namespace, folder: Path) -> Iterator[dict]:
    """Yield a row for each density of 4000 square wells, all events counted.

    DynamO's CPU time is that of a long run less that of a short one, so that its files do not count.
    """
    events = 100_000
    mod, run = programs / "dynamod", programs / "dynarun"
    for density in (0.3, 0.5):
        state = folder / f"{density}.xml"
        seconds_of(mod, "-m", 1, "-C", 10, "-d", density, "--f1", WELL, "-r", KT, "-o", state)
        for _ in range(2):
            seconds_of(run, "-E", "-c", 2 * events, "-o", state, state)
            seconds_of(mod, "-r", KT, "-o", state, state)
        seconds_of(run, "-E", "-c", events, "-o", state, state)
        scene = carom.Scene.crystal(4000, density=density).replace(interaction=SquareWell(WELL, 1.0))
        sim = carom.Simulation(scene, kT=KT, seed=1)
        for _ in range(2):
            sim.run(collisions=2 * events)
            sim.rescale(KT)
        sim.run(collisions=events)
        frame, pairs = sim.frame(), []
        scene = scene.replace(positions=frame.positions, velocities=frame.velocities)
        for _ in range(given.turns):
            out = ("-E", "-o", folder / "out.xml", "--out-data-file", folder / "data.xml", state)
            long, short = (seconds_of(run, "-c", count, *out) for count in (events + 1000, 1000))
            pairs.append((carom_rate(scene, given.seconds), events / (long - short)))
        yield row(State("square wells", scene.packing_fraction, scene.n), "DynamO", pairs)


# Results ------------------------------------------------------------------------------------------------


def row(state: State, program: str, pairs: list[tuple[float, float]]) -> dict:
    """Return what is stored of a state: medians of the turns [10^6 collisions / CPU s], and ratios."""
    ratios = [ours / theirs for ours, theirs in pairs]
    ours, theirs = (statistics.median(column) / 1e6 for column in zip(*pairs, strict=True))
    figures = {
        "carom": ours, "peer": theirs,
        "ratio": statistics.median(ratios), "lowest": min(ratios), "highest": max(ratios),
    }  # fmt: skip
    found = {
        **state._asdict(), "program": program, "turns": len(pairs),
        **{name: round(figure, 3) for name, figure in figures.items()},
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(), "processor": processor(),
    }  # fmt: skip
    print(json.dumps(found), flush=True)
    return found


def key(found: dict) -> tuple:
    """Return what a row is about, in the order of the table."""
    order = ("spheres", "disks", "binary", "square wells")
    return order.index(found["scene"]), found["packing_fraction"], found["n"]


def table(rows: list[dict]) -> str:
    """Return Carom's rate over that of the other program, as Markdown."""
    sizes = sorted({found["n"] for found in rows})
    cells = {key(found): "{ratio:.2f} ({lowest:.2f} to {highest:.2f})".format(**found) for found in rows}
    lines = ["| scene | packing fraction | " + " | ".join(f"N = {n}" for n in sizes) + " |"]
    lines.append("|---" * (2 + len(sizes)) + "|")
    for scene, eta in dict.fromkeys(
        (found["scene"], found["packing_fraction"]) for found in sorted(rows, key=key)
    ):
        at = [key({"scene": scene, "packing_fraction": eta, "n": n}) for n in sizes]
        lines.append(f"| {scene} | {eta:.2f} | " + " | ".join(cells.get(place, "") for place in at) + " |")
    when = {
        (found["date"], found["processor"] or "processor not noted", found.get("remark", ""))
        for found in rows
    }
    measured = "; ".join(
        f"{date}, {kind}" + (f" ({remark})" if remark else "") for date, kind, remark in sorted(when)
    )
    return "\n".join([*lines, "", f"Measured: {measured}."])


def draw(rows: list[dict], picture: Path) -> None:
    """Draw the rates of both for spheres against the packing fraction, a color for each number of them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter

    spheres = sorted((found for found in rows if found["scene"] == "spheres" and "carom" in found), key=key)
    if not spheres:
        raise SystemExit("No rates are stored, only ratios: run with --edmd.")
    figure, axes = plt.subplots(figsize=(7.0, 4.5), layout="constrained")
    for color, n in enumerate(sorted({found["n"] for found in spheres})):
        mine = [found for found in spheres if found["n"] == n]
        for name, line, mark in (("carom", "-", "o"), ("peer", "--", "s")):
            etas, rates = ([found[what] for found in mine] for what in ("packing_fraction", name))
            axes.plot(etas, rates, line + mark, color=f"C{color}", label=f"{name}, N = {n}")
    axes.set(
        xlabel="packing fraction",
        ylabel="million pair collisions per CPU second",
        yscale="log",
        title="Hard spheres: Carom and the fastest of the peer's programs, in turn",
    )
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    figure.legend(loc="outside lower center", ncols=3, fontsize="small")
    axes.grid(which="both", alpha=0.3)
    figure.savefig(picture, dpi=150)


def main() -> None:
    """Compare, store the results, and write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--edmd", type=Path, help="checkout of EDMD; a C compiler and make build it")
    parser.add_argument("--dynamo", type=Path, help="folder of dynamod and dynarun")
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, help="numbers of particles")
    parser.add_argument("--scenes", nargs="+", default=("spheres", "disks", "binary"))
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=3.0, help="CPU time of each program in a turn")
    parser.add_argument("--results", type=Path, default=STORED)
    parser.add_argument("--picture", type=Path, help="draw the rates of spheres")
    given = parser.parse_args()
    rows = {key(found): found for found in json.loads(given.results.read_text())}
    with tempfile.TemporaryDirectory() as folder:
        for compare, where in ((beside_edmd, given.edmd), (beside_dynamo, given.dynamo)):
            for each in compare(where.resolve(), given, Path(folder)) if where is not None else ():
                rows[key(each)] = each
                lines = ",\n".join(json.dumps(rows[place]) for place in sorted(rows))
                given.results.write_text(f"[\n{lines}\n]\n")
    found = [rows[place] for place in sorted(rows)]
    print(table(found))
    if given.results.resolve() == STORED:
        write_table(PAGE, "peers", table(found))
    if given.picture is not None:
        draw(found, given.picture)


if __name__ == "__main__":
    main()
