"""Transport of hard spheres: the coefficients compared with Enskog's theory, and the long-time tail.

python examples/transport.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom import theory
from carom.figures import style
from carom.observables import Dynamics

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("transport"), help="folder of the study")
args = parser.parse_args()
if args.smoke:
    etas, n, length, many, count = [0.1, 0.3], 32, {"collisions_per_particle": 1500, "replicas": 1}, 108, 200
else:
    etas, n, length, many, count = [0.05, 0.1, 0.2, 0.3, 0.4, 0.45], 500, {"relative_error": 0.03}, 4000, 4000

# %% Helfand's moments are sums over collisions: there is no time step. Four runs a density.
study = carom.transport(etas, n=n, out=args.out / "study", **length)
print(study)

# %% The velocity autocorrelation of many spheres at a density of 0.5, without storing a frame.
eta = 0.5 * np.pi / 6.0
sim = carom.Simulation(carom.Scene.random(many, eta, seed=1), seed=1)
sim.run(collisions_per_particle=100)
free_time = float(theory.mean_free_time(theory.best(3)(eta), 3))
found = sim.measure(Dynamics(), time=0.25 * free_time * count, blocks=count)
enskog = theory.enskog(theory.best(3)(eta), eta, 3)
diffusion = enskog.self_diffusion * theory.erpenbeck_wood(eta)
tail = theory.velocity_tail(0.5, diffusion, enskog.shear_viscosity, 3)

# %% Left: what Enskog's theory leaves out. Right: the tail, as mode coupling has it, without a fit.
style.use()  # colors
figure = Figure(figsize=(9.6, 4.2), layout="constrained")
left, right = figure.subplots(1, 2)
rows = study.points
for name, marker in (
    ("self_diffusion", "o"), ("shear_viscosity", "s"), ("bulk_viscosity", "D"), ("thermal_conductivity", "^")
):  # fmt: skip
    points = [(row.packing_fraction, *row.quantities()[name]) for row in rows]
    x = [eta for eta, _, _ in points]
    y = [c.mean / theirs for _, c, theirs in points]
    e = [c.error / theirs for _, c, theirs in points]
    left.errorbar(x, y, e, fmt=marker, ms=5, capsize=2, lw=1, label=name.replace("_", " ") + f", N = {n}")
infinite = [row.self_diffusion_infinite.mean / row.enskog.self_diffusion for row in rows]
left.plot([row.packing_fraction for row in rows], infinite, "o", mfc="none", ms=8, c="C0", label="infinite N")
line = np.linspace(0.0, 0.47, 100)
left.plot(line, theory.erpenbeck_wood(line), c="C0", lw=1, label="Erpenbeck and Wood (1991)")
left.axhline(1.0, c="0.6", lw=0.8)
left.set(xlabel="packing fraction", ylabel="coefficient / Enskog's", ylim=(0.5, 1.9))
left.legend(fontsize=8, frameon=False, loc="upper left")

t, y, e = found.times, found.velocity_autocorrelation, found.velocity_autocorrelation_error
noisy = np.flatnonzero(y < 2.0 * e)  # from the first on it is all noise
if noisy.size and noisy[0]:
    t, y, e = t[: noisy[0]], y[: noisy[0]], e[: noisy[0]]
right.errorbar(t / free_time, y, e, fmt=".", ms=4, lw=0.8, label=f"measured, N = {many}")
late = np.geomspace(4.0, max(30.0, t[-1] / free_time), 50)
right.plot(late, tail * (late * free_time) ** -1.5, c="C1", label="mode coupling")
decay = np.exp(-t / enskog.self_diffusion)
right.plot(t / free_time, np.where(decay > 1e-4, decay, np.nan), c="0.5", ls="--", label="Enskog")
right.set(xscale="log", yscale="log", xlabel="time / mean free time", ylabel=r"$\langle v(0)v(t)\rangle / d$")
right.set_ylim(2e-4, 1.5)
right.legend(fontsize=8, frameon=False)
figure.savefig(args.out / "transport.png", dpi=110)
print(f"A picture is in {args.out}.")
