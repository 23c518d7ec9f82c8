"""Spherical codes: caps on a sphere that grow until they jam, the best of some tries, and a picture.

    python examples/caps_on_a_sphere.py [--smoke] [--out caps]

After Lubachevsky (1991), sec. 11, "optimal spherical codes" (Smith).
"""

# %% Arguments: --smoke makes one try, --out is the folder of the files.
import argparse
from pathlib import Path

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="one try instead of eight")
parser.add_argument("--out", type=Path, default=Path("caps"), help="folder of the files")
args = parser.parse_args()
tries = 1 if args.smoke else 8

# %% Twenty-four points: the snub cube, known since Robinson (1961). Every try is a run of the engine: random
# points move on great circles and grow into caps. The contacts of the best are solved for to 32 digits.
code = carom.spherical_code(24, tries=tries, executor="serial")
print(code)

# %% The file has one point a line, with all digits, as public tables of codes have.
args.out.mkdir(parents=True, exist_ok=True)
code.save(args.out / "snub_cube.txt")
print(args.out / "snub_cube.txt")

# %% The picture: a color for each number of contacts, a line for every contact.
code.plot(args.out / "snub_cube.png", pixels=600)
print(args.out / "snub_cube.png")

# %% Nineteen points leave one cap loose: the search names it.
loose = carom.spherical_code(19, tries=2 * tries, executor="serial")
print(f"{loose.n} points, {loose.angle:.9f} degrees, rattlers: {loose.rattlers.tolist()}")
