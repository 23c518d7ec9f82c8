"""Active disks: those that swim far before they turn part into a gas and a dense phase, without attraction.

python examples/active_disks.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the pictures go.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import hsv_to_rgb
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Active

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks, short runs")
parser.add_argument("--out", type=Path, default=Path("active-disks"), help="folder of the pictures")
args = parser.parse_args()
n, times, samples = (100, 0.1, 4) if args.smoke else (4000, 4.0, 40)
args.out.mkdir(parents=True, exist_ok=True)
cell, step = 4.0, 0.1


# %% How dense is it where? The packing fraction of square cells.
def local(frame):
    cells = int(frame.box[0] / cell)
    edges = [np.linspace(0.0, edge, cells + 1) for edge in frame.box]
    counts = np.histogramdd(frame.positions % frame.box, edges)[0]
    return counts.ravel() * np.pi / 4.0 * (cells / frame.box[0]) ** 2


# %% Two persistence lengths, below and far above the critical one, 13 diameters. Directions diffuse with
# D_r = 3 D / diameter^2, as those of Brownian disks do.
style.use()  # colors
figure = Figure(figsize=(10.2, 3.6), layout="constrained")
left, middle, right = figure.subplots(1, 3)
for length, axes, color in ((4.0, left, "C0"), (100.0, middle, "C3")):
    swimmers = Active(speed=1.0, persistence=length, step=step, kT=2.0 / (3.0 * length * step))
    sim = carom.Simulation(carom.Scene.random(n, 0.5, 2, seed=1, drive=swimmers), seed=1)
    frames = list(sim.sample(every=times * length / samples, count=samples))
    late = list(sim.sample(every=0.05 * times * length, count=samples // 2))
    found = np.concatenate([local(frame) for frame in late])
    share = found[found > 0.75].sum() / found.sum()
    print(
        f"persistence length {length:g}: {share:.0%} of the disks are where the packing fraction is over 0.75"
    )
    bins = np.linspace(0.0, 1.1, 23)
    right.hist(found, bins, density=True, histtype="step", color=color, label=f"{length:g} σ")
    directions = sim.drive.directions
    hue = np.arctan2(directions[:, 1], directions[:, 0]) / (2.0 * np.pi) % 1.0
    disks = EllipseCollection(
        np.ones(n),
        np.ones(n),
        np.zeros(n),
        units="xy",
        offsets=late[-1].positions,
        offset_transform=axes.transData,
        facecolors=hsv_to_rgb(np.stack([hue, np.full(n, 0.7), np.full(n, 0.9)], axis=1)),
    )
    axes.add_collection(disks)
    axes.set(xlim=(0, sim.scene.box[0]), ylim=(0, sim.scene.box[1]), aspect="equal", xticks=[], yticks=[])
    axes.set_title(f"persistence length {length:g} σ", fontsize=10)

# %% The picture: the color of a disk is the direction into which it swims.
right.set_xlabel("local packing fraction")
right.set_ylabel("probability density")
right.legend(frameon=False)
figure.savefig(args.out / "active_disks.png", dpi=110)

# %% The movie: how the dense phase grows. The color is psi_6, so that crystals show.
carom.movie(frames, args.out / "active_disks.gif", fps=8, size=64 if args.smoke else 480, color="psi_6")
print(args.out / "active_disks.png", args.out / "active_disks.gif")
