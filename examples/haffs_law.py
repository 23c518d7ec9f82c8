"""Haff's law: a gas of spheres that lose energy cools as T = T0 / (1 + t / tau)^2.

python examples/haffs_law.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom import theory
from carom.figures import style

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and samples")
parser.add_argument("--out", type=Path, default=Path("haffs-law"), help="folder of the picture")
args = parser.parse_args()
cells, end = (3, 40.0) if args.smoke else (8, 4000.0)
restitution, density = 0.9, 0.1

# %% An elastic fluid first, so that it starts as a gas, not as a crystal; then contacts lose energy.
start = carom.Simulation(carom.Scene.crystal(cells=cells, packing_fraction=np.pi / 6.0 * density), seed=1)
start.run(collisions_per_particle=20)
fluid = start.scene.replace(
    positions=start.frame().positions, velocities=start.frame().velocities, impact=restitution
)
sim = carom.Simulation(fluid)
kT = sim.kT

# %% The temperature at times that grow.
times = np.geomspace(1.0, end, 30)
measured = []
for time in times:
    sim.run(time=time - sim.time)
    measured.append(sim.kT / kT)

# %% Haff's law: tau = 2 d / ((1 - e^2) omega0) with the collision rate omega0 at the start. The velocities
# of a cooling gas are not quite Maxwell's: that changes the rate by 1 + 3 a2 / 16 (van Noije, Ernst 1998).
e, d = restitution, 3
a2 = 16.0 * (1.0 - e) * (1.0 - 2.0 * e * e)
a2 /= 9.0 + 24.0 * d + 8.0 * d * e - 41.0 * e + 30.0 * e * e * (1.0 - e)
rate = theory.collision_rate(theory.best(3)(np.pi / 6.0 * density), 3, kT=kT) * (1.0 + 3.0 * a2 / 16.0)
tau = 2.0 * d / ((1.0 - e * e) * rate)
law = (1.0 + times / tau) ** -2
off = np.abs(np.array(measured) / law - 1.0)
print(f"{fluid.n} spheres, restitution {restitution}: kT fell to {measured[-1]:.2e} of what it was")
print(
    f"compared with Haff's law: off by {off[law > 5e-4].max():.1%} at most down to 5e-4, "
    f"by {off[-1]:.1%} at the end"
)

# %% The picture.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(6.4, 4.2), layout="constrained")
axes = figure.subplots()
axes.loglog(times, measured, "o", ms=4.0, label=f"{fluid.n} spheres")
axes.loglog(times, law, label="Haff's law")
axes.set_xlabel("time")
axes.set_ylabel("temperature / that at the start")
axes.legend(frameon=False)
figure.savefig(args.out / "haffs_law.png", dpi=110)
print(args.out / "haffs_law.png")
