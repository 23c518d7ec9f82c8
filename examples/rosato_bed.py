"""A vibrated bed of disks (after Rosato, PRL 58 (1987) 1038): profiles by height, motion within a cycle.

python examples/rosato_bed.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Gravity, Loss, Plane, Sine

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks and cycles")
parser.add_argument("--out", type=Path, default=Path("rosato-bed"), help="folder of the picture")
args = parser.parse_args()
rows, cycles, settling = (4, 6, 4) if args.smoke else (12, 400, 100)
width, amplitude, shaking, phases = 24.4, 0.8, 4.0, 24
args.out.mkdir(parents=True, exist_ok=True)

# %% Lengths in mean diameters, the field is 1. The floor moves as A sin(2 pi t / T), with an acceleration of
# up to four times the field. Sizes differ by 10 %, so that the bed does not crystallize; contacts lose
# energy, and the TC model keeps them from piling up.
period = 2.0 * math.pi * math.sqrt(amplitude / shaking)
rng = np.random.default_rng(1)
places = np.array([(0.7 + 1.15 * i, 2.6 + 1.15 * j) for j in range(rows) for i in range(21)])
diameters = rng.uniform(0.95, 1.05, len(places))
loss = Loss(0.9, contact_time=1e-3)
floor = Plane((0.0, 1.0), 1.0, "floor", shake=Sine(amplitude, period), impact=loss)
scene = carom.Scene(
    places,
    (width, 200.0),
    diameter=diameters,
    mass=diameters**2,
    velocities=0.1 * rng.normal(size=places.shape),
    walls=True,
    motion=Gravity((0.0, -1.0)),
    obstacles=[floor],
    impact=loss,
)
sim = carom.Simulation(scene)
sim.run(time=settling * period)
start, before = sim.time, {each.name: each for each in sim.obstacles}
momentum = np.sum(scene.masses * sim.frame().velocities[:, 1])
collisions = sim.collisions

# %% Frames at equal phases of the floor: sums over disks by phase and height of number, area and velocity.
edges = np.linspace(0.0, 40.0, 81)
sums = np.zeros((5, phases, len(edges) - 1))  # number, area, v_x, v_y, v.v
middles = np.zeros((cycles, phases))
masses = scene.masses
for k, frame in enumerate(sim.sample(every=period / phases, count=cycles * phases)):
    phase = (k + 1) % phases
    height, v = frame.positions[:, 1], frame.velocities
    middles[k // phases, phase] = np.sum(masses * height) / masses.sum()
    bins = np.clip(np.digitize(height, edges) - 1, 0, len(edges) - 2)
    for row, values in zip(
        sums, (np.ones(len(v)), 0.25 * np.pi * diameters**2, *v.T, (v**2).sum(axis=1)), strict=True
    ):
        row[phase] += np.bincount(bins, values, len(edges) - 1)
    if phase == phases // 4 and k // phases == cycles - 1:  # the floor is highest
        shown = frame

# %% The exact balance: what the floor took up is the weight times the time, plus the change of the momentum.
time = sim.time - start
after = {each.name: each for each in sim.obstacles}
gained = np.sum(masses * sim.frame().velocities[:, 1]) - momentum
pushed = after["floor"].impulse - before["floor"].impulse
weight = masses.sum() * time
power = (after["floor"].work - before["floor"].work) / time / len(places)
print(f"{len(places)} disks, {cycles} cycles, {sim.collisions - collisions} collisions of pairs")
print(f"force on the floor over the weight: {pushed / weight:.6f}, off the exact balance by "
      f"{abs(pushed / (weight + gained) - 1.0):.0e}")  # fmt: skip
print(f"power of the floor, lost in contacts: {power:.3f} a disk")

# %% Temperature: of velocities less their mean at that phase and height, where there are enough disks.
number, area, *flow, square = sums
mean = np.divide([*flow, square], number, out=np.zeros((3, *number.shape)), where=number > 0)
spread = number * (mean[2] - mean[0] ** 2 - mean[1] ** 2) / 2.0
enough = number.sum(axis=0) > 0.002 * number.sum()
kT = np.where(enough, spread.sum(axis=0), np.nan) / np.maximum(number.sum(axis=0), 1.0)
fraction = area.sum(axis=0) / (cycles * phases * width * np.diff(edges))
middle = 0.5 * (edges[1:] + edges[:-1])
print(f"packing fraction up to {fraction.max():.2f}; temperature {np.nanmin(kT):.2f} to {np.nanmax(kT):.2f}")

# %% The picture: the bed when the floor is highest, its profiles, and its center within a cycle.
style.use()  # colors
figure = Figure(figsize=(9.0, 4.0), layout="constrained")
bed, profile, cycle = figure.subplots(1, 3, width_ratios=[1.15, 1.0, 1.0])
speeds = np.linalg.norm(shown.velocities, axis=1)
bed.add_collection(
    EllipseCollection(
        diameters,
        diameters,
        np.zeros(len(diameters)),
        units="xy",
        offsets=shown.positions,
        transOffset=bed.transData,
        facecolors=colormaps["viridis"](np.clip(speeds / 4.0, 0.0, 1.0)),
        edgecolors="0.3",
        linewidths=0.3,
    )
)
bed.axhline(1.0 + amplitude, color="k", lw=1.5)
bed.set(xlim=(0.0, width), ylim=(0.0, 24.0), aspect="equal", xticks=[], ylabel="height / diameter")
bed.set_title("the floor at its highest; fast disks are bright", fontsize=8)
profile.plot(fraction, middle, color="C0", label="packing fraction")
hot = profile.twiny()
hot.plot(kT, middle, color="C1", label="temperature")
profile.set(ylim=(0.0, 24.0), xlim=(0.0, None))
profile.set_xlabel("packing fraction", color="C0")
hot.set_xlim(0.0, None)
hot.set_xlabel("temperature / (m g diameter)", color="C1")
turn = np.arange(phases + 1) / phases
low, half, high = (np.append(part, part[0]) for part in np.percentile(middles[1:], [5, 50, 95], axis=0))
cycle.fill_between(turn, low, high, color="C0", alpha=0.3, lw=0, label="nine cycles of ten")
cycle.plot(turn, half, color="C0", label="center of mass, median")
cycle.plot(turn, half.mean() + amplitude * np.sin(2.0 * np.pi * turn), "k--", lw=0.8, label="floor, moved up")
cycle.set(xlabel="phase of the floor", ylabel="height / diameter")
cycle.legend(fontsize=7)
figure.savefig(args.out / "rosato_bed.png", dpi=100)
print(args.out / "rosato_bed.png")
