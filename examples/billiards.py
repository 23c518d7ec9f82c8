"""Four billiard tables: a circle, a stadium, Sinai's and a mushroom, with a small disk in each.

    python examples/billiards.py [--smoke] [--out billiards.png]

The disk in the circle goes round a caustic for ever. In the stadium and on Sinai's table every path comes
near every place. In the mushroom it depends on how the disk was started.
"""

# %% Arguments: --smoke follows the disks for a short time, --out says where the picture goes.
import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import carom
from carom.drawing.particles import draw_obstacles
from carom.models import Arc, Ball, Segment, polygon

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a short time")
parser.add_argument("--out", type=Path, default=Path("billiards.png"), help="file of the picture")
args = parser.parse_args()

# %% The tables stand side by side in one box: arcs, segments and a ball.
circle = [Arc((5.5, 6.0), 5.0, name="circle")]
stadium = [
    Segment((16.0, 11.0), (22.0, 11.0), name="upper side"),
    Segment((16.0, 1.0), (22.0, 1.0), name="lower side"),
    Arc((16.0, 6.0), 5.0, start=90.0, angle=180.0, name="left end"),
    Arc((22.0, 6.0), 5.0, start=-90.0, angle=180.0, name="right end"),
]
sinai = [*polygon([(30, 1), (40, 1), (40, 11), (30, 11)], name="square"), Ball((35.0, 6.0), 2.0)]
mushroom = [
    Arc((48.0, 5.0), 5.5, start=0.0, angle=180.0, name="cap"),
    *polygon(
        [(42.5, 5.0), (46.2, 5.0), (46.2, 0.5), (49.8, 0.5), (49.8, 5.0), (53.5, 5.0)],
        closed=False,
        name="stem",
    ),
]

# %% A disk in each, all with one speed and none in the way of another.
scene = carom.Scene(
    positions=[[5.5, 3.2], [17.0, 5.0], [32.0, 3.0], [45.0, 8.0]],
    box=[54.5, 12.0],
    diameter=0.2,
    velocities=[[1.0, 0.35], [0.8, 0.69], [0.6, 0.88], [0.9, 0.53]],
    walls=True,
    obstacles=[*circle, *stadium, *sinai, *mushroom],
)
sim = carom.Simulation(scene)
frames = list(sim.sample(every=0.05, count=400 if args.smoke else 30_000))
paths = np.array([frame.positions for frame in frames])
bounces = sum(impacts.hits for impacts in sim.obstacles)
print(f"{bounces} bounces, energy kept to {sim.statistics.energy_drift:.1e}")

# %% The picture: tables, and the way of each disk.
figure, axes = plt.subplots(figsize=(12.0, 2.9), dpi=75, layout="constrained")
draw_obstacles(axes, scene.obstacles, frames[-1])
for k, color in enumerate(["#1f4e79", "#c0392b", "#2e8b57", "#7b4f9d"]):
    axes.plot(*paths[:, k].T, lw=0.25, color=color, alpha=0.8, zorder=0.2)
axes.set(xlim=(0.0, 54.5), ylim=(0.0, 12.0), aspect="equal")
axes.set_axis_off()
figure.savefig(args.out)
print(f"The picture is in {args.out}.")
