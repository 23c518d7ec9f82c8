"""Event rates of a square well compared with DynamO's, in turn: events a CPU second.

    python tests/benchmarks/beside_dynamo.py --folder BUILD      # where dynamod and dynarun are

4000 spheres, width 1.5, kT near 2 [depth]. Both programs count every core, entry, exit and bounce. DynamO's
CPU time is that of a long run less that of a short one, so that reading and writing its files do not count.
"""

import argparse
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import carom
from carom.models import SquareWell

KT = 2.0
EVENTS = 100_000


def seconds(*command: object) -> float:
    """Run a program; return the CPU time that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def melted(programs: Path, folder: Path, density: float) -> Path:
    """Return a configuration of DynamO's in equilibrium."""
    state = folder / f"{density}.xml"
    seconds(programs / "dynamod", "-m", 1, "-C", 10, "-d", density, "--f1", 1.5, "-r", KT, "-o", state)
    for _ in range(2):
        seconds(programs / "dynarun", "-E", "-c", 2 * EVENTS, "-o", state, state)
        seconds(programs / "dynamod", "-r", KT, "-o", state, state)
    seconds(programs / "dynarun", "-E", "-c", EVENTS, "-o", state, state)
    return state


def main() -> None:
    """Print a line for each density."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--folder", type=Path, required=True, help="where dynamod and dynarun are")
    parser.add_argument("--density", type=float, nargs="+", default=[0.3, 0.5])
    parser.add_argument("--turns", type=int, default=5)
    given = parser.parse_args()
    print("| density | kT | Carom [k/s] | DynamO [k/s] | ratio |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for density in given.density:
            state = melted(given.folder, folder, density)
            scene = carom.Scene.crystal(cells=10, density=density).replace(interaction=SquareWell(1.5, 1.0))
            sim = carom.Simulation(scene, kT=KT, seed=1)
            for _ in range(2):
                sim.run(collisions=2 * EVENTS)
                sim.rescale(KT)
            sim.run(collisions=EVENTS)
            rates = []
            for _ in range(given.turns):
                began = time.process_time()
                sim.run(collisions=EVENTS)
                ours = EVENTS / (time.process_time() - began)
                out = ("-E", "-o", folder / "out.xml", "--out-data-file", folder / "data.xml", state)
                long = seconds(given.folder / "dynarun", "-c", EVENTS + 1000, *out)
                short = seconds(given.folder / "dynarun", "-c", 1000, *out)
                rates.append((ours, EVENTS / (long - short)))
            ours, theirs = (statistics.median(column) for column in zip(*rates, strict=True))
            ratio = statistics.median(a / b for a, b in rates)
            print(
                f"| {density} | {sim.kT:.2f} | {ours / 1e3:.0f} | {theirs / 1e3:.0f} | {ratio:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
