"""The event log is enough: states rebuilt from it equal the run's to the bit."""

import h5py
import numpy as np
import pytest
from helpers.marks import slow
from helpers.oracle import moving
from helpers.replays import assert_same_frame, round_up

import carom
from carom.errors import FileError, InputError
from carom.simulation.replay import Replay, replay, replays

CASES = [
    (2, 50, {"packing_fraction": 0.6}, {"tuning": carom.Tuning(neighbors="lists", shell=1.3)}),
    (3, 64, {"packing_fraction": 0.2}, {"tuning": carom.Tuning(neighbors="sectors")}),
    (3, 100, {"packing_fraction": 0.4, "diameter": 0.37, "mass": 2.6}, {}),
]

SMALL = [
    (1, 6, {"packing_fraction": 0.5}, {}), slow(4, 6, {"packing_fraction": 0.1}, {}),
    (2, 3, {"box": (1.05, 4.0)}, {}), (2, 6, {"box": (2.1, 4.2)}, {}), (3, 5, {"box": (2.2, 1.1, 5.0)}, {}),
    slow(3, 10, {"box": (3.1, 2.5, 4.3)}, {}),
]  # fmt: skip
"""Kinds of their own, which run as plain Python by default, and compiled under ``-m slow``."""


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("dimension", "n", "scene", "settings"), SMALL)
def test_every_sampled_frame_of_few_is_rebuilt_to_the_bit(dimension, n, scene, settings, tmp_path):
    assert_rebuilt(dimension, n, scene, settings, tmp_path, 4)


@pytest.mark.parametrize(("dimension", "n", "scene", "settings"), CASES)
def test_every_sampled_frame_is_rebuilt_to_the_bit(dimension, n, scene, settings, tmp_path):
    assert_rebuilt(dimension, n, scene, settings, tmp_path, 10)


def assert_rebuilt(dimension, n, scene, settings, tmp_path, collisions):
    path = tmp_path / "events.h5"
    start = moving(carom.Scene.random(n, dimension=dimension, seed=2, **scene), 3)
    with carom.Simulation(start, event_log=path, **settings) as sim:
        frames = [sim.frame()]
        frames += sim.sample(times=[0.3719 * start.diameter * k for k in range(1, 9)])
        sim.run(collisions=collisions * n)
        frames += sim.sample(times=[round_up(sim), round_up(sim) + 3.0 * sim._state.epoch_length])
    assert sim.collisions > collisions * n
    for mine, right in zip(replays(path, [f.time for f in frames]), frames, strict=True):
        assert_same_frame(mine, right)
    assert_same_frame(replay(path, time=frames[7].time), frames[7])


def test_a_collision_at_the_time_that_is_asked_for_has_happened(plain, tmp_path):
    path = tmp_path / "events.h5"
    scene = carom.Scene([[1.0], [4.0]], 8.0, velocities=[[1.0], [-1.0]])
    with carom.Simulation(scene, event_log=path) as sim:
        sim.run(time=2.0)
    run = Replay(path)
    run.advance_to(np.nextafter(1.0, 0.0))
    assert run.collisions == 0
    run.advance_to(1.0)
    assert run.collisions == 1
    assert run.frame().velocities.tolist() == [[-1.0], [1.0]]


def test_a_tie_of_two_images_is_told_apart(tmp_path):
    path = tmp_path / "events.h5"
    velocities = [[1.0, 0.0], [-1.0, 0.0]]
    scene = carom.Scene([[1.0, 1.0], [12.0, 5.0]], (32.0, 8.0), diameter=5.0, velocities=velocities)
    with carom.Simulation(scene, event_log=path, seed=0) as sim:
        sim.run(collisions=9)
        (right,) = sim.sample(times=[round_up(sim)])
    assert_same_frame(replay(path, time=right.time), right)


def test_a_replay_steps_collision_by_collision(tmp_path):
    path = tmp_path / "events.h5"
    scene = moving(carom.Scene.random(20, 0.5, 2, seed=1), 1)
    with carom.Simulation(scene, event_log=path, seed=0) as sim:
        run = Replay(path)
        assert run.step() is False  # nothing logged yet
        sim.run(collisions=50)
    run = Replay(path)
    while run.step():
        pass
    assert run.collisions == 50
    assert run.time <= sim.time
    np.testing.assert_array_equal(run.frame().velocities, sim.frame().velocities)


@pytest.fixture
def short_log(tmp_path):
    path = tmp_path / "events.h5"
    scene = moving(carom.Scene.random(20, 0.5, 2, seed=1), 1)
    with carom.Simulation(scene, event_log=path, seed=0) as sim:
        sim.run(collisions=30)
    return path


@pytest.mark.parametrize("column", ["impulse", "time"])
def test_a_changed_number_is_found(short_log, column):
    with h5py.File(short_log, "r+") as file:
        file[column][7] *= 1 + 2.0**-40
    with pytest.raises(FileError, match="impulse of collision"):
        replay(short_log, time=1e3)


def test_a_foreign_initial_state_is_an_error(short_log):
    with h5py.File(short_log, "r+") as file:
        del file["initial"]["epoch_length"]
    with pytest.raises(FileError, match="epoch_length"):
        replay(short_log, time=1.0)


def test_a_missing_log_is_an_error(tmp_path):
    with pytest.raises(FileError):
        replay(tmp_path / "nothing.h5", time=1.0)


@pytest.mark.parametrize("time", [-1.0, np.nan, np.inf])
def test_impossible_times_are_errors(short_log, time):
    with pytest.raises(InputError, match="time"):
        replay(short_log, time=time)


def test_velocities_are_not_scaled_behind_the_back_of_a_log(tmp_path):
    with carom.Simulation(
        carom.Scene.crystal(cells=3, packing_fraction=0.3), event_log=tmp_path / "events.h5", seed=0
    ) as sim:
        sim.run(time=0.5)
        with pytest.raises(InputError, match="close"):
            sim.rescale(2.0)
        sim.close()
        sim.rescale(2.0)
        assert sim.kT == pytest.approx(2.0, rel=1e-14)
