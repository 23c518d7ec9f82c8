"""A column of hard disks in a field: density by height, compared with hydrostatics.

python examples/barometric_column.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom import theory
from carom.figures import style
from carom.models import Gravity

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks and samples")
parser.add_argument("--out", type=Path, default=Path("barometric-column"), help="folder of the picture")
args = parser.parse_args()
width, rows, samples = (8.0, 6, 40) if args.smoke else (16.0, 20, 4000)
g = 0.25 if args.smoke else 0.15

# %% Disks over a floor, in a field that pulls them down: elastic, so the energy is constant.
columns = int(width / 1.3)
places = [((i + 0.5) * width / columns, 0.6 + 1.2 * j) for j in range(rows) for i in range(columns)]
height = 40.0 / g
scene = carom.Scene(places, (width, height), walls="y", motion=Gravity((0.0, -g)))
sim = carom.Simulation(scene, kT=2.0, seed=1)
first = sim.velocities
sim.run(time=400.0 if not args.smoke else 40.0)

# %% Heights, and the temperature, which the fall has raised, at equal times.
heights, kTs = [], []
for frame in sim.sample(every=1.0, count=samples):
    heights.append(frame.positions[:, 1])
    kTs.append(0.5 * np.mean(np.sum(frame.velocities**2, axis=1)))
kT = float(np.mean(kTs))
edges = np.linspace(0.5, 0.5 + 10.0 * kT / g, 60)
counts = np.histogram(np.concatenate(heights), edges)[0] / len(heights)
density = counts / (width * np.diff(edges))
middle = 0.5 * (edges[1:] + edges[:-1])

# %% Hydrostatics: dP/dz = -m g n, with the pressure of hard disks at the local density, from P(0) = N g / L.
eta = np.linspace(1e-6, 0.69, 20000)
pressure = 4.0 / np.pi * eta * theory.best(2)(eta) * kT
bottom = scene.n * g / width
# Between two densities the height falls by dP / (g n).
steps = -np.diff(pressure) / (g * 0.5 * (eta[1:] + eta[:-1]) * 4.0 / np.pi)
rise = np.concatenate([[0.0], np.cumsum(steps)])
rise = 0.5 + rise - np.interp(bottom, pressure, rise)
dense = np.interp(middle, rise[::-1], eta[::-1]) * 4.0 / np.pi
ideal = scene.n * g / (width * kT) * np.exp(-g * (middle - 0.5) / kT)

# %% What the floor bore, and how well the energy was kept.
floor = sim.obstacles[0]
momentum = (sim.velocities - first)[:, 1].sum()
print(f"kT = {kT:.4f}, mean force on the floor over the weight, corrected for the momentum of the column: ")
print((floor.impulse - momentum - sim.obstacles[1].impulse) / (scene.n * g * sim.time))
print(
    f"energy drift {sim.statistics.energy_drift:.1e} after {sim.collisions} collisions, {floor.hits} bounces"
)
where = (dense > 0.02) & (middle > 4.0)
off = np.abs(density[where] / dense[where] - 1.0)
print(f"density compared with hydrostatics of hard disks: off by {off.mean():.2%} on average above height 4")

# %% The picture.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(6.4, 4.2), layout="constrained")
axes = figure.subplots()
axes.semilogy(middle, density, "o", ms=3.5, color="C0", label=f"{scene.n} disks, measured")
axes.semilogy(middle, dense, color="C1", label="hydrostatics of hard disks")
axes.semilogy(middle, ideal, "--", color="0.5", label="ideal gas")
axes.set_ylim(density[density > 0].min() / 2.0, 2.0 * density.max())
axes.set_xlabel("height / diameter")
axes.set_ylabel("disks per diameter²")
axes.legend(frameon=False)
figure.savefig(args.out / "barometric_column.png", dpi=110)
print(args.out / "barometric_column.png")
