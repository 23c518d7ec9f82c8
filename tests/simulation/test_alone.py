"""One simulation is used by one thread, and nothing public ends the interpreter."""

import contextlib
import copy
import os
import pickle
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import forked

import carom
from carom.compiling import entry
from carom.engine import cycle
from carom.errors import BusyError
from carom.simulation.call_budget import CallBudget
from carom.simulation.measuring import stretches
from carom.simulation.replay import Replay
from carom.simulation.workers.thread_pool import ThreadPool


def small(**more):
    return carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1, **more)


USES = {
    "run": lambda sim: sim.run(collisions=10),
    "sample": lambda sim: next(sim.sample(every=0.1, count=1)),
    "blocks": lambda sim: next(stretches.blocks(sim, 0.1, 1)),
    "measure": lambda sim: sim.measure(carom.Pressure(), collisions=10),
    "time_for": lambda sim: stretches.time_for(sim, 10),
    "rescale": lambda sim: sim.rescale(2.0),
    "save": lambda sim: sim.save(os.devnull),
    "close": lambda sim: sim.close(),
    "frame": lambda sim: sim.frame(),
    "kT": lambda sim: sim.kT,
    "time": lambda sim: sim.time,
    "collisions": lambda sim: sim.collisions,
    "tally": lambda sim: stretches.tally(sim),
    "statistics": lambda sim: sim.statistics,
    "diameters": lambda sim: sim.diameters,
    "obstacles": lambda sim: sim.obstacles,
    "packing_fraction": lambda sim: sim.packing_fraction,
}


def test_a_second_thread_is_refused_whatever_it_asks_and_the_first_goes_on():
    sim, alone = small(), small()
    alone.run(collisions=800)
    refused: dict[str, str] = {}

    def meddle():
        for name, use in USES.items():
            try:
                use(sim)
            except BusyError as error:
                refused[name] = str(error)

    def look(fraction):
        if not refused:
            thread = threading.Thread(target=meddle)
            thread.start()
            thread.join()

    sim.run(collisions=800, progress=look)
    assert set(refused) == set(USES)
    assert all("another thread" in text for text in refused.values())
    np.testing.assert_array_equal(sim.frame().positions, alone.frame().positions)


@pytest.mark.parametrize("name", ["run", "sample", "blocks", "measure", "rescale", "close"])
def test_a_callback_may_look_but_not_run_on(name):
    sim = small()

    def meddle(fraction):
        sim.frame(), sim.statistics, sim.kT
        USES[name](sim)

    with pytest.raises(BusyError, match="a callback may look"):
        sim.run(collisions=1000, progress=meddle)
    assert sim.run(collisions=100).collisions == 100  # and it is free again


def test_threads_that_run_one_simulation_at_once_all_end():
    sim, done, refused = small(), [], []

    def work():
        for _ in range(20):
            try:
                done.append(sim.run(collisions=2000).collisions)
            except BusyError:
                refused.append(1)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(done) + len(refused) == 80
    assert sim.collisions == sum(done)


def test_samples_and_runs_may_take_turns_in_one_thread():
    sim, plain = small(), small()
    frames = sim.sample(every=0.3)
    for _ in range(3):
        next(frames)
        sim.run(collisions=5)
    plain.run(time=sim.time)
    np.testing.assert_allclose(sim.frame().positions, plain.frame().positions, atol=1e-9)
    sim.run(time=1.0)
    with pytest.raises(carom.InputError, match="must not decrease"):
        next(frames)
    assert sim.run(collisions=10).collisions == 10


@pytest.mark.slow
def test_what_failed_to_grow_can_be_used_on():
    scene = carom.Scene.random(20, 0.3, 2, seed=1)
    sim = carom.Simulation(scene, seed=1, growth=0.5)
    with pytest.raises(carom.InputError, match="jam"):
        sim.run(time=1e6)
    sim.frame(), sim.statistics
    assert sim.run(collisions=50).collisions == 50


def test_ctrl_c_before_everybody_is_scheduled_in_larger_rooms_loses_nothing():
    sim, plain = (
        small(tuning=carom.Tuning(neighbors="sectors")),
        small(tuning=carom.Tuning(neighbors="sectors")),
    )
    for each in (sim, plain):
        each.run(collisions=100)
        each._state.enlarge_neighbors()  # empty rooms: Ctrl-C comes here
    plain._state.schedule()
    for each in (sim, plain):
        each.run(collisions=300)
    np.testing.assert_array_equal(sim.frame().positions, plain.frame().positions)


def test_ctrl_c_while_everything_is_chosen_anew_leaves_the_simulation_as_it_was(monkeypatch):
    sim, plain = small(), small()
    for each in (sim, plain):
        each.run(collisions=300)

    def stop():
        raise KeyboardInterrupt

    monkeypatch.setattr(sim._state, "schedule", stop)
    with pytest.raises(KeyboardInterrupt):
        sim.rescale(4.0)
    monkeypatch.undo()
    for each in (sim, plain):
        each.run(collisions=300)
    np.testing.assert_array_equal(sim.frame().velocities, plain.frame().velocities)


@contextlib.contextmanager
def ctrl_c(every, stops):
    """Let Ctrl-C come in every so many-th of those compiled calls whose budget ``stops`` says so."""

    def end(budget, *error):
        budget.count = 6
        if stops(budget):
            calls.append(budget)
            if len(calls) % every == 0:
                raise KeyboardInterrupt

    calls = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CallBudget, "__exit__", end)
        yield


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("scheme", ["lists", "sectors"])
def test_a_file_that_is_saved_after_ctrl_c_while_events_were_predicted_has_all_events(tmp_path, scheme):
    scene, tuning = carom.Scene.random(16, 0.3, 2), carom.Tuning(neighbors=scheme)
    sim, alone = (carom.Simulation(scene, seed=1, tuning=tuning) for _ in range(2))
    for each in (sim, alone):
        each.run(collisions=20)
    sim._state.enlarge_neighbors()
    with ctrl_c(2, lambda budget: True), pytest.raises(KeyboardInterrupt):
        sim.run(collisions=1)
    assert not sim._state.scheduled
    sim.save(tmp_path / "here.h5")
    for each in (sim, loaded := carom.load(tmp_path / "here.h5"), alone):
        each.run(collisions=60)
    np.testing.assert_array_equal(sim.frame().positions, alone.frame().positions)
    np.testing.assert_array_equal(loaded.frame().positions, alone.frame().positions)


INTERRUPTED = {
    "hard cores": {},
    "tilting lattice": {"motion": carom.models.Shear(2.0)},
    "wells": {"interaction": carom.models.SquareWell(1.5, 1.0)},
}


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("name", INTERRUPTED)
def test_after_ctrl_c_in_a_run_its_state_is_that_of_the_last_event_and_nothing_is_lost(tmp_path, name):
    scene = carom.Scene.random(16, 0.3, 2, **INTERRUPTED[name])
    sim, alone = (carom.Simulation(scene, seed=1) for _ in range(2))
    end, came = 2.0, 0
    while True:
        try:
            with ctrl_c(2, lambda budget: budget is sim._state.budget):
                sim.run(time=end - sim.time)
            break
        except KeyboardInterrupt:
            came += 1
        assert sim.statistics.worst_overlap < 1e-12  # some roundings
        if came % 3 == 0:
            sim.save(tmp_path / "here.h5")
            assert carom.load(tmp_path / "here.h5").collisions == sim.collisions
    alone.run(time=end)
    assert came > 3
    assert sim.collisions == alone.collisions
    # Pairs on steps and under shear are predicted from the present: rounding grows by some e a collision.
    np.testing.assert_allclose(sim.frame().positions, alone.frame().positions, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("copied", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_simulation_is_neither_pickled_nor_copied(copied):
    with pytest.raises(TypeError, match=r"save\(\) it"):
        copied(small())


@pytest.mark.needs("Unix")
def test_a_forked_process_goes_on_with_a_simulation_of_its_own():
    sim = small()
    sim.run(collisions=100)
    assert forked.status(lambda: int(sim.run(collisions=500).collisions != 500)) == 0
    assert sim.run(collisions=500).collisions == 500


@pytest.mark.needs("Unix")
def test_a_forked_process_has_threads_of_its_own():
    # Those of the parent are not there, and were waited for.
    pool, meeting = ThreadPool(2), threading.Barrier(2)

    def both():
        return int(sorted(pool.each(lambda k: meeting.wait(), halt=lambda: None)) != [0, 1])

    def both_and_close():
        code = both()
        pool.close()
        return code

    def close():
        pool.close()
        return 0

    assert both() == 0
    assert forked.status(both_and_close) == 0
    assert forked.status(close) == 0
    assert both() == 0
    pool.close()


@pytest.mark.needs("Unix")
def test_a_forked_process_leaves_the_event_log_to_its_parent(tmp_path):
    with small(event_log=tmp_path / "log.h5") as sim:
        sim.run(collisions=100)

        def busy():
            for use in (lambda: sim.run(collisions=1), lambda: sim.save(tmp_path / "state.h5")):
                with pytest.raises(BusyError, match="written by the process of which this one is a fork"):
                    use()
            sim.close()
            return int(sim.run(collisions=10).collisions != 10)

        assert forked.status(busy) == 0
        sim.run(collisions=50)
    assert not (tmp_path / "state.h5").exists()
    run = Replay(tmp_path / "log.h5")
    while run.step():
        pass
    assert run.collisions == 150


def test_a_limit_of_wall_time_leaves_out_compiling(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(entry, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    sim, run, passing = small(), cycle.run, 0.001

    def slowly(*arguments):
        if now[0] == 0.0:
            now[0] += 100.0
            monkeypatch.setattr(entry, "_spent", entry._spent + 100.0)
        now[0] += passing
        return run(*arguments)

    monkeypatch.setattr(cycle, "run", slowly)
    assert sim.run(collisions=300, walltime=1.0).collisions == 300
    assert now[0] > 100.0
    assert sim.statistics.seconds < 1.0
    passing = 2.0
    assert sim.run(collisions=30000, walltime=1.0).collisions < 30000


def test_compiling_is_told_apart_from_running(monkeypatch):
    before = entry._spent
    twice = entry.entry(lambda x: 2.0 * x)
    assert twice(1.5) == 3.0
    spent = entry._spent
    assert spent > before or entry.DISABLED
    assert twice(2.5) == 5.0
    assert entry._spent == spent


def test_a_negative_seed_is_one_sentence():
    with pytest.raises(carom.InputError, match="seed"):
        carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=-1)


def test_what_is_handed_out_does_not_reach_into_the_run():
    sim, plain = small(), small()
    frame = sim.frame()
    for array in (frame.positions, frame.velocities, frame.images, sim.diameters):
        if array.flags.writeable:
            array[:] = 0
    for each in (sim, plain):
        each.run(collisions=500)
    np.testing.assert_array_equal(sim.frame().positions, plain.frame().positions)
    assert sim.diameters.min() > 0.0
