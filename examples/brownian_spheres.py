"""Brownian spheres: how far they diffuse at which packing fraction, from events alone.

python examples/brownian_spheres.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Brownian

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and samples")
parser.add_argument("--out", type=Path, default=Path("brownian-spheres"), help="folder of the picture")
args = parser.parse_args()
n, samples = (64, 40) if args.smoke else (1000, 400)

# %% After every step a sphere gets a new velocity: a free one diffuses with D0 = kT step / 2 m.
drive = Brownian(kT=1.0, step=0.1)
free = drive.diffusion()
every = 0.1 / free  # a tenth of the time in which a free sphere diffuses over its diameter
lags = np.arange(1, samples // 5)
fractions = [0.1, 0.3, 0.45]

# %% Mean squared displacements at three packing fractions.
results = {}
for eta in fractions:
    scene = carom.Scene.random(n, dimension=3, packing_fraction=min(eta, 0.3), seed=1)
    if eta > 0.3:  # too dense for random places: a crystal, which melts
        scene = carom.Scene.crystal(cells=6 if not args.smoke else 3, packing_fraction=eta)
    sim = carom.Simulation(scene.replace(drive=drive), seed=1)
    sim.run(time=5.0 / free if eta < 0.4 else 20.0 / free)
    paths = np.array([frame.unwrapped for frame in sim.sample(every=every, count=samples)])
    results[eta] = np.array([np.mean(np.sum((paths[k:] - paths[:-k]) ** 2, axis=2)) for k in lags])

# %% The coefficient of long times, from between 2 and 4 diameters^2 / D0.
print("packing fraction  D / D0")
slope = (lags * every * free > 2.0) & (lags * every * free < 4.0) if not args.smoke else lags > 2
ratios = []
for eta in fractions:
    ratios.append(np.polyfit(lags[slope] * every, results[eta][slope], 1)[0] / (6.0 * free))
    print(f"{eta:16.2f}  {ratios[-1]:.3f}")

# %% The picture: displacements, and coefficients beside the exact slope of thin suspensions, 1 - 2 eta.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(8.4, 3.8), layout="constrained")
left, right = figure.subplots(1, 2)
for k, eta in enumerate(fractions):
    left.loglog(lags * every * free, results[eta], color=f"C{k}", label=f"packing fraction {eta}")
left.loglog(lags * every * free, 6.0 * lags * every * free, "--", color="0.5", label="free")
left.set_xlabel("time · D₀ / σ²")
left.set_ylabel("mean squared displacement / σ²")
left.legend(frameon=False)
right.plot([0.0, 0.3], [1.0, 0.4], "--", color="0.5", label="1 - 2 η (exact for thin suspensions)")
right.plot(fractions, ratios, "o", color="C0", label="measured")
right.set_xlim(0.0, 0.55)
right.set_ylim(0.0, 1.05)
right.set_xlabel("packing fraction η")
right.set_ylabel("D / D₀")
right.legend(frameon=False)
figure.savefig(args.out / "brownian_spheres.png", dpi=110)
print(args.out / "brownian_spheres.png")
