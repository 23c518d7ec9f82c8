"""Oscillating shear: storage and loss modulus of a dense fluid of spheres against the frequency.

python examples/oscillating_shear.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the picture goes.
import argparse
import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom.figures import style
from carom.models import Shear
from carom.observables import ShearModuli, averages

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and short runs")
parser.add_argument("--out", type=Path, default=Path("oscillating-shear"), help="folder of the picture")
args = parser.parse_args()
n, periods = (64, 4) if args.smoke else (500, 100)
eta, strain, rate = 0.45, 0.1, 0.4  # strain and rate are small at every frequency

# %% The stream heats the fluid, so the temperature is set again before each period.
print("frequency  G'               G''              viscosity")
frequencies = np.geomspace(0.3, 30.0, 3 if args.smoke else 9)
moduli = []
for frequency in frequencies:
    period = 2.0 * math.pi / frequency
    shear = Shear(min(strain * frequency, rate), period=period)
    sim = carom.Simulation(carom.Scene.random(n, eta, seed=1, motion=shear), kT=1.0, seed=1)
    sim.run(time=max(20.0, period))
    found = []
    for _ in range(periods):
        sim.rescale(1.0)
        one = sim.measure(ShearModuli(), time=period, blocks=16)
        found.append([one.storage.mean, one.loss.mean])
    storage, loss = averages(found)
    moduli.append((storage, loss))
    print(f"{frequency:9.3g}  {storage.value_text:15}  {loss.value_text:15}  {loss.mean / frequency:.3g}")

# %% The picture, with the viscosity of a steady shear.
steady = carom.shear([0.1], n=n, packing_fraction=eta, strains=2 if args.smoke else 60, executor="serial")
viscosity = steady.table[0].viscosity
print(f"viscosity of a steady shear: {viscosity:.3g}")
args.out.mkdir(parents=True, exist_ok=True)
style.use()  # colors
figure = Figure(figsize=(5.6, 4.0), layout="constrained")
axes = figure.subplots()
for k, name in enumerate((r"storage modulus $G'$", r"loss modulus $G''$")):
    values, errors = ([getattr(each[k], what) for each in moduli] for what in ("mean", "error"))
    axes.errorbar(frequencies, values, errors, fmt="o", color=f"C{k}", label=name)
axes.plot(
    frequencies, viscosity * frequencies, "k--", label=r"$\omega$ times the viscosity of a steady shear"
)
axes.set_xscale("log")
axes.set_yscale("log", nonpositive="mask")
axes.set_ylim(bottom=0.1)
axes.set_xlabel(r"frequency $\omega\,/\,\sqrt{kT/m\sigma^2}$")
axes.set_ylabel(r"modulus $/\,(kT/\sigma^3)$")
axes.legend(frameon=False)
figure.savefig(args.out / "oscillating_shear.png", dpi=110)
print(args.out / "oscillating_shear.png")
