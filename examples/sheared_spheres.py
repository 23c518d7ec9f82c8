"""Sheared spheres: viscosity and temperature of grains that lose energy, smooth and rough, from events alone.

python examples/sheared_spheres.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
from pathlib import Path

from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Restitution, Rough, Shear

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and short runs")
parser.add_argument("--out", type=Path, default=Path("sheared-spheres"), help="folder of the picture")
args = parser.parse_args()
n, strain, blocks = (100, 20.0, 16) if args.smoke else (1000, 300.0, 128)

# %% The box flows at rate 1. Collisions lose a tenth of the normal velocity, and rough spheres rub, too.
laws = {
    "smooth": Restitution(0.9),
    "rough, friction 0.3": Rough(0.9, tangential=0.0, friction=0.3),
}
fractions = [0.1, 0.2, 0.3, 0.4, 0.45]
print("contacts              packing fraction  viscosity         kT")
results = {name: [] for name in laws}
for name, law in laws.items():
    for eta in fractions:
        scene = carom.Scene.random(n, eta, seed=1, motion=Shear(1.0), impact=law)
        sim = carom.Simulation(scene, kT=1.0, seed=1)
        sim.run(time=0.2 * strain)  # until what the stream gives is what collisions lose
        flow, pressure = sim.measure(carom.PressureTensor(), carom.Pressure(), time=strain, blocks=blocks)
        results[name].append((flow.viscosity, pressure.kT))
        print(f"{name:20}  {eta:16.2f}  {flow.viscosity.value_text:16}  {pressure.kT:.3f}")

# %% The picture.
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(8.4, 3.8), layout="constrained")
left, right = figure.subplots(1, 2)
for k, (name, found) in enumerate(results.items()):
    values = [viscosity.mean for viscosity, _ in found]
    errors = [viscosity.error for viscosity, _ in found]
    left.errorbar(fractions, values, errors, fmt="o-", color=f"C{k}", label=name)
    right.plot(fractions, [kT for _, kT in found], "o-", color=f"C{k}", label=name)
left.set_xlabel("packing fraction η")
left.set_ylabel("viscosity / (m / σ · rate)")
left.set_ylim(bottom=0.0)
left.legend(frameon=False)
right.set_yscale("log")
right.set_xlabel("packing fraction η")
right.set_ylabel("kT / (m σ² · rate²)")
figure.savefig(args.out / "sheared_spheres.png", dpi=110)
print(args.out / "sheared_spheres.png")
