"""``kill -9`` while diameters grow, with walls, an obstacle and species; an event log is refused there."""

import random
import subprocess
import sys

import numpy as np
import pytest
from helpers import commands
from helpers.commands import carom, complaints, datasets, wait_for

pytestmark = [
    pytest.mark.slow,
    pytest.mark.needs("Unix"),
]

GROWS = """
import sys
from pathlib import Path
import numpy as np
from carom import Scene, Simulation, Species
from carom.models import Ball
from carom.simulation import stretches

folder = Path(sys.argv[1])
state = folder / "checkpoint.h5"
if state.exists():
    sim = Simulation.load(state)
else:
    scene = Scene.random(
        species=[Species(count=20), Species(count=28, diameter=0.6, mass=0.3)], dimension=2,
        packing_fraction=0.2, walls="y", obstacles=[Ball((2, 2), 0.6)], seed=3,
    )
    sim = Simulation(scene, seed=3, growth=2e-4)
while sim.collisions < 12_000:
    sim.run(collisions=100)
    sim.save(state)
frame, kept = sim.frame(), folder / "end.partial"
with kept.open("wb") as file:
    sums = [stretches.tally(sim).virial, *(side.impulse for side in sim.obstacles)]
    parts = frame.positions, frame.velocities, frame.diameters, frame.images, sums
    np.savez(file, *parts, sim.collisions_by_species)
kept.rename(folder / "end.npz")
"""
"""Goes on from the checkpoint in a folder, or begins."""

PACKS = """
import sys
from carom.cli import main
from carom.studies.packings import compression
compression.CHECKPOINT_EVERY = 0.02
main()
"""

PACKING = [
    "pack", "--dimension", "2", "--walls", "--species", "30:1", "--species", "30:1.4", "--rate", "0.003",
    "--until-Z", "1e6", "--no-pictures", "--seed", "2",
]  # fmt: skip


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    monkeypatch.setattr(commands, "WAIT", 600.0)


def killed_until_it_ends(first, again, state, end, kills, seed):
    """Kill a command so often, each time after it wrote a checkpoint of its own, then let it end."""
    dice, landed, words = random.Random(seed), 0, first
    for _ in range(kills):
        known = state.stat().st_ino if state.exists() else None
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_for(lambda: (state.exists() and state.stat().st_ino != known) or end.exists(), process)  # noqa: B023
        try:
            process.wait(timeout=dice.uniform(0.0, 0.4))
        except subprocess.TimeoutExpired:
            process.kill()
        process.communicate()
        landed += process.returncode < 0
        words = again if state.exists() else first
    assert landed, "no kill came in time to mean anything"
    done = subprocess.run(words, capture_output=True, text=True, timeout=commands.WAIT)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("seed", [1, 2])
def test_kills_change_no_bit_of_a_mixture_that_grows_between_walls_around_a_ball(tmp_path, seed):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    for folder in (whole, cut):
        folder.mkdir()
    subprocess.run([sys.executable, "-c", GROWS, whole], check=True)
    words = [sys.executable, "-c", GROWS, cut]
    killed_until_it_ends(words, words, cut / "checkpoint.h5", cut / "end.npz", kills=6, seed=seed)
    with np.load(whole / "end.npz") as mine, np.load(cut / "end.npz") as its:
        assert all(np.array_equal(mine[name], its[name]) for name in mine)
        assert mine["arr_2"].max() > 1.02, "it has not grown"
        assert (mine["arr_4"] > 0.0).all(), "nobody met a wall, or the ball"
    mine, its = datasets(whole / "checkpoint.h5"), datasets(cut / "checkpoint.h5")
    assert mine.keys() == its.keys()
    # The attributes are JSON, and hold the seconds that were spent.
    assert all(np.array_equal(mine[name], its[name]) for name in mine if name != "attributes")


def test_kills_change_no_byte_of_a_compression_of_a_mixture_between_walls(tmp_path):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    done = carom(*PACKING, "--out", whole)
    assert (done.returncode, complaints(done)) == (0, "")
    words = [sys.executable, "-c", PACKS]
    first, again = [*words, *PACKING, "--out", cut], [*words, "resume", cut]
    killed_until_it_ends(first, again, cut / "compression.h5", cut / "summary.json", kills=6, seed=1)
    for name in ("history.csv", "packing.extxyz", "packing.h5md", "summary.json"):
        assert (whole / name).read_bytes() == (cut / name).read_bytes(), name
