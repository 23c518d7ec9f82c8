"""A run that was stopped goes on, and ends with the bits of one that was not."""

import errno
import os
import random
import shutil
import signal

import filelock
import numpy as np
import pytest
from helpers import full_run
from helpers.commands import assert_same_run, began, carom as command, refused, summary, whole_run

import carom
from carom import io
from carom.scene_file.scene_file import SceneFile
from carom.studies.result_folders import LOCK
from carom.studies.runs.driver import Run
from carom.studies.runs.folder import RunFolder


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """Return the scene file and the folder of an uninterrupted run."""
    return whole_run(tmp_path_factory, equilibration=1000, measured=2000, frames=64)


def test_killed_before_the_first_checkpoint_starts_again(reference, tmp_path):
    _, whole = reference
    out = tmp_path / "run"
    out.mkdir()
    shutil.copy(whole / "scene.toml", out)
    # As a kill leaves it between two steps of the beginning.
    (out / "trajectory.h5md").write_bytes(b"")
    (out / ".checkpoint.77.tmp.h5").write_bytes(b"half")
    done = command("resume", out)
    assert done.returncode == 0, done.stderr
    assert_same_run(whole, out)


class Killed(BaseException):
    """The process was killed."""


def test_killed_while_it_makes_a_trajectory_starts_again(reference, tmp_path, monkeypatch):
    def half(path, *_):
        path.write_bytes(b"half")
        raise Killed

    scene, whole = reference
    monkeypatch.setattr(io, "open", half)
    with pytest.raises(Killed):
        carom.run(SceneFile.load(scene), tmp_path / "run")
    monkeypatch.undo()
    carom.resume(tmp_path / "run")
    assert_same_run(whole, tmp_path / "run")


@pytest.fixture
def stopped(reference, tmp_path):
    """Return the folder of a run that was stopped in the middle, without a process to wait for."""
    return full_run.stopped(SceneFile.load(reference[0]), tmp_path / "stopped", after=0.4)


@pytest.mark.parametrize("stage", ["Equilibrating", "Measuring", "Computing g(r)"])
def test_ctrl_c_in_any_phase_costs_nothing(reference, tmp_path, stage):
    scene, whole = reference
    out, later = full_run.stopped(SceneFile.load(scene), tmp_path / "run", stage, 0.3), []
    assert not (out / "summary.json").exists()
    before = began(out)
    carom.resume(out, progress=lambda fraction, now: later.append(now))
    assert began(out) == before, "the run did not go on, but started again"
    assert ("Equilibrating" in later) == (stage == "Equilibrating")
    assert_same_run(whole, out)


def test_a_moved_folder_resumes_where_it_is(reference, stopped):
    elsewhere = stopped.rename(stopped.with_name("elsewhere"))
    carom.resume(elsewhere)
    assert_same_run(reference[1], elsewhere)
    assert not stopped.exists()


def test_a_run_stopped_again_and_again_ends_with_the_same_bits(reference, tmp_path):
    """In one process, at random looks of every phase: 12 stops."""
    scene, whole = reference
    out, dice = tmp_path / "run", random.Random(11)
    stops = 0

    def sometimes(fraction, stage):
        if stage in ("Equilibrating", "Measuring") and dice.random() < 0.1:
            os.kill(os.getpid(), signal.SIGINT)

    go = lambda progress: carom.run(SceneFile.load(scene), out, progress=progress)  # noqa: E731
    while stops < 12:
        try:
            go(sometimes)
            break
        except carom.Interrupted:
            stops += 1
        go = lambda progress: carom.resume(out, progress=progress)  # noqa: E731
        if stops == 1:
            beginning = began(out)
    carom.resume(out)
    assert stops >= 3, "too few stops to mean anything"
    assert began(out) == beginning, "the run did not go on, but started again"
    assert_same_run(whole, out)


def test_sampling_and_progress_change_no_bit(reference, tmp_path):
    """With a quarter of the frames, they are every fourth of all, and the pressure is the same."""
    scene, whole = reference
    text = scene.read_text().replace("frames = 64", "frames = 16")
    seen = []
    carom.run(
        SceneFile.from_toml(text), tmp_path / "run", progress=lambda fraction, stage: seen.append(stage)
    )
    assert {"Compiling", "Equilibrating", "Measuring", "Computing g(r)", "Done"} <= {*seen}
    few, many = (io.read(folder / "trajectory.h5md", ":") for folder in (tmp_path / "run", whole))
    assert len(few) == 16
    for one, other in zip(few, many[3::4], strict=True):
        assert (one.time, one.step) == (other.time, other.step)
        for name in ("positions", "velocities", "images"):
            assert np.array_equal(getattr(one, name), getattr(other, name))
    for name in ("Z", "collisions", "time", "worst_overlap", "energy_drift"):
        assert summary(tmp_path / "run")[name] == summary(whole)[name]


def test_resume_of_a_finished_run_says_so(reference):
    _, whole = reference
    before = {path.name: path.stat().st_mtime_ns for path in whole.iterdir()}
    done = command("resume", whole)
    assert done.returncode == 0
    assert "finished already" in done.stdout
    assert {path.name: path.stat().st_mtime_ns for path in whole.iterdir()} == before


def test_two_processes_do_not_run_in_one_folder(reference, stopped):
    with filelock.FileLock(stopped / LOCK):
        assert "Another process" in refused("resume", stopped)


@pytest.mark.needs("Unix")
@pytest.mark.parametrize("name", ["ENOSYS", "ENOLCK"])
def test_a_drive_without_locks_keeps_no_mark_that_a_kill_would_leave(tmp_path, monkeypatch, name):
    def flock(*_):
        raise OSError(getattr(errno, name), name)

    monkeypatch.setattr("fcntl.flock", flock)
    with RunFolder(tmp_path).owned():
        assert (tmp_path / LOCK).read_bytes() == b""


@pytest.mark.parametrize("goes_on", [False, True])
def test_what_another_process_did_meanwhile_stays(reference, tmp_path, monkeypatch, goes_on):
    """Two began at the same time, and one has ended when the other has prepared its run."""
    scene, out = SceneFile.load(reference[0]), tmp_path / "run"
    if goes_on:
        full_run.stopped(scene, out, after=0.4)
    go = (lambda: carom.resume(out)) if goes_on else lambda: carom.run(scene, out, overwrite=True)
    ready = Run.tell

    def other(*arguments):
        monkeypatch.undo()
        go()
        ready(*arguments)

    monkeypatch.setattr(Run, "tell", other)
    with pytest.raises(carom.FileError, match="Another process was running"):
        go()
    assert_same_run(reference[1], out)


def test_resume_of_no_run_is_refused(tmp_path):
    for folder in (tmp_path, tmp_path / "nowhere", __file__):
        refused("resume", folder, cwd=tmp_path)


def test_a_damaged_checkpoint_is_refused_and_left(stopped):
    path = stopped / "checkpoint.h5"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(carom.FileError, match="was changed"):
        carom.resume(stopped)
    assert path.read_bytes() == content
