"""Melting of hard disks: the loop of the pressure and the order psi_6, compared with published pressures.

python examples/melting_of_disks.py [--smoke] [--out DIR] [--sides 32 64]

In the plane the liquid and the hexatic phase coexist between packing fractions of about 0.700 and 0.716
(Bernard and Krauth, Phys. Rev. Lett. 107, 155704 (2011)). In a finite box the interface between them
costs free energy, and the pressure has a loop that flattens as the box grows. The susceptibility of the
order is largest where it sets in.

A run near 0.70 forgets its start after tens of thousands of collisions a disk. What is too short or
drifts is flagged, and drawn hollow. The box of random starts is square, as that of the published runs; no
perfect crystal fits.
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
import csv
from pathlib import Path

from matplotlib.figure import Figure

import carom
from carom.studies.eos import pictures

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few disks and collisions")
parser.add_argument("--out", type=Path, default=Path("melting-of-disks"), help="folder of the study")
parser.add_argument("--sides", type=int, nargs="+", default=[32], help="disks along an edge of the box")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)
if args.smoke:
    etas, crystals, sizes = [0.68, 0.72], [0.74], [100]
    length = {"equilibration": 50, "collisions_per_particle": 200, "replicas": 2, "frames": 64}
else:
    etas, crystals = [0.68, 0.69, 0.695, 0.70, 0.704, 0.708, 0.712, 0.716, 0.72], [0.73, 0.74]
    sizes = [side**2 for side in args.sides]
    length = {"equilibration": 10_000, "collisions_per_particle": 40_000, "replicas": 2, "frames": 64}

# %% Runs start at random in a square box, into which no perfect crystal fits, like the published ones. In a
# box made for a crystal of a thousand disks it would be more stable than in a large system, and the loop many
# times deeper. Beyond melting a random start freezes into grains, so these points start as a crystal. What is
# not in equilibrium is flagged by the drift of the pressure or of psi_6, or because replicas disagree.
study = carom.equation_of_state(
    etas, dimension=2, n=sizes, lattice="none", out=args.out / "melting", **length
)
crystal = carom.equation_of_state(
    crystals, dimension=2, n=sizes, lattice="triangular", out=args.out / "crystal", **length
)
for row in [*study.table, *crystal.table]:
    pressure, error = f"P* = {row.reduced_pressure:.4f}", row.reduced_pressure_error
    pressure += f" +- {error:.4f}" if error > 0.0 else ""
    order = f"|psi_6| = {row.order:.3f}, susceptibility {row.susceptibility:.1f}"
    print(f"eta = {row.packing_fraction:.3f}, N = {row.n}: {pressure}, {order}  {'; '.join(row.remarks)}")

# %% Published pressures of the same sizes, and of a large system.
with (Path(__file__).parent / "data" / "hard_disks_pressure.csv").open(encoding="utf-8") as file:
    published = list(csv.DictReader(line for line in file if not line.startswith("#")))

# %% The loop: in a finite system the interface between the two phases costs free energy, and the pressure
# falls where they coexist; the larger the system, the flatter.
figure = Figure(figsize=(7.0, 4.6), dpi=160, layout="constrained")
axes = figure.add_subplot()
for number, n in enumerate(sorted({row.n for row in study.table})):
    rows = [row for row in study.table if row.n == n]
    axes.errorbar(
        [row.packing_fraction for row in rows],
        [row.reduced_pressure for row in rows],
        [row.reduced_pressure_error for row in rows],
        fmt="os"[number % 2] + "-",
        color=("#1f4e79", "#c0392b")[number % 2],
        markersize=4,
        capsize=2,
        linewidth=1.0,
        label=f"Carom, $N$ = {n}",
        zorder=4,
    )
shown = {
    ("Jaster 1999", 1024): "^",
    ("Jaster 1999", 4096): "v",
    ("Li 2022", 16384): "D",
    ("Engel 2013", 65536): "x",
}
for (source, n), marker in shown.items():
    rows = [row for row in published if (row["source"], int(row["n"])) == (source, n)]
    axes.errorbar(
        [float(row["packing_fraction"]) for row in rows], [float(row["pressure"]) for row in rows],
        [float(row["error"]) for row in rows], fmt=marker, color="#777777", markerfacecolor="white",
        markersize=4.5, capsize=2, linewidth=0.8, label=f"{source}, $N$ = {n}", zorder=3,
    )  # fmt: skip
axes.set_xlim(min(etas) - 0.005, max(etas) + 0.005)
axes.set_xlabel(r"packing fraction $\eta$")
axes.set_ylabel(r"pressure $P\sigma^2/kT$")
axes.spines[["top", "right"]].set_visible(False)
axes.legend(fontsize=8, frameon=False)
figure.savefig(args.out / "pressure.png")

# %% Order and its fluctuations, which are largest at the transition.
pictures.order(study, path=args.out / "order.png")
print(f"Pictures are in {args.out}.")
