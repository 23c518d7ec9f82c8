"""What Carom says to what it cannot simulate: one sentence each, and no file is changed.

python examples/bad_input_tour.py [--smoke] [--out DIR]
"""

# %% Arguments: the tour is as short as it can be, so --smoke changes nothing.
import argparse
import math
from collections.abc import Callable
from pathlib import Path

import carom
from carom.scene_file.scene_file import SceneFile

parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--smoke", action="store_true", help="no difference here")
parser.add_argument("--out", type=Path, default=Path("tour"), help="folder of the bad files")
args = parser.parse_args()
args.out.mkdir(parents=True, exist_ok=True)


def attempt(what: str, action: Callable[[], object]) -> None:
    """Do what cannot be done, and show the sentence."""
    try:
        action()
    except carom.CaromError as error:
        print(f"{what}\n    {type(error).__name__}: {error}")
    else:
        raise AssertionError(f"{what} was accepted")


# %% Spheres that overlap: the error names the pair and the depth.
attempt("Two spheres too close", lambda: carom.Scene([[0.0, 0.0, 0.0], [0.9, 0.0, 0.0]], box=5.0))
attempt("A box too full", lambda: carom.Scene.crystal(256, 0.75))
attempt("Too full for random places", lambda: carom.Scene.random(n=100, packing_fraction=0.73, seed=1))

# %% Numbers that are none.
attempt("Not a number", lambda: carom.Scene([[math.nan, 0.0]], box=5.0))
attempt("No particle", lambda: carom.Scene.random(n=0, packing_fraction=0.3))
attempt("A box of no size", lambda: carom.Scene([[0.0, 0.0]], box=(5.0, 0.0)))
attempt("A box as wide as a sphere", lambda: carom.Scene([[0.0, 0.0]], box=1.0))

# %% Runs without an end, or with an impossible one.
sim = carom.Simulation(carom.Scene.crystal(32, 0.3), seed=1)
attempt("A run without a limit", lambda: sim.run())
attempt("A negative time", lambda: sim.run(time=-1.0))
attempt("A sample in the past", lambda: list(sim.sample(times=[-1.0])))

# %% Scene files: an unknown key gets the nearest known one.
attempt("A misspelt key", lambda: SceneFile.from_toml("[scene]\npacking_fracton = 0.4"))
attempt("A wrong type", lambda: SceneFile.from_toml('[scene]\npacking_fraction = "0.4"'))
attempt("A unit", lambda: SceneFile.from_toml("[scene]\ndiameter = 1.0 nm"))
attempt("No TOML at all", lambda: SceneFile.from_toml("scene: {n: 4}"))

# %% Files: missing, foreign, cut short.
attempt("A missing file", lambda: carom.io.read(args.out / "nowhere.h5md"))
foreign = args.out / "foreign.h5md"
foreign.write_bytes(b"This is a letter to my aunt.")
attempt("A foreign file", lambda: carom.io.read(foreign))
whole = args.out / "whole.h5md"
with carom.io.open(whole, "w") as writer:
    writer.write(sim.frame())
cut = args.out / "cut.h5md"
cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
attempt("A file cut short", lambda: carom.io.read(cut))
attempt("A file that is there already", lambda: carom.io.open(whole, "x"))

# %% The command line says the same sentences, with exit code 2 and no traceback.
