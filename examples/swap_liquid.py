"""A dense liquid of many sizes, with and without swaps: how fast it forgets where its spheres were.

python examples/swap_liquid.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.figures import style

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres, too thin for a gain, for a short time")
parser.add_argument("--out", type=Path, default=Path("swap-liquid"), help="folder of the picture")
args = parser.parse_args()
if args.smoke:
    print("A packing fraction of 0.5 is too low for swaps to gain anything: run without --smoke to see it.")
n, eta, longest = (64, 0.5, 5.0) if args.smoke else (500, 0.61, 500.0)

# %% Sizes of a model of glasses, in a polydispersity of 23 %: so many that no crystal forms.
sizes = carom.sizes.power(n, ratio=0.4492, exponent=3)
scene = carom.Scene.random(packing_fraction=eta, diameter=sizes, seed=1)
print(f"polydispersity {sizes.std():.3f}, smallest over largest {sizes.min() / sizes.max():.3f}")

# %% Swaps bring it to equilibrium, which its own motion would not reach in this time.
swaps = carom.Swaps(interval=0.1, attempts=10, within=0.2)
sim = carom.Simulation(scene, swaps=swaps, seed=1)
sim.run(time=longest)
print(f"{sim.statistics.swaps_accepted / sim.statistics.swaps_tried:.1%} of the swaps were accepted")
start = carom.Scene.from_frame(sim.frame())

# %% From that state: F_s(k, t) at k near 2 pi over the mean diameter, which is 1.
k = 2.0 * np.pi / start.box[0] * round(start.box[0])
times = np.unique(np.geomspace(0.01, longest, 60).round(2))
curves = {}
for name, chosen in {"without swaps": None, "with swaps": swaps}.items():
    sim = carom.Simulation(start, swaps=chosen)
    origin = sim.frame().unwrapped
    moved = np.array([frame.unwrapped - origin for frame in sim.sample(times=times)])
    moved -= moved.mean(axis=1, keepdims=True)
    curves[name] = np.cos(k * moved).mean(axis=(1, 2))
    below = times[curves[name] < np.exp(-1.0)]
    fell = f"falls below 1/e at {below[0]:g}" if len(below) else "stays above 1/e"
    print(f"{name}: F_s {fell}, {2 * sim.collisions / n:.0f} collisions a sphere")

# %% The picture: the motion alone is stuck in cages.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(8.4, 3.8), layout="constrained")
left, right = figure.subplots(1, 2, width_ratios=[1, 2])
left.hist(sizes, bins=20, color="0.6")
left.set_xlabel("diameter / mean")
left.set_ylabel("spheres")
for name, curve in curves.items():
    right.semilogx(times, curve, label=name)
right.axhline(np.exp(-1.0), color="0.6", linewidth=0.8, linestyle="--")
right.set_ylim(0.0, 1.0)
right.set_xlabel(r"$t \sqrt{kT/m}$ / mean diameter")
right.set_ylabel("F_s(k, t)")
right.set_title(f"packing fraction {eta:g}")
right.legend(frameon=False)
figure.savefig(args.out / "swap_liquid.png", dpi=110)
print(args.out / "swap_liquid.png")
