"""The paper's 2000 disks after 42 million collisions: bonds drawn, rattlers dotted.

    python examples/disks_2000.py [--smoke] [--out disks_2000]

After Lubachevsky (1991), sec. 9. The whole run takes about half a minute; Ctrl-C stops it, and
`carom resume disks_2000` goes on.
"""

# %% Arguments: --smoke makes 50 disks and fewer collisions, --out is the folder for the results.
import argparse
from pathlib import Path

import carom
from carom.observables import packing_network
from carom.pictures import plots

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="50 disks, 300 000 collisions")
parser.add_argument("--out", type=Path, default=Path("disks_2000"), help="folder for the results")
args = parser.parse_args()
n, collisions, rate = (50, 300_000, 0.002) if args.smoke else (2000, 42_000_000, 0.0013)

# %% Slow growth lets large parts of the disks order: grains of the triangular lattice with gaps between them,
# in which the rattlers are.
packing = carom.pack(
    n, dimension=2, rate=rate, collisions=collisions, seed=1, out=args.out,
    overwrite=True, pictures=False,
)  # fmt: skip
print(packing)

# %% Within a grain gaps are of every size, so no void among them tells contacts from near contacts.
# Significant rattlers are those that have fewer than three others within a thousandth of a diameter.
network = packing_network(packing.frame, gap=1e-3, sided=False)
print(network)

# %% The picture: a line for every contact, rattlers dotted. The folder has the frame and the history, too.
plots.packing(network, path=args.out / "disks.png")
print(args.out / "disks.png")
