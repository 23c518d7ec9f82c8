"""Disks melt: the bond-orientational order psi_6 of every disk in color, in fluid, coexistence and crystal.

    python examples/order_of_disks.py [--smoke] [--out order_of_disks.png]

psi_6 of a disk is the mean of exp(6 i theta) over its six nearest neighbors. The hue is its phase, the
orientation of the neighborhood; the color is strong where |psi_6| is near 1.
"""

# %% Arguments: --smoke makes it small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import hsv_to_rgb
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks, few collisions")
parser.add_argument("--out", type=Path, default=Path("order_of_disks.png"), help="file of the picture")
args = parser.parse_args()
n, collisions = (100, 50) if args.smoke else (1600, 8000)


# %% psi_6 from positions in a periodic box.
def psi_6(frame: carom.Frame) -> np.ndarray:
    """Return psi_6 of every disk, (n,) complex."""
    positions = frame.positions % frame.box  # rounding may leave a coordinate at the edge
    _, near = cKDTree(positions, boxsize=frame.box).query(positions, k=7)
    bonds = positions[near[:, 1:]] - positions[:, None]
    bonds -= np.round(bonds / frame.box) * frame.box
    return np.exp(6j * np.arctan2(bonds[..., 1], bonds[..., 0])).mean(axis=1)


# %% Three densities, each from a random start in a square box, which fits no perfect crystal.
figure = Figure(figsize=(9.0, 4.2), layout="constrained")
panels = figure.add_gridspec(2, 3, height_ratios=(9, 1))
for k, eta in enumerate((0.66, 0.71, 0.74)):
    axes = figure.add_subplot(panels[0, k])
    scene = carom.Scene.random(n, eta, 2, seed=1)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=collisions)
    frame = sim.frame()
    order = psi_6(frame)
    whole, each = abs(order.mean()), abs(order).mean()
    print(f"packing fraction {eta:.2f}: |mean psi_6| = {whole:.3f}, mean |psi_6| = {each:.3f}")
    hue = np.angle(order) / (2.0 * np.pi) % 1.0
    colors = hsv_to_rgb(np.stack([hue, np.abs(order) ** 2, np.full(n, 0.92)], axis=1))
    width = np.full(n, 0.97)
    axes.add_collection(
        EllipseCollection(
            width,
            width,
            np.zeros(n),
            units="xy",
            offsets=frame.positions,
            offset_transform=axes.transData,
            facecolors=colors,
        )
    )
    axes.set(xlim=(0, frame.box[0]), ylim=(0, frame.box[1]), aspect="equal", xticks=[], yticks=[])
    axes.set_title(f"packing fraction {eta:.2f}", fontsize=10)

# %% The key of the colors, and the picture.
key = figure.add_subplot(panels[1, :])
modulus, turns = np.mgrid[0:1:20j, 0:1:361j]
key.imshow(
    hsv_to_rgb(np.stack([turns, modulus**2, np.full_like(turns, 0.92)], axis=2)),
    extent=(0, 360, 0, 1),
    aspect="auto",
    origin="lower",
)
key.set(xticks=range(0, 361, 60), yticks=(0, 1), xlabel="arg $\\psi_6$ [degrees]", ylabel="$|\\psi_6|$")
args.out.parent.mkdir(parents=True, exist_ok=True)
path = args.out if args.out.suffix else args.out.with_suffix(".png")
figure.savefig(path, dpi=110)
print(path)
