"""What a run spends its time on: the share of each phase, and bytes written.

python tests/benchmarks/around.py                            # 10^2 to 10^5 spheres, 100 collisions each
python tests/benchmarks/around.py --n 108000 --collisions-per-particle 100
python tests/benchmarks/around.py --snapshot                 # CPU seconds of a picture
python tests/benchmarks/around.py --n 100 1000 --collisions-per-particle 10000 --cpu    # the default length
"""

import argparse
import tempfile
import time
from pathlib import Path

import carom
from carom import studies
from carom.plan.plan import Plan, RunSpec, SceneSpec

ENGINE = ("Equilibrating", "Measuring")


def phases(n, packing_fraction, collisions, folder, clock):
    """Run a plan of default settings; return the seconds of each stage by a clock."""
    cells = max(round((n / 4) ** (1 / 3)), 1)
    plan = Plan(
        scene=SceneSpec(cells=cells, packing_fraction=packing_fraction),
        run=RunSpec(equilibration=0.2 * collisions, collisions_per_particle=collisions),
    )
    seconds, now = {}, ["Preparing", clock()]

    def watch(stage, fraction):
        then = clock()
        seconds[now[0]] = seconds.get(now[0], 0.0) + then - now[1]
        now[:] = [stage, then]

    result = studies.run(plan, folder, progress=watch)
    return result.summary["n"], result.summary["frames"], seconds


def snapshots(n):
    """Print the CPU seconds of five pictures of n spheres, the first one with the import of matplotlib."""
    from carom.pictures import plots

    cells = max(round((n / 4) ** (1 / 3)), 1)
    frame = carom.Simulation(carom.Scene.fcc(cells, packing_fraction=0.45), seed=1).frame()
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(5):
            began = time.process_time()
            plots.snapshot(frame, path=Path(folder) / "snapshot.png")
            print(f"{frame.n}: {time.process_time() - began:.2f} CPU s", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--n", type=int, nargs="+", default=[100, 1000, 10_000, 100_000])
    parser.add_argument("--packing-fraction", type=float, default=0.45)
    parser.add_argument("--collisions-per-particle", type=float, default=100.0)
    parser.add_argument("--cpu", action="store_true", help="CPU time, for a machine that others use too")
    parser.add_argument("--snapshot", action="store_true", help="time pictures of 2048 and 10^5 alone")
    given = parser.parse_args()
    if given.snapshot:
        for n in (2048, 100_000):
            snapshots(n)
        return
    clock = time.process_time if given.cpu else time.perf_counter
    for n in given.n:
        with tempfile.TemporaryDirectory() as folder:
            where = Path(folder) / "run"
            n, frames, seconds = phases(
                n, given.packing_fraction, given.collisions_per_particle, where, clock
            )
            size = sum(path.stat().st_size for path in where.iterdir()) / 1e6
        # Writing frames and checkpoints is in the stage that they interrupt.
        whole = sum(seconds.values())
        shares = ", ".join(f"{name} {100 * part / whole:.0f} %" for name, part in seconds.items())
        around = whole - sum(seconds.get(name, 0.0) for name in ENGINE)
        print(f"{n}: {whole:.1f} s, {around / whole:.2f} around the engine ({shares})")
        print(f"    {frames} frames, {size:.0f} MB")


if __name__ == "__main__":
    main()
