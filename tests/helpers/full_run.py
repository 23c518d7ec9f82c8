"""A small run with all that a folder can hold: walls, an obstacle, species, a log, three formats."""

import os
import signal
from pathlib import Path

import pytest

import carom
from carom.scene_file.scene_file import SceneFile

PLAN = """
[scene]
dimension = 2
packing_fraction = 0.2
walls = "y"
obstacles.ball = {{ type = "ball", center = [2, 2], radius = 0.6 }}
species.large = {{ count = 20, diameter = 1.0 }}
species.small = {{ count = 28, diameter = 0.6, mass = 0.3 }}

[run]
seed = 3
equilibration = {equilibration}
collisions_per_particle = {measured}
frames = {frames}
checkpoint_every = 0.02
event_log = true
pictures = false
write = ["h5md", "extxyz", "gsd"]
"""


RUN = """
[run]
seed = 4
equilibration = 200
collisions_per_particle = {measured}
frames = 64
checkpoint_every = 0.02
event_log = true
pictures = false
write = ["h5md", "extxyz"]
"""

OTHERS = {
    "wells": (
        """
[scene]
lattice = "fcc"
cells = 2
density = 0.3

[scene.interaction]
type = "square-well"
""",
        20000,
    ),
}
"""Other physics: a scene, and its collisions per particle for about a second."""


def other(name):
    """Return the plan of one of them."""
    scene, measured = OTHERS[name]
    return SceneFile.from_toml(scene + RUN.format(measured=measured))


def plan(*, equilibration=200, measured=1000, frames=16, without=()):
    """Return the plan, some formats left out."""
    text = PLAN.format(equilibration=equilibration, measured=measured, frames=frames)
    for form in without:
        text = text.replace(f', "{form}"', "").replace(f'"{form}", ', "")
    return SceneFile.from_toml(text)


def stopped(given: SceneFile, out: Path, stage: str = "Measuring", after: float = 0.5) -> Path:
    """Begin a run and press Ctrl-C when so much of a stage is done."""

    def impatient(fraction, now):
        if now == stage and fraction > after:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(carom.Interrupted, match=r"carom resume .* goes on"):
        carom.run(given, out, progress=impatient)
    return out
