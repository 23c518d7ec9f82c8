"""The event log as one observer among others: what it makes the cycle do, and what it leaves alone."""

import numpy as np
import pytest

import carom
from carom.engine import constants, cycle
from carom.engine.build import arrays
from carom.engine.observers.event_log import make_log
from carom.engine.observers.interface import Nobody, chained
from carom.engine.observers.stop_at_hit import StopAtHit
from carom.io.events import read_events
from carom.simulation.files import recorder
from carom.simulation.files.recorder import BUFFER

FAR, ROOM, HITS = np.int64(2**62), 7, 3


def disks():
    """Return a run of disks between two walls, and the engine's numbers of both."""
    scene = carom.Scene.random(40, 0.3, 2, seed=3, walls="x")
    sim = carom.Simulation(scene, seed=1)
    return sim, sim._state.obstacle_numbers()


def until(sim, observers, collisions):
    """Run with some observers and return why the cycle ended."""
    sim._state.observe(observers)
    while True:
        code, _ = cycle.run(*sim._state.engine, FAR, 0.0, np.int64(collisions), np.int64(10_000))
        if code not in (constants.SPENT, constants.NEEDS_HEAP):
            return code
        if code == constants.NEEDS_HEAP:
            sim._state.enlarge_heap()


@pytest.mark.usefixtures("both_ways")
def test_the_cycle_returns_where_a_log_is_full_and_where_a_counter_of_hits_has_ended_the_run():
    whole, numbers = disks()
    wanted = np.zeros(max(numbers) + 1, np.bool_)
    wanted[numbers[0]] = True
    left = np.array([10**9])
    everything = make_log(400)
    assert until(whole, chained([StopAtHit(wanted, left), everything]), 100) == constants.REACHED_COLLISIONS
    struck = np.flatnonzero(everything.ref[: everything.used[0]] == constants.OBSTACLE - numbers[0])
    assert len(struck) == 10**9 - left[0] > HITS

    cut, _ = disks()
    left[0], some, found = HITS, make_log(ROOM), []
    while (code := until(cut, chained([StopAtHit(wanted, left), some]), 100)) == constants.NEEDS_LOG:
        assert some.used[0] == ROOM
        found += some.ref.tolist()
        some.used[0] = 0
    assert code == constants.REACHED_HIT
    found += some.ref[: some.used[0]].tolist()
    assert len(found) > ROOM
    assert found == everything.ref[: struck[HITS - 1] + 1].tolist()


@pytest.mark.usefixtures("both_ways")
def test_a_checkpoint_holds_the_same_with_a_log_and_without(tmp_path):
    plain, _ = disks()
    scene, path = plain.scene, tmp_path / "events.h5"
    with carom.Simulation(scene, seed=1, event_log=path) as logged:
        for sim in (plain, logged):
            sim.run(collisions=100)
        held, expected = arrays(logged._state.engine), arrays(plain._state.engine)
        assert held.keys() == expected.keys()
        for name, array in expected.items():
            assert np.array_equal(held[name], array, equal_nan=True), name
    assert len(read_events(path).time) > 100
    assert isinstance(logged._state.engine.model.observers, Nobody)  # closed: nobody writes any more


@pytest.mark.usefixtures("both_ways")
def test_a_log_is_the_same_however_often_its_buffer_is_full_and_across_a_checkpoint(tmp_path, monkeypatch):
    scene, logs = disks()[0].scene, []
    for room in (BUFFER, ROOM):
        monkeypatch.setattr(recorder, "BUFFER", room)
        path = tmp_path / f"{room}.h5"
        with carom.Simulation(scene, seed=1, event_log=path) as sim:
            sim.run(collisions=24)
            sim.save(tmp_path / "there.h5")
        with carom.Simulation.load(tmp_path / "there.h5", event_log=path) as sim:
            sim.run(collisions=8)
        logs.append(read_events(path))
    events = logs[0]
    assert (events.j < scene.n).sum() == 32  # those of pairs; others meet walls
    for name, column in events._asdict().items():
        np.testing.assert_array_equal(getattr(logs[1], name), column, err_msg=name)


@pytest.mark.usefixtures("plain")
def test_what_schedules_events_is_given_no_observer_and_so_compiled_once_for_all(tmp_path, monkeypatch):
    given, schedule = [], cycle.schedule

    def noting(model, *others):
        given.append(model.observers)
        return schedule(model, *others)

    monkeypatch.setattr(cycle, "schedule", noting)
    scene = disks()[0].scene
    with carom.Simulation(scene, seed=1, event_log=tmp_path / "events.h5") as sim:
        assert not isinstance(sim._state.engine.model.observers, Nobody)
        sim._state.schedule()
        sim.run(collisions=1)
    assert len(given) >= 2
    assert all(each is None for each in given)
