"""``carom run --relative-error``: as long as the error bar asks for, and the same bits after any stop."""

import json
import os
import signal

import pytest
from helpers.commands import PLAN, assert_same_run, carom as command

import carom
from carom.compiling import entry
from carom.errors import InputError
from carom.observables.analysis.precision import FLOOR
from carom.scene_file.scene_file import RunSpec, SceneFile

PRECISE = PLAN.format(equilibration=50, measured=0, frames=20).replace(
    "collisions_per_particle = 0", "relative_error = 3e-3"
)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return the scene file, the folder of the run, and what it printed."""
    folder = tmp_path_factory.mktemp("precise")
    scene = folder / "scene.toml"
    scene.write_text(PRECISE)
    done = command("run", scene, "--out", folder / "run")
    assert done.returncode == 0, done.stderr
    return scene, folder / "run", done


def test_a_run_reaches_the_relative_error_it_was_asked_for(finished):
    _, folder, done = finished
    summary = json.loads((folder / "summary.json").read_text())
    z = summary["Z"]
    assert z["error"] <= 3e-3 * z["mean"]
    assert z["n_eff"] >= FLOOR
    assert summary["relative_error"] == 3e-3
    # At least the frames asked for, more only as far as the stretch outgrew the pilot's prediction.
    assert 20 <= summary["frames"] <= 80
    assert "Relative error" in done.stderr
    assert "s more" in done.stderr
    assert "0.003 was asked for" in done.stdout


def test_a_precise_run_stopped_again_and_again_ends_with_the_same_bits(finished, tmp_path):
    scene, whole, _ = finished
    out = tmp_path / "run"
    moments = [("Pilot", 0.0), ("Pilot", 0.4), ("Measuring", 0.1), ("Measuring", 0.6), ("Measuring", 0.95)]

    def stop(fraction, stage):
        if moments and stage == moments[0][0] and fraction >= moments[0][1]:
            moments.pop(0)
            os.kill(os.getpid(), signal.SIGINT)

    go = lambda: carom.run(SceneFile.load(scene), out, progress=stop)  # noqa: E731
    while moments:
        with pytest.raises(carom.Interrupted):
            go()
        go = lambda: carom.resume(out, progress=stop)  # noqa: E731
    go()
    assert_same_run(whole, out)


def test_the_options_of_a_run_take_the_place_of_each_other(finished, tmp_path):
    scene, *_ = finished
    done = command("run", scene, "--collisions-per-particle", "50", "--out", tmp_path / "run", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["relative_error"] is None


def test_the_wall_time_bounds_a_run_out_of_reach(finished, tmp_path):
    scene, *_ = finished
    done = command(
        "run", scene, "--relative-error", "1e-9", "--walltime", "0.5", "--out", tmp_path / "run", "--json"
    )
    assert done.returncode == 3, done.stderr
    assert "a relative error of 1e-09 was asked for" in done.stderr
    summary = json.loads(done.stdout)
    assert summary["frames"] >= 1
    assert summary["Z"]["error"] > 1e-6


# How many samples a hundredth of twenty seconds gives depends on the machine.
@pytest.mark.filterwarnings("ignore:Fewer than:carom.errors.CaromWarning")
def test_seconds_of_earlier_sessions_count_for_the_wall_time(tmp_path, monkeypatch):
    ahead, running = [0.0], entry.running
    monkeypatch.setattr(entry, "running", lambda: running() + ahead[0])
    plan = PRECISE.replace("3e-3", "1e-9\nwalltime = 20.0").replace("frames = 20", "frames = 200")

    def stop(fraction, stage):
        if stage == "Measuring" and fraction > 0.01:  # with two frames
            ahead[0] = 30.0
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(carom.Interrupted):
        carom.run(SceneFile.from_toml(plan), tmp_path / "run", progress=stop)
    ahead[0] = 0.0
    found = carom.resume(tmp_path / "run")
    assert 2 <= found.summary["frames"] < 10


def test_ten_thousand_collisions_per_particle_are_the_default():
    assert RunSpec().collisions_per_particle == 10000.0
    assert RunSpec(relative_error=1e-3).collisions_per_particle is None


@pytest.mark.parametrize(
    ("n", "key", "says"),
    [
        (16, "pinned = 4", "components are pinned"),
        (16, 'motion = { type = "gravity", g = [0.0, -1.0] }', "Gravity changes the total momentum"),
        (16, "[run]\nkT = 0.0", "Nothing moves"),
        (1, "", "One particle"),
    ],
)
def test_a_run_without_a_pressure_takes_no_relative_error(tmp_path, n, key, says):
    scene = f"[scene]\nn = {n}\ndimension = 2\nbox = [9.0, 9.0]\n{key}\n"
    scene += "" if "[run]" in key else "[run]\n"
    plan = SceneFile.from_toml(scene + "relative_error = 0.05\n")
    with pytest.raises(InputError, match=rf"needs a pressure; give collisions_per_particle or time.*{says}"):
        carom.run(plan, tmp_path / "run")
    assert not (tmp_path / "run").exists()
