"""``kill -9`` and other signals at random moments of a run with walls, an obstacle, species, an event log and
three formats; and ``kill -9`` while diameters grow, where an event log is refused.
"""

import contextlib
import json
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import ase.io
import MDAnalysis
import numpy as np
import pytest
from helpers import commands, full_run
from helpers.commands import (
    CAROM,
    assert_same_run,
    began,
    carom as command,
    complaints,
    datasets,
    start,
    wait_for,
)
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


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    monkeypatch.setattr(commands, "WAIT", 600.0)


def started(words):
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


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


def killed_until_it_ends(first, again, state, end, kills, seed, after=lambda: None):
    """Kill a command so often, each time after it wrote a checkpoint of its own, then let it end; return what
    it said.
    """
    dice, landed, words = random.Random(seed), 0, first
    for _ in range(kills):
        known = state.stat().st_ino if state.exists() else None
        process = started(words)
        wait_for(lambda: (state.exists() and state.stat().st_ino != known) or end.exists(), process)  # noqa: B023
        try:
            process.wait(timeout=dice.uniform(0.0, 0.4))
        except subprocess.TimeoutExpired:
            process.kill()
        process.communicate()
        landed += process.returncode < 0
        after()
        words = again if state.exists() else first
    assert landed, "no kill came in time to mean anything"
    done = subprocess.run(words, capture_output=True, text=True, timeout=commands.WAIT)
    assert (done.returncode, complaints(done)) == (0, ""), "after a kill every file is whole"


def kill_again_and_again(reference, out, kills, seed):
    scene, whole = reference
    beginnings = []

    def look():
        open_after_a_kill(out)
        beginnings.append(began(out))

    first, again = [*CAROM, "run", scene, "--out", out], [*CAROM, "resume", out]
    killed_until_it_ends(first, again, out / "checkpoint.h5", out / "summary.json", kills, seed, look)
    assert {began(out)} == {*beginnings}, "the run did not go on, but started again"
    assert_same_run(whole, out)
    assert len(ase.io.read(out / "trajectory.extxyz", index=":")) == len(io.read(whole, ":"))
    MDAnalysis.Universe(str(out / "trajectory.h5md"), to_guess=()).trajectory.close()


def test_two_kills_change_no_bit_and_damage_no_file(reference, tmp_path):
    kill_again_and_again(reference, tmp_path / "run", kills=2, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_twice_six_kills_change_no_bit_and_damage_no_file(reference, tmp_path, seed):
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


ONE_SECOND = 1.0
"""What a person who pressed Ctrl-C waits without wondering."""


def interrupted_while_measuring(scene, out, number):
    """Send a run a signal after its first frame; return what it said and how long that took [s]."""
    process = start("run", scene, "--out", out)
    frames = out / "trajectory.extxyz"
    wait_for(lambda: frames.exists() and frames.stat().st_size, process)
    process.send_signal(number)
    sent = time.monotonic()
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    return errors, time.monotonic() - sent


@pytest.mark.timing
def test_ctrl_c_stops_within_a_second(reference, tmp_path):
    _, taken = interrupted_while_measuring(reference[0], tmp_path / "run", signal.SIGINT)
    assert taken < ONE_SECOND


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_stopped_by_a_signal_goes_on_and_ends_with_the_same_bits(reference, tmp_path, number):
    scene, whole = reference
    out = tmp_path / "run"
    errors, _ = interrupted_while_measuring(scene, out, number)
    assert errors.strip().splitlines()[-1] == f"Stopped; `carom resume {out}` goes on."
    assert checkpointed(out), "the run was stopped while it measured"
    assert not (out / "summary.json").exists()
    # What is there opens, by Carom and by others.
    assert len(io.read(out / "trajectory.extxyz", ":")) == len(io.read(out / "trajectory.h5md", ":")) > 0
    MDAnalysis.Universe(str(out / "trajectory.h5md"), to_guess=()).trajectory.close()
    before = began(out)
    done = command("resume", out)
    assert done.returncode == 0, done.stderr
    assert began(out) == before, "the run did not go on, but started again"
    assert_same_run(whole, out)


def test_a_run_that_ignores_ctrl_c_stops_by_sigterm(tmp_path, reference):
    """A shell so starts ``carom run ... &`` of a script; the Ctrl-C is for what stands before."""
    out, state = tmp_path / "run", tmp_path / "run" / "checkpoint.h5"
    with signal_ignored(signal.SIGINT):
        process = started([*CAROM, "run", reference[0], "--out", out])
    saved = {None}

    def saves_again(times):
        """Tell whether the state was saved some times more; a run that is stopped saves it once."""
        if state.exists():
            saved.add(state.stat().st_mtime_ns)
        return len(saved) > times

    wait_for(lambda: saves_again(1), process)
    process.send_signal(signal.SIGINT)
    wait_for(lambda: saves_again(4), process)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.count("Stopped") == 1


@pytest.mark.parametrize("when", ["reserve", "write"])
def test_sigterm_before_a_study_begins_and_after_its_end_is_as_ctrl_c(tmp_path, when):
    killed = "lambda *_, **__: os.kill(os.getpid(), signal.SIGTERM)"
    program = f"import os, signal; from carom.cli import main, study; study.{when} = {killed}; main()"
    words = [sys.executable, "-c", program, "code", "4", "--tries", "1", "--engine", "serial"]
    done = subprocess.run([*words, "--out", tmp_path / "out"], capture_output=True, text=True)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (130, "Stopped.")


@contextlib.contextmanager
def signal_ignored(number):
    before = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(number, before)


def test_tests_of_ctrl_c_pass_where_it_is_ignored():
    file = Path(__file__).parents[1] / "io" / "test_io_trajectories.py"
    words = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-p", "no:cacheprovider", "-k", "ctrl_c", file]
    with signal_ignored(signal.SIGINT):
        done = subprocess.run(words, capture_output=True, text=True, timeout=commands.WAIT)
    assert done.returncode == 0, done.stdout


# While diameters grow.


GROWS = """
import sys
from pathlib import Path
import numpy as np
from carom import Scene, Simulation, Species
from carom.models import Ball
from carom.simulation.measuring import stretches

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
from carom.studies import job
job.EVERY = 0.02
main()
"""

PACKING = [
    "pack", "--dimension", "2", "--walls", "--species", "30:1", "--species", "30:1.4", "--rate", "0.003",
    "--until-Z", "1e6", "--no-pictures", "--seed", "2",
]  # fmt: skip


@pytest.mark.slow
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


SHORT = ["--eta", "0.3", "--n", "256", "--replicas", "1", "--engine", "serial", "--no-pictures"]

TASKS = {
    "eos": [*SHORT, "--collisions-per-particle", "20000"],
    "transport": ["--eta", "0.2", *SHORT[2:], "--collisions-per-particle", "20000"],
    "shear": [*SHORT, "--rate", "1", "--strains", "1500"],
    "code": ["24", "--tries", "1", "--engine", "serial"],
}
"""A study of one task of some seconds, by command."""


@pytest.mark.parametrize("study", ["eos", slow("transport"), slow("shear"), slow("code")])
def test_five_kills_change_no_bit_of_a_task_of_a_study(tmp_path, study):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    done = command(study, *TASKS[study], "--out", whole)
    assert (done.returncode, complaints(done)) == (0, "")
    (record,) = (whole / "tasks").glob("*.json")
    words = [sys.executable, "-c", PACKS, study, *TASKS[study], "--out", cut]
    state, end = ((cut / "tasks" / record.name).with_suffix(suffix) for suffix in (".h5", ".json"))
    began = []
    killed_until_it_ends(
        words, words, state, end, kills=5, seed=1, after=lambda: began.append(state.exists())
    )
    assert any(began), "it had nothing to go on with"
    mine, its = (json.loads(path.read_text())["result"] for path in (record, end))
    assert mine == its
    assert not state.exists()


@pytest.mark.slow
def test_kills_change_no_byte_of_a_compression_of_a_mixture_between_walls(tmp_path):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    done = command(*PACKING, "--out", whole)
    assert (done.returncode, complaints(done)) == (0, "")
    words = [sys.executable, "-c", PACKS]
    first, again = [*words, *PACKING, "--out", cut], [*words, "resume", cut]
    killed_until_it_ends(first, again, cut / "compression.h5", cut / "summary.json", kills=6, seed=1)
    for name in ("history.csv", "packing.extxyz", "packing.h5md", "summary.json"):
        assert (whole / name).read_bytes() == (cut / name).read_bytes(), name
