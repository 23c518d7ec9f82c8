"""How many particles are enough: Z against 1/N, extrapolated, compared with the correction by theory.

python examples/finite_size.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
from pathlib import Path

import carom
from carom.studies.eos import pictures

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("finite-size"), help="folder of the study")
args = parser.parse_args()
sizes, error = ((108, 256), 2e-2) if args.smoke else ((108, 256, 500, 1372, 4000), 3e-4)

# %% Two densities of the fluid, and one of the crystal, at five sizes.
study = carom.equation_of_state([0.20, 0.45, 0.60], n=sizes, relative_error=error, out=args.out)
print(study)

# %% A line through each: where it meets 1/N = 0 is Z of infinitely many, and its slope is what a size costs.
# The fluid's slope comes from the fluctuations of density that a closed box forbids, the crystal's from the
# one vibration that N particles have less than N: -(Z - 1). Sizes too small for a line are left out.
for fit in study.extrapolate():
    print(
        f"eta = {fit.packing_fraction:.2f}: Z = {fit.Z:.5f} +- {fit.Z_error:.5f}, "
        f"slope {fit.slope:.2f} +- {fit.slope_error:.2f}, by theory {fit.theory_slope:.2f}, "
        f"from N = {fit.sizes[0]} on"
    )

# %% One panel a density.
args.out.mkdir(parents=True, exist_ok=True)
pictures.sizes(study, path=args.out / "finite-size.png")
print(f"A picture is in {args.out}.")
