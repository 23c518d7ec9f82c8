"""Carom beside another program, in turn, on the same start: the ratio of their rates.

The other program is one that reads ``init.sph`` in its working folder and prints lines with ``Simtime: T,
Collisions: N``, as the codes of Smallenburg (EPJE 45, 22 (2022)) do. Rates are pair collisions per second of
CPU time; only the ratio within one call means anything.

    python tests/benchmarks/peer.py PATH/TO/md --packing-fraction 0.49 --cells 10 --repeats 5
"""

import argparse
import re
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

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


def carom_rate(sim: carom.Simulation, collisions: int) -> float:
    """Return Carom's pair collisions per CPU second."""
    began = time.process_time()
    block = sim.run(collisions=collisions)
    return block.collisions / (time.process_time() - began)


def main() -> None:
    """Compare, in turn."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=Path)
    parser.add_argument("--packing-fraction", type=float, default=0.49)
    parser.add_argument("--cells", type=int, default=10, help="fcc cells along an edge; n = 4 cells^3")
    parser.add_argument("--melt", type=float, default=100.0, help="collisions per particle before both start")
    parser.add_argument("--collisions", type=float, default=2e6, help="of Carom, in each turn")
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()

    scene = carom.Scene.fcc(cells=given.cells, packing_fraction=given.packing_fraction)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=given.melt)
    with tempfile.TemporaryDirectory() as folder:
        start = Path(folder) / "start.sph"
        write_sph(sim.frame(), start)
        ratios = []
        for _ in range(given.repeats):
            theirs = peer_rate(given.program, start)
            ours = carom_rate(sim, int(given.collisions))
            ratios.append(ours / theirs)
            print(f"carom {ours / 1e6:.3f}  peer {theirs / 1e6:.3f} M/s  ratio {ratios[-1]:.2f}")
    print(
        f"n = {scene.n}, packing fraction {given.packing_fraction}: ratio {statistics.median(ratios):.2f} "
        f"(median of {given.repeats}; {min(ratios):.2f} to {max(ratios):.2f})"
    )


if __name__ == "__main__":
    main()
