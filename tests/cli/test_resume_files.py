"""Before a stopped run goes on, its files are verified: the damaged are made anew, or nothing is touched."""

import shutil

import numpy as np
import pytest
from helpers import full_run
from helpers.commands import assert_same_run, began, content, refused

import carom
from carom import io
from carom.errors import CaromWarning, FileError, InputError
from carom.io.events import EventLog, read_events
from carom.io.hdf5 import Input
from carom.models import Ball
from carom.scene_file.scene_file import SceneFile, SceneSpec
from carom.simulation.simulation import Simulation
from carom.studies import phase as phases
from carom.studies.runs import report
from carom.studies.runs.folder import RunFolder

pytestmark = pytest.mark.filterwarnings("ignore:.*GSD knows no walls")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of an uninterrupted run."""
    return carom.run(full_run.plan(), tmp_path_factory.mktemp("whole") / "run").folder


@pytest.fixture(scope="module")
def halfway(tmp_path_factory):
    """The folder of a run that was stopped halfway."""
    return full_run.stopped(full_run.plan(), tmp_path_factory.mktemp("halfway") / "run")


@pytest.fixture
def out(halfway, tmp_path):
    """A copy of the folder of a run that was stopped halfway."""
    return shutil.copytree(halfway, tmp_path / "run")


def flip(path):
    """Change one bit of a trajectory's first frame."""
    place = path.stat().st_size // 3
    if path.suffix == ".h5md":  # a third of this file is room for later frames
        with Input(path) as file:
            place = file["particles/trajectory/velocity/value"].id.get_chunk_info(0).byte_offset + 100
    damaged = bytearray(path.read_bytes())
    if path.suffix == ".gsd":  # where a third of it lies is a matter of how long names are
        from gsd import fl

        with fl.open(str(path), mode="r") as file:
            place = damaged.find(file.read_chunk(0, "particles/velocity").tobytes()) + 100
    damaged[place] ^= 1
    path.write_bytes(damaged)


def column(path, name):
    """Return where the first chunk of a column of an event log begins, and how many of its bytes are used."""
    with Input(path) as file:
        data = file[name]
        return data.id.get_chunk_info(0).byte_offset, min(len(data), data.chunks[0]) * data.dtype.itemsize


def change_an_event(path):
    damaged, (start, size) = bytearray(path.read_bytes()), column(path, "impulse")
    damaged[start + size // 2] ^= 1
    path.write_bytes(damaged)


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])


def remove(path):
    path.unlink()


def empty(path):
    path.write_bytes(b"")


def test_a_run_with_walls_an_obstacle_species_and_a_log_goes_on(whole, out):
    before, stages = began(out), []
    with Simulation.load(out / "checkpoint.h5", event_log=shutil.copy(out / "events.h5", out / "log")) as sim:
        hits = sum(each.hits for each in sim.obstacles)
        assert hits > 0
        # What the folder held when it was stopped: collisions of pairs, and all hits of walls and the ball.
        assert len(read_events(out / "events.h5").i) == sim.collisions + hits
    (out / "log").unlink()
    result = carom.resume(out, progress=lambda fraction, stage: stages.append(stage))
    assert began(out) == before, "the run did not go on, but started again"
    assert "Equilibrating" not in stages
    assert result.new
    assert_same_run(whole, out)


@pytest.mark.parametrize("stage", ["Equilibrating", "Measuring"])
def test_such_a_run_goes_on_from_every_phase(whole, tmp_path, stage):
    out = full_run.stopped(full_run.plan(), tmp_path / "run", stage, 0.1)
    before = began(out)
    carom.resume(out)
    assert began(out) == before
    assert_same_run(whole, out)


@pytest.mark.parametrize(
    ("form", "harm"),
    [("h5md", harm) for harm in (flip, cut, remove, empty)]
    + [("extxyz", flip), ("extxyz", cut), ("gsd", flip), ("gsd", empty)],
)
def test_a_damaged_trajectory_is_made_anew_from_another(whole, out, form, harm):
    harm(out / f"trajectory.{form}")
    before = began(out)
    with pytest.warns(match=rf"trajectory\.{form} was damaged or missing, and is made anew"):
        carom.resume(out)
    assert began(out) == before
    assert_same_run(whole, out)


def test_frames_after_the_checkpoint_need_not_be_whole(whole, out):
    """A kill may cut them off anywhere."""
    with (out / "trajectory.extxyz").open("ab") as file:
        file.write(b"48\nLattice=")
    carom.resume(out)
    assert_same_run(whole, out)


@pytest.mark.parametrize("harm", [flip, cut, remove])
def test_where_no_trajectory_is_whole_nothing_is_touched(out, harm):
    for form in ("h5md", "extxyz"):
        harm(out / f"trajectory.{form}")
    # After a kill the log holds more than the checkpoint knows; that is not dropped either.
    with EventLog(out / "events.h5") as log:
        log.append(*(np.ones(1, dtype) for dtype in (int, float, int, int, int, float)))
    said = refused("resume", ".", cwd=out)
    assert "trajectory.h5md" in said
    assert "left as it is" in said


@pytest.mark.parametrize("harm", [change_an_event, cut, remove, empty])
def test_where_the_event_log_is_damaged_nothing_is_touched(out, harm):
    harm(out / "events.h5")
    # Nor is a trajectory that could be made anew.
    remove(out / "trajectory.extxyz")
    assert "events.h5" in refused("resume", ".", cwd=out)


def test_every_bit_of_the_logged_events_is_verified(out):
    path = out / "events.h5"
    whole = path.read_bytes()
    for k, name in enumerate(4 * ["epoch", "time", "i", "j", "image", "impulse"]):
        start, size = column(path, name)
        place = start + (k * 7919) % size
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 16]) + whole[place + 1 :])
        with pytest.raises(FileError, match="damaged"):
            Simulation.load(out / "checkpoint.h5", event_log=path)
    path.write_bytes(whole)
    Simulation.load(out / "checkpoint.h5", event_log=path).close()


def test_a_checkpoint_without_a_log_takes_none(out, tmp_path):
    with Simulation.load(out / "checkpoint.h5", event_log=out / "events.h5") as sim:
        sim.close()
        sim.save(tmp_path / "state.h5")
    before = (out / "events.h5").read_bytes()
    with pytest.raises(InputError, match="without an event log"):
        Simulation.load(tmp_path / "state.h5", event_log=out / "events.h5")
    assert (out / "events.h5").read_bytes() == before


EDITS = [
    ("frames = 16", "frames = 32", "[run] frames was 16 and is 32 now"),
    ("collisions_per_particle = 1000.0", "collisions_per_particle = 2000.0", "collisions_per_particle"),
    ("count = 20", "count = 21", "[scene] species"),
    ("event_log = true", "event_log = false", "[run] event_log was true and is false"),
    ("[run]", "[run]\nframse = 3", "framse is no known key"),
    ("[run]", "[run", "no valid TOML"),
]


@pytest.mark.parametrize(("old", "new", "says"), EDITS)
def test_an_edited_scene_file_is_refused_with_what_differs(out, old, new, says):
    scene = out / "scene.toml"
    assert old in scene.read_text()
    scene.write_text(scene.read_text().replace(old, new, 1))
    said = refused("resume", ".", cwd=out)
    assert says in said
    assert "remove the file" in said


def test_a_scene_file_that_was_removed_is_written_anew_and_comments_are_no_edit(whole, out):
    (out / "scene.toml").unlink()
    carom.resume(out)
    assert_same_run(whole, out)
    with (out / "scene.toml").open("a") as file:
        file.write("# mine\n")
    assert not carom.resume(out).new


def test_an_edit_after_the_end_is_refused_as_well(whole, tmp_path):
    out = shutil.copytree(whole, tmp_path / "run")
    scene = out / "scene.toml"
    scene.write_text(scene.read_text().replace("frames = 16", "frames = 17"))
    assert "[run] frames was 16 and is 17 now" in refused("resume", out)


def test_frames_and_events_without_a_checkpoint_are_kept(out):
    (out / "checkpoint.h5").unlink()
    scene = out / "scene.toml"
    scene.write_text(scene.read_text().replace("seed = 3", "seed = 2"))
    kept = ["trajectory.h5md", "trajectory.extxyz", "trajectory.gsd", "events.h5"]
    for name in kept:  # each of them is enough
        said = refused("resume", ".", cwd=out)
        assert f"frames or events ({name}" in said
        assert "no checkpoint" in said
        assert "--overwrite" in said
        (out / name).unlink()


def test_files_that_a_run_has_only_begun_are_no_hindrance(tmp_path):
    scene = full_run.plan().build_scene()
    for form in ("h5md", "extxyz", "gsd"):
        io.open(tmp_path / f"trajectory.{form}", "w", scene).close()
    EventLog(tmp_path / "events.h5", {"positions": scene.positions}).close()
    assert len(content(tmp_path)) == 4
    RunFolder(tmp_path).check_empty()


class Own(Ball):
    """An obstacle of one's own, which no scene file holds."""


def test_a_plan_that_no_file_holds_leaves_the_run_that_is_there(out):
    before = content(out)
    plan = SceneFile(scene=SceneSpec(n=4, box=(9.0, 9.0), obstacles=(Own((4.0, 4.0), 1.0),)))
    with pytest.raises(InputError, match="class of one's own"):
        RunFolder(out).begin(plan)
    assert content(out) == before


def test_a_summary_is_written_without_what_cannot_be_computed(tmp_path, monkeypatch):
    def unknown(scene):
        raise InputError("No virial coefficients are known.")

    monkeypatch.setattr(phases, "_mixture_theory", unknown)
    monkeypatch.setattr(report, "_obstacles", lambda run: [1 / 0])
    plan = full_run.plan(equilibration=5, measured=50, frames=2, without=("gsd",))
    with pytest.warns(CaromWarning) as told, pytest.raises(ZeroDivisionError):
        carom.run(plan, tmp_path / "run")
    found = carom.resume(tmp_path / "run")
    assert not found.new
    assert found.summary["Z"]["mean"] > 1.0
    assert (found.summary["theory"], found.summary["obstacles"]) == ([], [])
    missing = [
        "No theory: No virial coefficients are known.",
        "No pressure on walls and obstacles: ZeroDivisionError (division by zero), an error of the program.",
    ]
    assert found.summary["remarks"][-2:] == missing
    assert {*missing} <= {str(each.message) for each in told}
