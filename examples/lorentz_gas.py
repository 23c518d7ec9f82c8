"""A Lorentz gas: one disk among fixed disks on a triangular lattice, its path and its diffusion coefficient.

    python examples/lorentz_gas.py [--smoke] [--out lorentz_gas.png]

The approximation of Machta and Zwanzig (Phys. Rev. Lett. 50, 1959 (1983)) treats the space between three
scatterers as a trap with three exits: D = w a^2 / (pi (sqrt(3) a^2 - 2 pi)) at unit speed, for scatterers of
radius 1, spacing a and gaps w = a - 2. It is exact for narrow gaps, and too
low for the gap of this example, w = 0.3.
"""

# %% Arguments: --smoke makes a short path, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a short path")
parser.add_argument("--out", type=Path, default=Path("lorentz_gas.png"), help="file of the picture")
args = parser.parse_args()
length = 2_000 if args.smoke else 100_000

# %% A periodic box with two scatterers. The disk has diameter 0.2: its center sees scatterers of radius 1.
W, SIGMA = 0.3, 0.2
a = 2.0 + W
box = (a, math.sqrt(3.0) * a)
scatterers = [carom.models.Ball((x * a, x * box[1]), 1.0 - SIGMA / 2) for x in (0.25, 0.75)]
scene = carom.Scene(
    [[0.25 * a, 0.75 * box[1]]], box, diameter=SIGMA, velocities=[[0.8, 0.6]], obstacles=scatterers
)
sim = carom.Simulation(scene, seed=1)

# %% The mean squared displacement over 50 units of time, from one long path cut into pieces.
STRETCH = 50.0
places = np.array([frame.unwrapped[0] for frame in sim.sample(every=STRETCH, count=int(length / STRETCH))])
squared = (np.diff(places, axis=0) ** 2).sum(axis=1)
found = carom.observables.blocking(squared / (4.0 * STRETCH))
theory = W * a**2 / (math.pi * (math.sqrt(3.0) * a**2 - 2.0 * math.pi))
hits = sum(ball.hits for ball in sim.obstacles)
print(f"{hits} collisions, mean free path {sim.time / hits:.4f}")
exact = math.pi * (box[0] * box[1] - 2.0 * math.pi) / (2 * 2.0 * math.pi)
print(f"exact mean free path                {exact:.4f}")
print(f"D = {found.mean:.4f} +- {found.error:.4f}; Machta and Zwanzig: {theory:.4f}")

# %% The picture: two hundred units of time, from dark to bright.
path = np.array(
    [frame.unwrapped[0] for frame in sim.sample(every=0.02, count=1_000 if args.smoke else 10_000)]
)
low, high = path.min(axis=0) - 1.5, path.max(axis=0) + 1.5
cells = [np.arange(math.floor(low[k] / box[k]) - 1, math.ceil(high[k] / box[k]) + 1) * box[k] for k in (0, 1)]
corners = np.array([(x, y) for x in cells[0] for y in cells[1]])
centers = np.vstack([corners + np.array(ball.center) for ball in scatterers])
figure = Figure(figsize=(7.0, 7.0 * (high[1] - low[1]) / (high[0] - low[0])), layout="constrained")
axes = figure.subplots()
wide = np.full(len(centers), 2.0)
axes.add_collection(
    EllipseCollection(
        wide,
        wide,
        np.zeros(len(wide)),
        units="xy",
        offsets=centers,
        offset_transform=axes.transData,
        color="#d5dbe3",
    )
)
pieces = np.stack([path[:-1], path[1:]], axis=1)
axes.add_collection(LineCollection(pieces, array=np.arange(len(pieces)), cmap="viridis", linewidths=1.0))
axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=[], yticks=[])
args.out.parent.mkdir(parents=True, exist_ok=True)
picture = args.out if args.out.suffix else args.out.with_suffix(".png")
figure.savefig(picture, dpi=110)
print(picture)
