"""``kill -9`` at random moments: files open, ``carom resume`` goes on, and the end has the same bits."""

import random
import subprocess

import ase.io
import h5py
import MDAnalysis
import pytest
from helpers.commands import assert_same_run, began, carom, start, wait_for, whole_run

from carom import io
from carom.errors import FileError

pytestmark = pytest.mark.needs("Unix")


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Return the scene file and the folder of an uninterrupted run."""
    # A frame about every 10 ms, so that kills fall into frames as well.
    return whole_run(tmp_path_factory, equilibration=1000, measured=24000, frames=128, log=True)


def whole_frames(out):
    """Return how many frames a folder's trajectories hold after a kill; each opens, or can be made anew."""
    counts = []
    for name in ("trajectory.extxyz", "trajectory.h5md"):
        path = out / name
        if not path.exists():
            continue
        # On a copy, because HDF5 goes on showing a process what it saw first, even when the file grew.
        copy = out.parent / f"copy{path.suffix}"
        copy.write_bytes(path.read_bytes())
        try:
            with io.open(copy, "a") as writer:
                counts.append(len(writer))
        except FileError:
            # Allowed for HDF5, if the kill came between two of the few writes that make a frame part of it.
            assert name == "trajectory.h5md"
    return counts


def state(out):
    """Return what tells one checkpoint from the next, which takes its place as another file."""
    path = out / "checkpoint.h5"
    try:
        return path.stat().st_ino, path.stat().st_mtime_ns
    except FileNotFoundError:
        return None


def has_moved_on(out, known):
    """Tell whether a run has written a checkpoint, or all of it."""
    return state(out) not in (None, known) or (out / "summary.json").exists()


def kill_and_resume(scene, out, kills, seed):
    """Kill a run again and again, and let it come to its end."""
    dice = random.Random(seed)
    landed, beginning = 0, None
    for _ in range(kills):
        known = state(out)
        process = start("resume", out) if out.exists() else start("run", scene, "--out", out)
        # Past the start of Python, which is most of the time and has nothing to lose.
        wait_for(lambda known=known: has_moved_on(out, known), process)
        try:
            process.wait(timeout=dice.uniform(0.0, 0.4))
        except subprocess.TimeoutExpired:
            process.kill()
            landed += 1
        process.communicate()
        beginning = beginning or began(out)
        if (out / "summary.json").exists():
            break
        whole_frames(out)
    done = carom("resume", out)
    assert done.returncode == 0, done.stderr
    assert began(out) == beginning, "the run did not go on, but started again"
    return landed


def check_final(out):
    frames = 128
    assert len(ase.io.read(out / "trajectory.extxyz", index=":")) == frames
    universe = MDAnalysis.Universe(str(out / "trajectory.h5md"), to_guess=())
    assert len(universe.trajectory) == frames
    universe.trajectory.close()
    with h5py.File(out / "trajectory.h5md") as file:
        assert file["particles/trajectory/position/value"].shape == (frames, 108, 3)


@pytest.mark.slow
def test_three_kills_change_no_bit(reference, tmp_path):
    scene, whole = reference
    out = tmp_path / "run"
    assert kill_and_resume(scene, out, kills=3, seed=1) >= 2, "the kills came too late to mean anything"
    check_final(out)
    assert_same_run(whole, out)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
def test_twenty_kills_change_no_bit(reference, tmp_path, seed):
    """Five runs, four kills each."""
    scene, whole = reference
    out = tmp_path / "run"
    kill_and_resume(scene, out, kills=4, seed=seed)
    check_final(out)
    assert_same_run(whole, out)
