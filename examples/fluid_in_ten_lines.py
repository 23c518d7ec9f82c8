"""A fluid of hard spheres in ten lines: its pressure with an error bar, and a trajectory of it.

python examples/fluid_in_ten_lines.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the file goes.
import argparse
from pathlib import Path

import carom
from carom.pictures import plots

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("fluid"), help="folder of the file")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)
cells, collisions, frames = (3, 20, 3) if args.smoke else (8, 1000, 50)

# %% A scene: spheres of diameter 1 on a face-centered cubic lattice, 4 a cell, filling 40 % of the box.
scene = carom.Scene.crystal(cells=cells, packing_fraction=0.40)

# %% Maxwell velocities, and enough collisions for the lattice to be forgotten.
sim = carom.Simulation(scene, kT=1.0, seed=1)
sim.run(collisions_per_particle=0.1 * collisions)

# %% The pressure. Z = P V / (N kT), with the error of the mean and what the samples are worth.
pressure = sim.measure(carom.Pressure(), collisions_per_particle=collisions)
print(pressure)
print(f"Carnahan-Starling, for infinitely many spheres: {carom.theory.carnahan_starling(0.40):.4f}")

# %% Frames at exactly equal times. Taking them changes no bit of the run.
with carom.io.open(args.out / "fluid.h5md", "w", scene) as trajectory:
    for frame in sim.sample(every=0.5, count=frames):
        trajectory.write(frame)

# %% How well it went: counts, drift of energy and momentum, the deepest overlap that rounding made.
print(sim.statistics)

# %% What it looks like at the end.
plots.snapshot(sim.frame(), path=args.out / "fluid.png")
