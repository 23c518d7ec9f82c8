"""An fcc crystal of hard spheres: its pressure, and how far spheres move from their lattice sites.

python examples/crystal.py [--smoke] [--out crystal.png]

Lindemann's rule: a crystal melts where the root mean squared displacement is some 0.13 of the spacing.
"""

# %% Arguments: --smoke makes it small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np

import carom
from carom.pictures import plots

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres, few collisions")
parser.add_argument("--out", type=Path, default=Path("crystal.png"), help="file of the picture")
args = parser.parse_args()
cells, length = (3, 50) if args.smoke else (6, 500)

# %% Two densities above melting (0.5433): Z, compared with Almarza's equation, and the displacements.
print(f"{'eta':>5} {'Z':>20} {'infinite':>9} {'theory':>8} {'Lindemann':>10}")
for eta in (0.56, 0.62, 0.68):
    scene = carom.Scene.crystal(cells=cells, packing_fraction=eta)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=100)
    found = sim.measure(carom.Pressure(), collisions_per_particle=length)
    z = found.Z
    infinite = z.mean + (z.mean - 1.0) / scene.n
    moved = [frame.unwrapped - scene.positions for frame in sim.sample(every=0.1, count=50)]
    moved = np.array(moved) - np.mean(moved, axis=1, keepdims=True)  # without the center of mass
    spacing = scene.box[0] / cells / np.sqrt(2.0)
    ratio = np.sqrt((moved**2).sum(axis=2).mean()) / spacing
    theory = carom.theory.almarza(eta)
    print(f"{eta:5.2f} {z.mean:11.4f} +- {z.error:.4f} {infinite:9.4f} {theory:8.4f} {ratio:10.4f}")

# %% The picture: the densest of the three.
args.out.parent.mkdir(parents=True, exist_ok=True)
path = args.out if args.out.suffix else args.out.with_suffix(".png")
plots.snapshot(sim.frame(), path=path)
print(path)
