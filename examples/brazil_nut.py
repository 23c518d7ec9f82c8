"""The Brazil-nut effect: a large disk rises in a shaken bed of small ones (Rosato, PRL 58 (1987) 1038).

python examples/brazil_nut.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the pictures go.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Gravity, Loss, Plane, Sine

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks, one seed, few cycles")
parser.add_argument("--out", type=Path, default=Path("brazil-nut"), help="folder of the pictures")
args = parser.parse_args()
cycles, seeds, rows = (6, 1, 4) if args.smoke else (240, 5, 14)
width, large, period, amplitude = 12.7, 3.5, 3.6, 1.0
args.out.mkdir(parents=True, exist_ok=True)


# %% A bed: small disks of slightly different sizes, so that they do not crystallize, over the large one,
# which starts at the bottom. The floor is shaken with three times the field; contacts lose energy, and
# the TC model keeps them from piling up.
def bed(seed):
    rng = np.random.default_rng(seed)
    places, diameters = [(0.5 * width, 3.6 + 0.5 * large)], [large]
    for j in range(rows):
        for i in range(11):
            x, y = 0.75 + 1.12 * i, 4.2 + 1.12 * j
            if np.hypot(x - places[0][0], y - places[0][1]) > 0.5 * large + 0.6:
                places.append((x, y))
                diameters.append(rng.uniform(0.85, 1.0))
    masses = np.array(diameters) ** 2
    masses[0] *= 0.5  # of half the density: it rises faster
    loss = Loss(0.7, contact_time=1e-3)
    floor = Plane((0.0, 1.0), 3.05, "floor", shake=Sine(amplitude, period), impact=loss)
    return carom.Scene(
        places,
        (width, 60.0),
        diameter=diameters,
        mass=masses,
        velocities=0.1 * rng.normal(size=(len(places), 2)),
        walls=True,
        motion=Gravity((0.0, -1.0)),
        obstacles=[floor],
        impact=loss,
    )


# %% Height of the large disk over the floor at rest, once a cycle when the floor is in the middle.
frames, heights = [], []
for seed in range(seeds):
    sim = carom.Simulation(bed(seed), tuning=carom.Tuning(neighbors="sectors"))
    track = []
    for k in range(cycles):
        if seed == 0 and k % 4 == 0:
            for _ in range(2):
                sim.run(time=0.5 * period)
                frames.append(sim.frame())
        else:
            sim.run(time=period)
        track.append(sim.frame().positions[0, 1] - 3.05)
    heights.append(track)
    print(
        f"seed {seed}: the large disk went from {track[0]:.1f} to {track[-1]:.1f} in {cycles} cycles; "
        f"{sim.collisions} collisions, {sim.statistics.spared_contacts} of them elastic by the TC model"
    )

# %% Height against time.
style.use()  # colors
figure = Figure(figsize=(6.4, 4.0), layout="constrained")
axes = figure.subplots()
for track in heights:
    axes.plot(np.arange(1, cycles + 1), track, lw=1.0)
axes.set_xlabel("cycles of the floor")
axes.set_ylabel("height of the large disk / small diameter")
figure.savefig(args.out / "brazil_nut.png", dpi=110)

# %% The movie.
diameters, colors = frames[0].diameters, ["C1"] + ["0.75"] * (len(frames[0].diameters) - 1)
movie = Figure(figsize=(2.2, 4.4), layout="constrained")
axes = movie.subplots()
axes.set(xlim=(0.0, width), ylim=(0.0, 2.0 * width), aspect="equal", xticks=[], yticks=[])
disks = EllipseCollection(
    diameters,
    diameters,
    np.zeros(len(diameters)),
    units="xy",
    offsets=frames[0].positions,
    transOffset=axes.transData,
    facecolors=colors,
    edgecolors="0.4",
    linewidths=0.3,
)
axes.add_collection(disks)
floor = axes.axhline(0.0, color="k", lw=1.5)


def show(k):
    disks.set_offsets(frames[k].positions)
    place = 3.05 + amplitude * np.sin(2.0 * np.pi * frames[k].time / period)
    floor.set_ydata([place, place])
    return disks, floor


FuncAnimation(movie, show, frames=len(frames)).save(args.out / "brazil_nut.gif", PillowWriter(fps=12), dpi=60)
print(args.out / "brazil_nut.png", args.out / "brazil_nut.gif")
