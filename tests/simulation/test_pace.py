"""Compiled code returns after some hundredths of a second in any dimension; no bit depends on how often."""

import time

import numpy as np
import pytest
from helpers.oracle import moving

import carom
from carom.engine import constants, cycle
from carom.engine.build import arrays
from carom.models.contacts.restitution import Restitution
from carom.simulation import call_budget, run_loop
from carom.simulation.explanation import explain


class Clock:
    """A clock that a call moves on by as much as its work takes."""

    def __init__(self):
        self.now = 0.0

    def running(self):
        return self.now


@pytest.mark.parametrize("each", [1e-7, 1e-4, 0.3])
def test_a_call_does_what_takes_some_hundredths_of_a_second(each, monkeypatch):
    clock = Clock()
    monkeypatch.setattr(call_budget, "compile_listeners", clock)
    own = call_budget.CallBudget(20_000)
    longest = 0.0
    for _ in range(60):
        with own:
            clock.now += own.count * each
            longest = max(longest, own.count * each)
    assert longest <= max(2.0 * call_budget.SHORT, each)
    assert own.count in (20_000, 1) or 0.25 * call_budget.SHORT <= own.count * each <= call_budget.LONG


def test_a_slow_first_call_is_made_up_for(monkeypatch):
    # The first call of all compiles.
    clock = Clock()
    monkeypatch.setattr(call_budget, "compile_listeners", clock)
    own = call_budget.CallBudget(20_000)
    for k in range(20):
        with own:
            clock.now += 1e-6 * own.count + (10.0 if k == 0 else 0.0)
    assert own.count == 20_000


@pytest.mark.parametrize("count", [1, 7])
def test_how_much_a_call_does_changes_no_bit(count, monkeypatch):
    scene = moving(carom.Scene.random(40, 0.4, 2, seed=1), 2)
    usual = carom.Simulation(scene)
    monkeypatch.setattr(call_budget.CallBudget, "__exit__", lambda self, *error: None)
    monkeypatch.setattr(call_budget, "FIRST", count)
    other = carom.Simulation(scene)
    usual._state.budget.count, other._state.budget.count = 20_000, count
    for sim in (usual, other):
        sim.run(collisions=300)
        sim.run(time=0.5)
    assert usual.time == other.time
    found = arrays(other._state.engine)
    for name, array in arrays(usual._state.engine).items():
        np.testing.assert_array_equal(array, found[name], err_msg=name)


def test_what_is_given_up_is_given_up_at_the_same_event(monkeypatch):
    # Two that miss each other for ever: the run ends after so many mean free times, however it was cut.
    scene = carom.Scene([[1.0, 1.0], [5.0, 5.0]], (9.0, 9.0), velocities=[[1.0, 0.0], [1.5, 0.0]])
    ends = []
    for count in (1, 20_000):
        monkeypatch.setattr(call_budget, "FIRST", count)
        sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
        with pytest.warns(carom.CaromWarning, match="miss each other"):
            sim.run(collisions=5)
        ends.append(sim.time)
    assert ends[0] == ends[1]


class Looked(Exception):
    """Raised where a run looks at whether it comes nearer to its end."""


@pytest.mark.parametrize("count", [1, 30, 20_000])
def test_a_run_looks_around_after_the_same_work_whatever_a_call_overdraws(count, monkeypatch):
    spent = 0

    def run(*arguments):
        # What happens takes seven cycles each time, whether or not so many are left.
        nonlocal spent
        left = int(arguments[-1])
        while left > 0:
            left, spent = left - 7, spent + 7
        return constants.SPENT, left

    def look(machine):
        raise Looked

    scene = carom.Scene([[1.0, 1.0], [5.0, 5.0]], (9.0, 9.0), velocities=[[1.0, 0.0], [1.5, 0.0]])
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"))
    sim._state.budget.count = count
    monkeypatch.setattr(call_budget.CallBudget, "__exit__", lambda self, *error: None)
    monkeypatch.setattr(cycle, "run", run)
    monkeypatch.setattr(run_loop, "CYCLES", 100)
    monkeypatch.setattr(run_loop, "_patience", look)
    with pytest.raises(Looked):
        sim.run(collisions=5)
    assert spent == 105


def test_epochs_in_which_nothing_happens_count_as_cycles():
    # After a contact that leaves a millionth of the speed, thousands of epochs are empty.
    scene = carom.Scene(
        [[2.0, 5.0], [5.0, 5.0]],
        10.0,
        velocities=[[1.0, 0.0], [-1.0, 0.0]],
        impact=Restitution(1e-6, elastic_below=1e-15),
    )
    sim = carom.Simulation(scene)
    sim.run(collisions=1)
    begun = int(sim._state.engine.state.clock[0].epoch)
    code, left = cycle.run(*sim._state.engine, np.int64(2**62), 0.0, np.int64(2), np.int64(100))
    assert code == constants.SPENT
    assert left <= 0
    assert int(sim._state.engine.state.clock[0].epoch) - begun <= 100
    sim.run(collisions=1, walltime=0.0)  # one call
    assert sim.collisions == 1
    sim.run(collisions=1)
    # They part at 1e-6 each, with 8 diameters between them round the box; each epoch rounds their places.
    assert sim.time == pytest.approx(1.0 + 4e6, rel=1e-9)


@pytest.mark.timing
@pytest.mark.slow
@pytest.mark.parametrize("dimension", [8, 10])
def test_a_limit_of_wall_time_is_kept_in_high_dimension(dimension):
    # So narrow a box that all 3^d images are looked at.
    scene = carom.Scene.random(100, box=(2.3,) * dimension, diameter=1.0, seed=1)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=1)  # compiles
    began = time.perf_counter()
    sim.run(walltime=1.0)
    assert time.perf_counter() - began < 4.0


def test_in_high_dimension_everybody_is_looked_at_where_the_box_allows_it():
    scene = carom.Scene.random(100, box=(3.2,) * 8, diameter=1.0, seed=1)
    found = explain(scene)
    assert "everybody" in str(found)
