"""Freezing of hard spheres: fluid and crystal, measured, and the pressure at which they coexist.

python examples/freezing_of_spheres.py [--smoke] [--out DIR]

Equal pressure alone does not determine coexistence: the chemical potentials must be equal as well. That
of the fluid follows from its equation of state, integrated from zero density. A crystal does not connect
to zero density, so one free energy comes from the literature: 5.91901 NkT beyond that of the ideal gas,
at a density of 1.0409 (Schultz and Kofke).

A fluid at 0.49 that starts as a crystal stays one, and its pressure does not drift. Studies therefore
start fluids at random, and flag a fluid whose particles have not moved.
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import carom
from carom import theory

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("freezing-of-spheres"), help="folder of the studies")
args = parser.parse_args()
n, error = (108, 1e-2) if args.smoke else (4000, 2e-4)

# %% The two branches: a fluid that starts at random, and a crystal that starts as fcc and goes on a little
# below melting, as a metastable state that lives longer than these runs.
fluid = carom.equation_of_state(
    [0.40, 0.43, 0.46, 0.48, 0.49], n=n, relative_error=error, lattice="none", out=args.out / "fluid"
)
crystal = carom.equation_of_state(
    [0.53, 0.54, 0.55, 0.57, 0.60], n=n, relative_error=error, lattice="fcc", out=args.out / "crystal"
)
print(fluid, crystal, sep="\n")


# %% Each branch as an equation of state of its own: theory, with Z - 1 corrected by a line through what was
# measured. Towards zero density, where theory is best, the correction fades.
def fitted(study, equation):
    rows = [row for row in study.table if row.equilibrated]
    eta = np.array([row.packing_fraction for row in rows])
    known = equation(eta) - 1.0
    ratio = np.array([row.Z_infinite - 1.0 for row in rows]) / known - 1.0
    line = np.polynomial.Polynomial.fit(
        eta, ratio, min(1, len(rows) - 1), w=known / [row.Z_error for row in rows]
    )
    low, high = eta.min(), eta.max()

    def measured(x):
        return 1.0 + (equation(x) - 1.0) * (1.0 + line(np.clip(x, low, high)) * np.minimum(x / low, 1.0) ** 8)

    return measured


# %% Equal pressure and equal chemical potential. The fluid's free energy is the integral of its equation of
# state from zero density; the crystal's needs one number more, which is known from other simulations.
measured = theory.coexistence(fitted(fluid, theory.pieprzyk), fitted(crystal, theory.almarza))
published = theory.coexistence()
for name, found in (("measured", measured), ("theory", published)):
    print(
        f"{name}: coexistence at P* = {found.pressure:.4f}, freezing {found.freezing:.5f}, "
        f"melting {found.melting:.5f}"
    )

# %% The picture: pressure against packing fraction, and the tie line between the phases.
figure = Figure(figsize=(7.0, 4.6), dpi=160, layout="constrained")
axes = figure.add_subplot()
volume = theory.ball_volume(3)
for equation, low, high, name in (
    (theory.pieprzyk, 0.39, 0.51, "Pieprzyk et al."), (theory.almarza, 0.52, 0.61, "Almarza")
):  # fmt: skip
    eta = np.linspace(low, high, 100)
    axes.plot(eta, equation(eta) * eta / volume, color="#555555", linewidth=1.0, label=name)
for study, marker, name in ((fluid, "o", "fluid"), (crystal, "s", "crystal")):
    rows = study.table
    eta = np.array([row.packing_fraction for row in rows])
    pressure = eta / volume * [row.Z_infinite for row in rows]
    axes.plot(eta, pressure, marker, color="#1f4e79", markersize=4.5, label=name)
axes.plot(
    [measured.freezing, measured.melting], [measured.pressure] * 2, color="#c0392b", linewidth=1.4,
    label=f"coexistence, $P^* = {measured.pressure:.3f}$",
)  # fmt: skip
axes.set_xlabel(r"packing fraction $\eta$")
axes.set_ylabel(r"pressure $P\sigma^3/kT$")
axes.spines[["top", "right"]].set_visible(False)
axes.legend(fontsize=8.5, frameon=False)
figure.savefig(args.out / "freezing.png")
print(f"A picture is in {args.out}.")
