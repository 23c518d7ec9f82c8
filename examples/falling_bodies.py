"""Spheres, dumbbells and trimers over a warm floor: how high they are, compared with the barometric law.

python examples/falling_bodies.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Bonds, Gravity, Wall

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few samples")
parser.add_argument("--out", type=Path, default=Path("falling-bodies"), help="folder of the picture")
args = parser.parse_args()
samples, g, kT, longest = 20 if args.smoke else 250, 1.0, 6.0, 1.1
width, height, rows = 48.0, 80.0, 4

# %% 192 bodies of each kind. A bond keeps two spheres between 1 and 1.1 apart; without `others`, bodies pass
# through each other, so that the law is exact.
sizes = (1, 2, 3)
bonds, places = [], []
for kind, size in enumerate(sizes):
    for body in range(4 * int(width)):
        column, row = divmod(body, rows)
        first = len(places)
        bonds += [(first + k, first + k + 1) for k in range(size - 1)]
        places += [(column + 0.5, 0.6 + 12.0 * kind + 3.2 * row + 1.05 * k) for k in range(size)]
scene = carom.Scene(
    places,
    (width, height),
    interaction=Bonds(bonds, inner=1.0, outer=longest),
    motion=Gravity((0.0, -g)),
    walls={"y_low": Wall(kT=kT), "y_high": Wall()},
)
sim = carom.Simulation(scene, kT=kT, seed=1)
sim.run(time=10.0 if args.smoke else 200.0)

# %% Centers of mass at equal times.
counts = np.repeat(sizes, 4 * int(width))
begins = np.concatenate([[0], np.cumsum(counts)[:-1]])
frames = sim.sample(every=4.0, count=samples)
centers = np.array([np.add.reduceat(frame.positions[:, 1], begins) / counts for frame in frames])

# %% Beyond its own length a body feels no floor: there heights are exponential, of mean kT / (k m g).
for size in sizes:
    reach = 0.5 + (size - 1) * longest
    each = centers[:, counts == size]
    inside = each > reach
    sums, numbers = ((each - reach) * inside).sum(axis=1), inside.sum(axis=1)
    mean = sums.sum() / numbers.sum()
    error = np.sqrt(np.sum((sums - mean * numbers) ** 2)) / numbers.sum()
    print(f"{size} spheres: mean height {mean:.3f} +- {error:.3f}, kT / (k m g) = {kT / (size * g):.3f}")

# %% The picture: a quarter of the bodies now, and densities by height with the law's slopes.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(7.6, 4.0), layout="constrained")
left, axes = figure.subplots(1, 2, width_ratios=(1.0, 1.1))
last = sim.frame().positions
shown = {kind * 4 * int(width) + k for kind in range(3) for k in range(0, 4 * int(width), 4)}
for body in sorted(shown):
    x, y = last[begins[body] : begins[body] + counts[body]].T
    if np.ptp(x) < 0.5 * width:  # whole in the box
        circles = {"units": "xy", "offsets": np.stack([x, y], axis=1), "transOffset": left.transData}
        color = f"C{counts[body] - 1}"
        left.plot(x, y, color=color, lw=4.0)
        left.add_collection(EllipseCollection(1.0, 1.0, 0.0, color=color, **circles))
left.set(xlim=(0.0, width), ylim=(0.0, 36.0), aspect="equal")
left.set(xlabel="x / diameter", ylabel="height / diameter")
left.grid(False)
names = {1: "spheres", 2: "dumbbells", 3: "trimers"}
for kind, size in enumerate(sizes):
    edges = np.linspace(0.5, 0.5 + 6.0 * kT / size, 40)
    middle = 0.5 * (edges[1:] + edges[:-1])
    reach = 0.5 + (size - 1) * longest
    each = centers[:, counts == size].ravel()
    density = np.histogram(each, edges)[0] / (len(each) * np.diff(edges))
    beyond = middle > reach
    law = np.exp(-(middle[beyond] - reach) * size * g / kT) * size * g / kT * np.mean(each > reach)
    axes.semilogy(middle, density, "o", ms=3.0, color=f"C{kind}", label=names[size])
    axes.semilogy(middle[beyond], law, color=f"C{kind}")
axes.set(xlabel="height of the center / diameter", ylabel="probability per diameter", ylim=(2e-4, 1.0))
axes.legend(frameon=False, title="measured; lines: exact")
figure.savefig(args.out / "falling_bodies.png", dpi=110)
print(args.out / "falling_bodies.png")
