"""``kill -9`` at random moments of a run with walls, an obstacle, species, an event log and three formats."""

import json
import random
import shutil
import subprocess

import ase.io
import MDAnalysis
import pytest
from helpers import full_run
from helpers.commands import assert_same_run, began, carom as command, complaints, start, wait_for
from helpers.marks import slow

import carom
from carom import io
from carom.errors import FileError
from carom.io import checkpoint, checksums
from carom.io.trajectory import open_reader

pytestmark = [
    pytest.mark.ci,
    pytest.mark.needs("Unix"),
    pytest.mark.filterwarnings("ignore:.*GSD knows no walls"),
]

SIZE = {"equilibration": 2000, "measured": 24000, "frames": 128}
"""One or two seconds, with a frame every 10 ms, so that kills fall into frames as well."""


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Return the scene file and the folder of an uninterrupted run."""
    folder = tmp_path_factory.mktemp("full")
    scene = folder / "full.toml"
    scene.write_text(full_run.plan(**SIZE).to_toml())
    return scene, carom.run(full_run.plan(**SIZE), folder / "run").folder


def open_after_a_kill(out):
    """Every trajectory opens, or can be made anew."""
    for path in out.glob("trajectory.*"):
        # On a copy, because HDF5 goes on showing a process what it saw first, even when the file grew.
        copy = shutil.copy(path, out.parent / f"copy{path.suffix}")
        try:
            io.open(copy, "a").close()
        except FileError:
            # Allowed for HDF5, if the kill came between two of the few writes that make a frame part of it.
            assert path.suffix == ".h5md"


def killed(arguments, out, seconds):
    """Kill a command so long after it wrote a checkpoint of its own; return whether that came in time."""
    path = out / "checkpoint.h5"
    known = path.stat().st_ino if path.exists() else None
    process = start(*arguments)
    wait_for(
        lambda: (path.exists() and path.stat().st_ino != known) or (out / "summary.json").exists(), process
    )
    try:
        process.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
    process.communicate()
    open_after_a_kill(out)
    return process.returncode < 0


def kill_again_and_again(reference, out, kills, seed):
    scene, whole = reference
    dice = random.Random(seed)
    landed = killed(["run", scene, "--out", out], out, dice.uniform(0.0, 0.3))
    beginning = began(out)
    for _ in range(kills - 1):
        landed += killed(["resume", out], out, dice.uniform(0.0, 0.3))
    assert landed, "no kill came in time to mean anything"
    done = command("resume", out)
    assert (done.returncode, complaints(done)) == (0, ""), "after a kill every file is whole"
    assert began(out) == beginning, "the run did not go on, but started again"
    assert_same_run(whole, out)
    assert len(ase.io.read(out / "trajectory.extxyz", index=":")) == len(io.read(whole, ":"))
    MDAnalysis.Universe(str(out / "trajectory.h5md"), to_guess=()).trajectory.close()


def test_two_kills_change_no_bit_and_damage_no_file(reference, tmp_path):
    kill_again_and_again(reference, tmp_path / "run", kills=2, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_six_times_six_kills_change_no_bit_and_damage_no_file(reference, tmp_path, seed):
    kill_again_and_again(reference, tmp_path / "run", kills=6, seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("name", full_run.OTHERS)
def test_kills_change_no_bit_of_other_physics(name, tmp_path):
    """Of what remembers: pairs on steps."""
    plan = full_run.other(name)
    scene = tmp_path / "scene.toml"
    scene.write_text(plan.to_toml())
    whole = carom.run(plan, tmp_path / "whole").folder
    kill_again_and_again((scene, whole), tmp_path / "run", kills=4, seed=1)


@pytest.mark.parametrize("form", [slow("gsd"), slow("extxyz"), slow("h5md")])
def test_a_run_with_one_trajectory_alone_goes_on_after_a_kill(reference, tmp_path, form):
    """Its frames cannot be made anew from another."""
    out, scene = tmp_path / "run", tmp_path / "one.toml"
    others = [other for other in ("h5md", "extxyz", "gsd") if other != form]
    plan = full_run.plan(**SIZE, without=others)
    assert plan.run.write == (form,)
    scene.write_text(plan.to_toml())
    process = start("run", scene, "--out", out)
    wait_for(lambda: (out / "checkpoint.h5").exists() and checkpointed(out) > 2, process)
    process.kill()
    process.communicate()
    written, beginning = checkpointed(out), began(out)
    with open_reader(out / f"trajectory.{form}", torn=True) as reader:
        assert len(reader) >= written, "the checkpoint knows frames that the file has not"
    done = command("resume", out)
    assert (done.returncode, complaints(done)) == (0, "")
    assert began(out) == beginning, "the run did not go on, but started again"
    name = f"trajectory.{form}"
    mine, its = (io.read(folder / name, ":") for folder in (out, reference[1]))
    assert list(map(checksums.of_frame, mine)) == list(map(checksums.of_frame, its))


def checkpointed(out):
    """Return how many frames a checkpoint knows."""
    notes = json.loads(checkpoint.load(out / "checkpoint.h5")[1]["extra"])
    per_frame = -(-1024 // SIZE["frames"])
    return max(len(notes["marks"]) - 1, 0) // per_frame
