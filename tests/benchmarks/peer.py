"""Carom beside another program, in turn, on the same start: the ratio of their rates.

The other program is one that reads ``init.sph`` in its working folder and prints lines with ``Simtime: T,
Collisions: N``, as the codes of Smallenburg (EPJE 45, 22 (2022)) do. Rates are pair collisions per second of
CPU time; only the ratio within one call means anything.

    python tests/benchmarks/peer.py PATH/TO/md --packing-fraction 0.49 --cells 10 --repeats 5 --csv rates.csv
    python tests/benchmarks/peer.py --picture rates.png --csv rates.csv
"""

import argparse
import csv
import re
import resource
import statistics
import subprocess
import tempfile
from pathlib import Path

from rates import rate

import carom


def write_sph(frame: carom.Frame, path: Path) -> None:
    """Write a frame as the other program's input: number, box, then type, position and radius of each."""
    with path.open("w") as file:
        print(frame.n, file=file)
        print(*(f"{edge:.17g}" for edge in frame.box), file=file)
        for position, diameter in zip(frame.positions, frame.diameters, strict=True):
            print("a", *(f"{x:.17g}" for x in position), f"{diameter / 2:.17g}", file=file)


def peer_rate(program: Path, start: Path) -> float:
    """Return the other program's pair collisions per CPU second."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "init.sph").write_bytes(start.read_bytes())
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run = subprocess.run([program.resolve()], cwd=folder, capture_output=True, text=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    counts = re.findall(r"Collisions:? (\d+)", run.stdout)
    if not counts:
        raise SystemExit(f"{program} printed no line with 'Collisions: N'.")
    return int(counts[-1]) / (after.ru_utime - before.ru_utime)


FREEZING = 0.545
"""Packing fraction of the melting crystal: a start below is a compressed fluid, above an fcc crystal."""


def melted(packing_fraction: float, cells: int, collisions: float) -> carom.Simulation:
    """Return a simulation of a fluid, or of a crystal where that is stable, run for a while."""
    if packing_fraction < FREEZING:
        scene = carom.Scene.random(n=4 * cells**3, packing_fraction=packing_fraction, seed=1)
    else:
        scene = carom.Scene.crystal(cells=cells, packing_fraction=packing_fraction)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=collisions)
    return sim


COLUMNS = ("packing_fraction", "n", "program", "carom", "peer", "ratio", "lowest", "highest", "pairs")


def keep(path: Path, row: tuple) -> None:
    """Append a row to a table."""
    began = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if began:
            writer.writerow(COLUMNS)
        writer.writerow(row)


def draw(table: Path, picture: Path) -> None:
    """Draw the rates of both against the packing fraction, a colour for each number of particles; of several
    programs at one entry, the fastest.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter

    best: dict[tuple[int, float], dict] = {}
    with table.open(newline="") as file:
        for row in csv.DictReader(file):
            key = int(row["n"]), float(row["packing_fraction"])
            if key not in best or float(row["ratio"]) < float(best[key]["ratio"]):
                best[key] = row
    figure, axes = plt.subplots(figsize=(7.0, 4.5), layout="constrained")
    for color, n in enumerate(sorted({n for n, _ in best})):
        points = sorted((eta, row) for (number, eta), row in best.items() if number == n)
        etas = [eta for eta, _ in points]
        for name, line, mark in (("carom", "-", "o"), ("peer", "--", "s")):
            rates = [float(row[name]) for _, row in points]
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
    """Compare, in turn; or draw what was found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=Path, nargs="?")
    parser.add_argument("--packing-fraction", type=float, default=0.49)
    parser.add_argument("--cells", type=int, default=10, help="n = 4 cells^3")
    parser.add_argument("--melt", type=float, default=100.0, help="collisions per particle before both start")
    parser.add_argument("--collisions", type=float, default=2e6, help="of Carom, in each turn")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--csv", type=Path, help="table to which the result is appended")
    parser.add_argument("--picture", type=Path, help="draw the table, and run nothing")
    given = parser.parse_args()
    if given.picture is not None:
        if given.csv is None:
            parser.error("--picture needs --csv, the table to draw.")
        draw(given.csv, given.picture)
        return
    if given.program is None:
        parser.error("Name the other program, or --picture.")

    sim = melted(given.packing_fraction, given.cells, given.melt)
    ours, theirs = [], []
    with tempfile.TemporaryDirectory() as folder:
        start = Path(folder) / "start.sph"
        write_sph(sim.frame(), start)
        for _ in range(given.repeats):
            theirs.append(peer_rate(given.program, start) / 1e6)
            ours.append(rate(sim, int(given.collisions)))
            print(f"carom {ours[-1]:.3f}  peer {theirs[-1]:.3f} M/s  ratio {ours[-1] / theirs[-1]:.2f}")
    ratios = [mine / other for mine, other in zip(ours, theirs, strict=True)]
    middle = statistics.median
    print(
        f"n = {sim.scene.n}, packing fraction {given.packing_fraction}: ratio {middle(ratios):.2f} "
        f"(median of {given.repeats}; {min(ratios):.2f} to {max(ratios):.2f})"
    )
    if given.csv is not None:
        figures = [
            f"{x:.3f}" for x in (middle(ours), middle(theirs), middle(ratios), min(ratios), max(ratios))
        ]
        row = (given.packing_fraction, sim.scene.n, given.program.name, *figures, given.repeats)
        keep(given.csv, row)


if __name__ == "__main__":
    main()
