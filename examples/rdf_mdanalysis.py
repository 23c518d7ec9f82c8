"""The radial distribution function g(r) of a file with MDAnalysis, in three dimensions and in two.

python examples/rdf_mdanalysis.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the files go.
import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from MDAnalysis.analysis.rdf import InterRDF

import carom
import carom.io
from carom.figures import style

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few particles and frames")
parser.add_argument("--out", type=Path, default=Path("rdf"), help="folder of the files")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)


# %% A run, and its file.
def simulate(scene: carom.Scene, path: Path) -> None:
    """Let the scene forget its lattice, then write frames of it."""
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.run(collisions_per_particle=20 if args.smoke else 200)
    with carom.io.open(path, "w", scene) as writer:
        for frame in sim.sample(every=0.5, count=3 if args.smoke else 100):
            writer.write(frame)


spheres = carom.Scene.crystal(cells=3 if args.smoke else 6, packing_fraction=0.4)
disks = carom.Scene.random(n=100 if args.smoke else 1000, dimension=2, packing_fraction=0.4, seed=1)
simulate(spheres, args.out / "spheres.h5md")
simulate(disks, args.out / "disks.h5md")

# %% Three dimensions: InterRDF as it is. `exclusion_block` leaves out each particle's distance to itself.
# `range` must end at half the shortest edge, beyond which a periodic box hides some distances.
# MDAnalysis.Universe("spheres.h5md") opens the file just as well; universe() also knows radii and masses.
BINS = 100
atoms = carom.io.universe(args.out / "spheres.h5md").atoms
r_max = min(spheres.box) / 2
rdf3 = InterRDF(atoms, atoms, nbins=BINS, range=(0.0, r_max), exclusion_block=(1, 1)).run().results

# %% Two dimensions: InterRDF always divides by the volume of a spherical shell. So take the bare counts
# (norm="none", which are a mean over frames) and divide by what an ideal gas has in a ring.
atoms = carom.io.universe(args.out / "disks.h5md").atoms
r_max = min(disks.box) / 2
rdf2 = (
    InterRDF(atoms, atoms, nbins=BINS, range=(0.0, r_max), exclusion_block=(1, 1), norm="none").run().results
)
rings = np.pi * np.diff(rdf2.edges**2)
g2 = rdf2.rdf / (disks.n * (disks.n - 1) * rings / np.prod(disks.box))

# %% Hard particles: nothing below one diameter, a peak at contact, and 1 far away.
for name, r, g in (("spheres", rdf3.bins, rdf3.rdf), ("disks", rdf2.bins, g2)):
    width = r[1] - r[0]
    assert np.all(g[r < 1.0 - width] == 0.0), "particles overlap"
    far = g[r > 0.7 * r[-1]].mean()
    print(f"{name}: g is {g.max():.3f} at its peak, r = {r[np.argmax(g)]:.3f}, and {far:.3f} far away")
    style.use()  # colors
    plt.plot(r, g, label=name)
plt.xlabel("r / diameter")
plt.ylabel("g(r)")
plt.legend()
plt.savefig(args.out / "rdf.png", dpi=150)
