"""A square-well fluid: g(r) with its jump, its pressure by two routes, drops of disks, and a chain.

    python examples/square_well.py [--smoke] [--out square_well.png]

Alder and Wainwright's second model (J. Chem. Phys. 31 (1959) 459), and beads on a string.
"""

# %% Arguments: --smoke makes a short run and a small picture, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection

import carom
from carom.figures import style
from carom.models import Bonds, SquareWell, chains

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few events, a small picture")
parser.add_argument("--out", type=Path, default=Path("square_well.png"), help="file of the picture")
args = parser.parse_args()
LONG = 20 if args.smoke else 400  # events a particle


# %% A fluid above its critical point. Wells heat what falls into them: equilibrate() scales several times.
# What arrives at a step counts g(r) on both of its sides.
cells = 4 if args.smoke else 8
scene = carom.Scene.crystal(cells=cells, density=0.4).replace(interaction=SquareWell(range=1.5, depth=1.0))
sim = carom.Simulation(scene, seed=1)
sim.equilibrate(kT=1.5, collisions_per_particle=2 * LONG)
before = sim.interaction
pressure = sim.measure(carom.Pressure(), collisions=LONG * scene.n, blocks=32)
sums = sim.interaction - before
well, core = sums.sides()
print(
    f"kT = {sums.kT:.3f}, U / N = {sim.potential_energy / scene.n:.2f}, bonds {sums.bonds_per_particle:.2f}"
)
print(f"Z = {pressure.Z} from the virial, {sums.compressibility_factor():.4f} from g(r)")
jump = well.inside / well.outside
print(f"g(1.5-) / g(1.5+) = {jump:.3f}, and exp(1 / kT) = {math.exp(1.0 / sums.kT):.3f}")
gr = carom.RDF(rmax=3.0, width=0.02).over(sim.sample(every=0.2, count=10 if args.smoke else 100))

# %% Disks below the critical point come together in drops.
disks = carom.Scene.crystal(cells=12 if args.smoke else 32, dimension=2, packing_fraction=0.25)
drops = carom.Simulation(disks.replace(interaction=SquareWell(1.5, 1.0)), kT=0.4, seed=2)
drops.equilibrate(kT=0.4, collisions_per_particle=(2 if args.smoke else 8) * LONG)
bonds = drops.interaction.bonds_per_particle
print(f"disks at kT = {drops.kT:.2f}: {bonds:.2f} neighbors each in their wells")

# %% A chain of hard disks: neighbors on it are never further apart than 1.2 diameters.
length = 10 if args.smoke else 60
x = 4.0 + np.column_stack([1.1 * np.arange(length), 0.3 * (np.arange(length) % 2)])
chain = Bonds(chains(1, length), inner=1.0, outer=1.2, others=SquareWell(1.5, 0.5))
string = carom.Simulation(carom.Scene(x, 1.1 * length + 8.0, interaction=chain), kT=1.0, seed=3)
string.run(collisions_per_particle=20 * LONG)
print(f"a chain of {length}: {string.collisions} events, energy kept to {string.statistics.energy_drift:.1g}")

# %% The picture.
style.use()  # colors
figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.7))
left.plot(gr.r, gr.g, color="0.4", lw=1)
for side in (core, well):
    sides = [g for g in (side.inside, side.outside) if g > 0.0]  # nobody is inside a core
    left.plot([side.distance] * len(sides), sides, "o", color="C3", ms=5)
left.set(xlabel="$r / \\sigma$", ylabel="$g(r)$", title=f"density 0.4, kT = {sums.kT:.2f}", xlim=(0.8, 3))


def draw(axes, positions, title):
    """Disks of diameter 1 where they are."""
    sizes = np.ones(len(positions))
    disks = EllipseCollection(
        sizes, sizes, 0 * sizes, units="x", offsets=positions, transOffset=axes.transData,
        facecolor="C0", edgecolor="white", lw=0.2,
    )  # fmt: skip
    axes.add_collection(disks)
    axes.set(aspect="equal", xticks=[], yticks=[], title=title)


shape = drops.frame()
draw(middle, shape.positions, f"disks, kT = {drops.kT:.2f}")
middle.set(xlim=(0, shape.box[0]), ylim=(0, shape.box[1]))
bead = string.frame()
unwrapped = bead.positions + bead.images * np.array(bead.box)
draw(right, unwrapped, f"a chain of {length}")
right.plot(*unwrapped.T, color="C3", lw=1)
center, reach = unwrapped.mean(axis=0), np.abs(unwrapped - unwrapped.mean(axis=0)).max() + 1.5
right.set(xlim=(center[0] - reach, center[0] + reach), ylim=(center[1] - reach, center[1] + reach))
figure.tight_layout()
figure.savefig(args.out, dpi=60 if args.smoke else 100, format="png")
