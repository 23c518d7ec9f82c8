"""What `carom run` spends its time on, from the start of its process to the end: the share of each part.

python tests/benchmarks/around.py                            # 10^2 to 10^5 spheres, 100 collisions each
python tests/benchmarks/around.py --n 100 1000 --collisions-per-particle 10000 --cpu    # the default length
python tests/benchmarks/around.py --n 100000 --scaled        # the default length, from 100 collisions each
python tests/benchmarks/around.py --snapshot                 # CPU seconds of a picture

Each size has a process of its own, as on the command line; the kernels are compiled before. In a longer run
the engine takes longer, and there are more checkpoints: one in ten seconds, or fewer if they take more than a
tenth of the time. All else, frames too, is as much whatever the length. So --scaled multiplies the time of
the engine, and adds as many checkpoints as there are in that time.
"""

import argparse
import contextlib
import io
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DEFAULT = 10_000.0
"""Collisions per particle of a run of default settings."""

ENGINE, CHECKPOINTS = "engine", "checkpoints"

EVERY = 10.0
"""Seconds between two checkpoints."""


class Parts:
    """Seconds of each part; a part inside another one is not counted in that."""

    def __init__(self, clock):
        self.clock, self.seconds, self.stack = clock, {}, ["imports"]
        self.calls = {}
        # The clock of the process began with it; the other one began now.
        self.since = 0.0 if clock is time.process_time else clock()

    def turn(self, name):
        """Go on with another part."""
        now = self.clock()
        self.seconds[self.stack[-1]] = self.seconds.get(self.stack[-1], 0.0) + now - self.since
        self.stack[-1], self.since = name, now

    def wrap(self, owner, attribute, name):
        """Count all calls of a function as a part of its own."""
        function = getattr(owner, attribute)

        def counted(*arguments, **options):
            outer = self.stack[-1]
            self.calls[name] = self.calls.get(name, 0) + 1
            self.turn(name)
            try:
                return function(*arguments, **options)
            finally:
                self.turn(outer)

        setattr(owner, attribute, counted)


def one(arguments, cpu):
    """Run the command in this process, and print what its parts took."""
    parts = Parts(time.process_time if cpu else time.perf_counter)
    from carom.cli import main
    from carom.simulation.simulation import Simulation
    from carom.studies.runs import driver, report

    for owner, attribute, name in (
        (driver.Run, "from_the_start", "scene, kernel, looks"),
        (driver.Run, "_write", "frames"),
        (driver.Run, "save", CHECKPOINTS),
        (report, "pressure_of", "error bars"),
        (report, "_distribution", "g(r)"),
        (report, "_draw", "pictures"),
        (Simulation, "run", ENGINE),
    ):
        parts.wrap(owner, attribute, name)
    # The first call of the engine runs for no time, and loads the kernel.
    engine, first = Simulation.run, []

    def run(sim, *given, **options):
        if first:
            return engine(sim, *given, **options)
        first.append(sim)
        value = engine(sim, *given, **options)
        parts.seconds["scene, kernel, looks"] += parts.seconds.pop(ENGINE)
        return value

    Simulation.run = run
    parts.turn("command line, tables")
    sys.argv = ["carom", *arguments]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main()
    parts.turn("")
    print(json.dumps([parts.seconds, parts.calls[CHECKPOINTS]]))


def snapshots(n):
    """Print the CPU seconds of five pictures of n spheres, the first one with the import of matplotlib."""
    import carom
    from carom.pictures import plots

    cells = max(round((n / 4) ** (1 / 3)), 1)
    frame = carom.Simulation(carom.Scene.crystal(cells=cells, packing_fraction=0.45), seed=1).frame()
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(5):
            began = time.process_time()
            plots.snapshot(frame, path=Path(folder) / "snapshot.png")
            print(f"{frame.n}: {time.process_time() - began:.2f} CPU s", flush=True)


def compare(given, n):
    """Print the shares of a run of about n spheres."""
    cells, length = max(round((n / 4) ** (1 / 3)), 1), given.collisions_per_particle
    arguments = ["run", "--lattice", "fcc", "--cells", cells, "--packing-fraction", given.packing_fraction]
    arguments += ["--collisions-per-particle", length, "--equilibration", min(0.2 * length, 100.0)]
    with tempfile.TemporaryDirectory() as folder:
        where = Path(folder) / "run"
        command = [sys.executable, __file__, "--one", *["--cpu"] * given.cpu, "--"]
        command += [str(word) for word in (*arguments, "--out", where)]
        began = time.perf_counter()
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
        whole = time.perf_counter() - began
        size = sum(path.stat().st_size for path in where.iterdir()) / 1e6
        summary = json.loads((where / "summary.json").read_text())
        frames = summary["frames"] if summary["trajectories"] else 0
    seconds, checkpoints = json.loads(done.stdout)
    if not given.cpu:  # the start of Python, which no clock in it sees, and its end
        seconds["imports"] += whole - sum(seconds.values())
    if given.scaled:
        seconds[ENGINE] *= DEFAULT / length
        each = seconds[CHECKPOINTS] / checkpoints
        seconds[CHECKPOINTS] = each * (4 + seconds[ENGINE] / max(EVERY, 9.0 * each))
    whole = sum(seconds.values())
    kind = "CPU s" if given.cpu else "s"
    length = DEFAULT if given.scaled else length
    print(f"{4 * cells**3} spheres, {length:g} collisions each: {whole:.2f} {kind}")
    print(f"    {frames} frames, {size:.0f} MB")
    for name, part in sorted(seconds.items(), key=lambda item: -item[1]):
        print(f"    {100 * part / whole:5.1f} %  {part:8.2f} {kind}  {name}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--n", type=int, nargs="+", default=[100, 1000, 10_000, 100_000])
    parser.add_argument("--packing-fraction", type=float, default=0.45)
    parser.add_argument("--collisions-per-particle", type=float, default=100.0)
    parser.add_argument("--scaled", action="store_true", help="shares at the default length")
    parser.add_argument("--cpu", action="store_true", help="CPU time, for a machine that others use too")
    parser.add_argument("--snapshot", action="store_true", help="time pictures of 2048 and 10^5 alone")
    given = parser.parse_args()
    for n in (2048, 100_000) if given.snapshot else given.n:
        snapshots(n) if given.snapshot else compare(given, n)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[sys.argv.index("--") + 1 :], "--cpu" in sys.argv)
    else:
        main()
