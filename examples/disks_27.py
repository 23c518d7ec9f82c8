"""The paper's 27 disks: points that grow while they move until they jam, and the rattlers.

    python examples/disks_27.py [--smoke] [--out disks_27.png]

After Lubachevsky (1991), sec. 9, "27 disks after 100000 collisions; disk 24 is a rattler".
"""

# %% Arguments: --smoke makes fewer collisions, --out says where the picture goes.
import argparse
from pathlib import Path

import carom

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a tenth of the collisions")
parser.add_argument("--out", type=Path, default=Path("disks_27.png"), help="file of the picture")
args = parser.parse_args()
collisions = 10_000 if args.smoke else 100_000

# %% Random points in a square with periodic boundaries, and a common rate of growth. The velocities are
# scaled back and balanced every few collisions per disk, because every contact of growing disks adds energy.
rate = 0.05 if args.smoke else 0.006
for seed in range(1, 10):
    packing = carom.pack(27, dimension=2, rate=rate, collisions=collisions, seed=seed)
    if len(packing.rattlers) == 1:  # as in the paper; some starts jam without one
        break
print(f"seed {seed}, {packing.note}")
print(f"packing fraction {packing.packing_fraction:.6f}, Z = PV/NkT = {packing.Z:.2e}")
print(f"jams at {packing.jamming_fraction:.8f}")

# %% Disks count from 1, as in the paper. The gap that tells contacts from near contacts is chosen where the
# sorted gaps leap most.
network = packing.network
print(f"{network.contacts} contacts with a gap below {network.gap:.1e}; isostatic are {network.isostatic}")
print("rattlers:", ", ".join(str(i + 1) for i in packing.rattlers) or "none")

# %% The picture: a line for every contact, a dot in every rattler.
args.out.parent.mkdir(parents=True, exist_ok=True)
path = args.out if args.out.suffix else args.out.with_suffix(".png")
packing.plot(path)
print(path)
