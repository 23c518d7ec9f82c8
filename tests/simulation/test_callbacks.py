"""What a run calls on its way, and what ends it: exact times, exact events, and the same bits."""

import csv
from fractions import Fraction

import numpy as np
import pytest

import carom
from carom.errors import BusyError, CaromWarning, FileError, InputError
from carom.models import Ball, Segment, Wall
from carom.simulation.measuring import stretches
from carom.simulation.run_loop import advance

DOOR = Ball((3.0, 5.0), 1.0, "door")
SCENE = carom.Scene.random(12, box=(6.0, 8.0), seed=1, walls="y", obstacles=[DOOR])


def fluid(n=30, **settings):
    return carom.Simulation(carom.Scene.random(n, 0.3, 2, seed=1), seed=2, **settings)


def bits(sim):
    frame = sim.frame()
    return sim.collisions, sim.time, frame.positions.tobytes(), frame.velocities.tobytes()


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("settings", [{}, {"growth": 0.002}], ids=["fluid", "growing"])
def test_calls_at_exact_times_do_not_change_the_run(plain, settings):
    quiet, called = (fluid(12, **settings) for _ in range(2))
    quiet.run(time=3.0)
    times, places = [], []
    called.run(
        time=3.0,
        every=0.375,
        call=[lambda sim: times.append(sim.time), lambda sim: places.append(sim.positions)],
    )
    assert times == [0.375 * k for k in range(1, 9)]
    assert bits(called) == bits(quiet)
    sampled = [frame.positions for frame in fluid(12, **settings).sample(every=0.375, count=8)]
    np.testing.assert_array_equal(places, sampled)


def test_a_run_to_a_number_of_collisions_is_the_same_with_calls():
    plain, called, seen = fluid(), fluid(), []
    block = plain.run(collisions=500)
    assert called.run(collisions=500, every=0.1, call=seen.append) == block
    assert len(seen) == int(Fraction(block.duration) / Fraction(0.1))
    assert bits(called) == bits(plain)


def test_a_run_can_go_on_after_a_callback_has_failed(tmp_path):
    plain, failed = fluid(), fluid()
    plain.run(time=4.0)

    def fail(sim):
        sim.save(tmp_path / "state.h5")
        if sim.time >= 1.5:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        failed.run(time=4.0, every=0.5, call=fail)
    assert failed.time == 1.5
    for sim in (failed, carom.Simulation.load(tmp_path / "state.h5")):
        sim.run(time=2.5)
        assert bits(sim) == bits(plain)


def test_a_callback_looks_and_does_not_steer():
    with pytest.raises(BusyError, match="callback"):
        fluid().run(time=1.0, every=0.5, call=lambda sim: sim.run(time=1.0))


@pytest.mark.usefixtures("both_ways")
def test_a_run_ends_exactly_at_the_hit_of_an_obstacle():
    plain, stopped, there = (carom.Simulation(SCENE, seed=2) for _ in range(3))
    plain.run(time=5.0)
    stopped.run(until=carom.hit("door"), time=5.0)
    assert stopped.obstacles[-1].hits == 1
    # Whoever hit it touches it: the distance of the centers is that of contact, within rounding.
    gap = np.linalg.norm(stopped.positions - np.array(DOOR.center), axis=1).min() - (DOOR.radius + 0.5)
    assert abs(gap) < 1e-13 * max(SCENE.box)
    advance(there._state, None, stopped._state.clock.instant)
    assert bits(there) == bits(stopped)
    assert there.obstacles == stopped.obstacles
    for sim in (stopped, there):
        advance(sim._state, None, Fraction(5))
        assert bits(sim) == bits(plain)


@pytest.mark.usefixtures("both_ways")
def test_hits_of_several_obstacles_are_counted_together(tmp_path):
    names = [each.name for each in carom.Simulation(SCENE).obstacles]
    with carom.Simulation(SCENE, seed=2, event_log=tmp_path / "events.h5") as sim:
        sim.run(until=carom.hit(DOOR, *names[:2], count=7))
        assert sum(each.hits for each in sim.obstacles) == 7
    with carom.Simulation(SCENE, seed=2, event_log=tmp_path / "plain.h5") as plain:
        advance(plain._state, None, sim._state.clock.instant)
    assert (tmp_path / "events.h5").stat().st_size == (tmp_path / "plain.h5").stat().st_size
    assert bits(plain) == bits(sim)


MIXED = (
    Ball((1.5, 6.5), 0.5, "post"), Segment((4.2, 1.6), (5.0, 1.6), 0.2, "bar"), DOOR,
    Segment((4.2, 6.4), (5.0, 6.4), 0.2, "rail"), Ball((1.5, 1.5), 0.5, impact=0.9),
)  # of three kinds, not in the order in which the engine puts kinds  # fmt: skip


@pytest.mark.parametrize("k", range(len(MIXED)))
def test_a_run_ends_at_that_obstacle_and_at_no_other_beside_walls_with_properties(plain, k):
    walls = {"y_low": Wall(impact=0.9), "y_high": Wall(kT=1.0, seed=3)}
    scene = carom.Scene.random(12, box=(6.0, 8.0), seed=1, walls=walls, obstacles=MIXED)
    ends = []
    for until in (carom.hit(MIXED[k]), carom.hit(MIXED[k].name)):
        sim = carom.Simulation(scene, seed=2)
        sim.run(until=until, time=50.0)
        first = {each.name: each.hits for each in sim.obstacles[2:]}
        assert first[MIXED[k].name] == 1
        gaps = MIXED[k].gap(sim.positions, np.full(12, 0.5), scene.box, scene.periodic)
        assert abs(gaps.min()) < 1e-13 * max(scene.box)
        ends.append(bits(sim))
    assert ends[0] == ends[1]


def test_a_run_whose_limit_comes_before_the_hit_ends_there(plain):
    sim = carom.Simulation(SCENE, seed=2)
    assert sim.run(until=carom.hit("door", count=1000), collisions=10).collisions == 10


def test_a_condition_is_looked_at_every_so_often():
    sim = fluid()
    sim.run(until=lambda sim: sim.collisions >= 100, every=0.25)
    assert sim.collisions >= 100
    assert sim.time % 0.25 == 0.0
    before = fluid()
    before.run(time=sim.time - 0.25)
    assert before.collisions < 100
    assert sim.run(until=lambda sim: True).duration == 0.0  # it holds already


def test_a_condition_without_times_ends_the_run_at_the_same_event_every_time():
    looked = []

    def later(sim):
        looked.append(sim.collisions)
        return sim.collisions > 8000

    ends = []
    for _ in range(2):
        sim = fluid()
        sim.run(until=later)
        ends.append(bits(sim))
    assert ends[0] == ends[1]
    assert looked[0] == 0 < looked[1]


@pytest.mark.parametrize(
    ("keywords", "says"),
    [
        ({"until": carom.hit("gate")}, "no obstacle named 'gate'"),
        ({"until": carom.hit(Ball((1.0, 1.0), 0.5))}, "no obstacle such as this Ball"),
        ({"until": 100}, "carom.hit"),
        ({"time": 1.0, "call": print}, "call= needs every="),
        ({"time": 1.0, "every": 1.0}, "every= needs call="),
        ({"time": 1.0, "every": 0.0, "call": print}, "every must be greater than 0"),
        ({"time": 1.0, "every": 1.0, "call": "print"}, "call must be a function"),
        ({"max_walltime": 1.0}, "it is called walltime"),
        ({"collision": 1}, "did you mean collisions"),
        ({}, "until"),
    ],
)
def test_a_wrong_word_of_a_run_is_one_sentence(unscheduled, keywords, says):
    with pytest.raises(InputError, match=says):
        carom.Simulation(SCENE, seed=2).run(**keywords)


@pytest.mark.usefixtures("both_ways")
def test_where_nothing_moves_nothing_is_hit():
    still = SCENE.replace(velocities=np.zeros((SCENE.n, 2)))
    with pytest.warns(CaromWarning, match="Nothing moves"):
        carom.Simulation(still).run(until=carom.hit("door"))


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("impact", [None, 0.9], ids=["fluid", "cooling"])
def test_a_log_holds_what_the_run_had(impact, tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    sim = carom.Simulation(carom.Scene.random(30, 0.3, 2, seed=1, impact=impact), seed=2)
    log, blocks = carom.CSVLog("log.csv"), [stretches.tally(sim)]
    for folder in (".", "elsewhere"):  # what has begun stays where it is
        monkeypatch.chdir(folder)
        sim.run(time=2.0, every=0.5, call=lambda sim: (log(sim), blocks.append(stretches.tally(sim))))
    found = rows(tmp_path / "log.csv")
    assert [float(row["time"]) for row in found] == [0.5 * k for k in range(1, 9)]
    assert int(found[-1]["collisions"]) == sim.collisions
    assert float(found[-1]["kT"]) == sim.kT
    heat = [sim.kT * each.duration if each.kT_time is None else each.kT_time for each in blocks]
    excess = np.diff([each.virial for each in blocks]) / (2 * sim.n * np.diff(heat))
    assert [float(row["Z"]) for row in found] == pytest.approx(1.0 + excess, rel=1e-12)
    assert "U" not in found[0]


def test_a_log_has_columns_of_its_own(tmp_path):
    log = carom.CSVLog(
        tmp_path / "log.csv", {"time": None, "fastest": lambda sim: np.abs(sim.velocities).max()}
    )
    sim = fluid()
    sim.run(time=1.0, every=0.5, call=log)
    assert list(rows(tmp_path / "log.csv")[0]) == ["time", "fastest"]
    with pytest.raises(InputError, match="no column 'pressure'"):
        carom.CSVLog(tmp_path / "other.csv", ["pressure"])


def test_a_log_is_appended_to_when_a_run_is_resumed(tmp_path):
    path, sim = tmp_path / "log.csv", fluid()
    log = carom.CSVLog(path)
    sim.run(time=1.0, every=0.5, call=log)
    sim.save(tmp_path / "state.h5")
    sim.run(time=1.0, every=0.5, call=log)  # lost, as if the machine had failed
    whole = path.read_text()
    resumed = carom.Simulation.load(tmp_path / "state.h5")
    with pytest.raises(FileError, match="append=True"):
        resumed.run(time=1.0, every=0.5, call=carom.CSVLog(path))
    assert path.read_text() == whole
    again = carom.Simulation.load(tmp_path / "state.h5")
    again.run(time=1.0, every=0.5, call=carom.CSVLog(path, append=True))
    assert [row["time"] for row in rows(path)] == ["0.5", "1.0", "1.5", "2.0"]
    assert rows(path)[2]["Z"] == ""
    assert path.read_text().splitlines()[-1] == whole.splitlines()[-1]
    with pytest.raises(FileError, match="has the columns"):
        again.run(time=1.0, every=0.5, call=carom.CSVLog(path, ["time"], append=True))
    with path.open("a") as file:
        file.write("what is this\n")
    text = path.read_text()
    with pytest.raises(FileError, match="a row without a time"):
        again.run(time=1.0, every=0.5, call=carom.CSVLog(path, append=True))
    assert path.read_text() == text


def test_a_disk_that_is_full_leaves_the_rows_of_a_log(tmp_path, monkeypatch):
    path, sim = tmp_path / "log.csv", fluid()
    sim.run(time=1.0, every=0.5, call=carom.CSVLog(path))
    text = path.read_text()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(FileError, match="No space left"):
        sim.run(time=1.0, every=0.5, call=carom.CSVLog(path, append=True))
    assert path.read_text() == text
    assert [each.name for each in tmp_path.iterdir()] == ["log.csv"]
