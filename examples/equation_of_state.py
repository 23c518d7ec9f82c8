"""The equation of state of hard spheres in ten lines: measured on all cores, compared with theory.

python examples/equation_of_state.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
from pathlib import Path

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("equation-of-state"), help="folder of the study")
args = parser.parse_args()
n, error = (108, 2e-2) if args.smoke else (1372, 2e-4)

# %% The study: twelve densities of the fluid, two runs of each. Run it again, and nothing is left to do.
study = carom.equation_of_state(n=n, relative_error=error, out=args.out)

# %% The table: Z of n spheres, of infinitely many, and by the best equation known; deviations in errors.
print(study)

# %% What the dilute points say about the virial coefficients; the exact ones in brackets.
print(study.virials())

# %% Pictures and tables.
study.plot(args.out / "eos.png")
study.save(args.out / "eos.csv")
study.report(args.out / "report.html")
print(f"Pictures and a report are in {args.out}.")
