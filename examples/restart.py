"""Stop a run, save it, continue: the result is bit-identical to an uninterrupted run.

python examples/restart.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small, --out says where the checkpoint goes.
import argparse
from pathlib import Path

import numpy as np

import carom
from carom.pictures import plots

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="a few spheres and collisions")
parser.add_argument("--out", type=Path, default=Path("restart"), help="folder of the checkpoint")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)
cells, collisions = (3, 20) if args.smoke else (6, 200)
scene = carom.Scene.crystal(cells=cells, packing_fraction=0.45)

# %% One run without a break.
whole = carom.Simulation(scene, kT=1.0, seed=1)
whole.run(collisions_per_particle=2 * collisions)

# %% The same one, stopped half way. The checkpoint holds every array; it appears complete or not at all.
checkpoint = args.out / "state.h5"
first = carom.Simulation(scene, kT=1.0, seed=1)
first.run(collisions_per_particle=collisions)
first.save(checkpoint)
del first

# %% Another day: the checkpoint alone is enough.
second = carom.Simulation.load(checkpoint)
print(f"Loaded at time {second.time:.6g}, after {second.collisions} collisions.")

# %% On the way it may be looked at, cut into pieces, sampled: none of it changes the run.
for frame in second.sample(every=0.01, count=3):
    print(f"A frame at time {frame.time:.6g}.")
second.run(collisions=whole.collisions - second.collisions)

# %% Bit for bit.
a, b = whole.frame(), second.frame()
assert a.time == b.time
assert np.array_equal(a.unwrapped, b.unwrapped)
assert np.array_equal(a.velocities, b.velocities)
print(f"After {second.collisions} collisions both runs are at time {b.time!r}, with the same bits.")

# %% Where both end.
plots.snapshot(b, path=args.out / "end.png")
