"""Write one run for several programs: H5MD, extended XYZ and GSD, then read it with ASE.

python examples/export_ovito_ase.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the files go.
import argparse
from pathlib import Path

import ase.io
import numpy as np

import carom
import carom.io
from carom.pictures import plots

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few particles and frames")
parser.add_argument("--out", type=Path, default=Path("export"), help="folder of the files")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)

# %% A fluid of hard spheres, sampled into the native store.
scene = carom.Scene.crystal(cells=2 if args.smoke else 6, packing_fraction=0.4)
sim = carom.Simulation(scene, kT=1.0, seed=1)
sim.run(collisions_per_particle=5 if args.smoke else 50)
with carom.io.open(args.out / "fluid.h5md", "w", scene) as writer:
    for frame in sim.sample(every=0.1, count=3 if args.smoke else 50):
        writer.write(frame)

# %% Extended XYZ: open it in OVITO (File > Load File), or read it with ASE. No bit is lost.
carom.io.convert(args.out / "fluid.h5md", args.out / "fluid.extxyz", overwrite=True)
trajectory = ase.io.read(args.out / "fluid.extxyz", index=":")
last = trajectory[-1]
assert np.array_equal(last.positions, frame.positions)
assert np.array_equal(last.get_velocities(), frame.velocities)
print(
    f"ASE reads {len(trajectory)} frames of {len(last)} particles; the last is at time {last.info['time']:g}."
)

# %% In memory there is no need for a file, and the way back is as short.
atoms = frame.to_ase()
again = carom.io.from_ase(atoms)
assert np.array_equal(again.positions, frame.positions)
print(f"As ase.Atoms: radius {atoms.arrays['radius'][0]:g}, cell {atoms.cell.lengths()}.")

# %% GSD is compact (float32) and understood by OVITO, freud and HOOMD-blue: pip install "carom[gsd]".
try:
    carom.io.convert(args.out / "fluid.h5md", args.out / "fluid.gsd", overwrite=True)
except carom.InputError as error:
    print(f"No GSD file: {error}")

# %% A picture needs no other program.
plots.snapshot(frame, path=args.out / "snapshot.png")

# %% What was written.
for path in sorted(args.out.glob("fluid.*")):
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB, {len(carom.io.read(path, ':'))} frames")
