"""The paper's measuring run: 160 disks between rigid cushions, 52 000 events counted as in its sec. 10.

    python examples/cushions_160.py [--smoke] [--out cushions_160.png]

A collision counts as two events, a reflection by a cushion or a crossing of a boundary of the 4 x 4 sectors
as one. The paper's run took 90 s on a machine of 1 MFLOP, where the program made 150 to 450 collisions a
second.
"""

# %% Arguments: --smoke counts fewer events, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a tenth of the events")
parser.add_argument("--out", type=Path, default=Path("cushions_160.png"), help="file of the picture")
args = parser.parse_args()
target = 5_200 if args.smoke else 52_000

# %% The table: a square of edge 1 with four cushions, and disks of diameter 0.015, at random.
N, SIGMA, SECTORS = 160, 0.015, 4
scene = carom.Scene.random(N, box=(1.0, 1.0), diameter=SIGMA, walls=True, seed=1)
sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors="sectors"))
sim.run(time=0.0)  # compiles
compiling = sim.statistics.seconds

# %% The engine chooses sectors of its own size, so crossings of the paper's sixteen are counted from frames,
# so close to each other that hardly a disk crosses a boundary twice between two of them.
STEP = 1e-3
collisions = reflections = crossings = 0
before = np.floor(SECTORS * scene.positions)
for frame in sim.sample(every=STEP):
    after = np.floor(SECTORS * frame.positions)
    crossings += int(np.abs(after - before).sum())
    before = after
    collisions = sim.collisions
    reflections = sum(wall.hits for wall in sim.obstacles)
    if 2 * collisions + reflections + crossings >= target:
        break

# %% What kinetic theory expects in the same time: the rate of collisions with Henderson's contact value, and
# the flux n sqrt(kT / 2 pi m) of disks through a line in one direction. At a cushion the density is
# higher by Z (the contact theorem).
eta = scene.packing_fraction
free = 1.0 - SIGMA  # centers stay within a square of this edge
density = N / free**2
contact = (1.0 - 7.0 * eta / 16.0) / (1.0 - eta) ** 2
pressure = 1.0 + 0.5 * math.pi * density * SIGMA**2 * contact
flux = density * math.sqrt(sim.kT / (2.0 * math.pi)) * free
expected = {
    "collisions": N * math.sqrt(math.pi * sim.kT) * density * SIGMA * contact * sim.time,
    "reflections": 4 * flux * pressure * sim.time,
    "crossings": 2 * 2 * (SECTORS - 1) * flux * sim.time,
}
print(f"{'':<12} {'counted':>8} {'expected':>9}")
for name, count in (("collisions", collisions), ("reflections", reflections), ("crossings", crossings)):
    print(f"{name:<12} {count:>8} {expected[name]:>9.0f}")
print(f"events       {2 * collisions + reflections + crossings:>8}")
print(f"The paper's 90 s for 52 000 events were {collisions * 52_000 / target / 90:.0f} collisions a second;")
print(f"the engine made these in {sim.statistics.seconds - compiling:.3f} s.")

# %% The picture: the disks between their cushions.
from carom.pictures import plots

args.out.parent.mkdir(parents=True, exist_ok=True)
path = args.out if args.out.suffix else args.out.with_suffix(".png")
plots.snapshot(sim.frame(), path=path)
print(path)
