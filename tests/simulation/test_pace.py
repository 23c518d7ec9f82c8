"""Which of two ways to run is faster runs: several workers or one, memory asked for ahead or not."""

from types import SimpleNamespace

import pytest

import carom
from carom.engine.neighbors import sectors
from carom.simulation.autotune import COST, FEWEST_STRETCHES, LEAST_SECONDS, STRETCH, Pace

N = 100_000
CALL = 0.01  # wall time of a call of the run loop [s]


class Machine:
    """A run on a clock of its own, with rates of several workers and of one in collisions a second."""

    def __init__(self, several, one):
        self.rates = {True: several, False: one}
        self.run_state = SimpleNamespace(collisions=0, seconds=0.0, scene=SimpleNamespace(n=N))
        self.pace = Pace(self.run_state)

    def run(self, seconds):
        """Run for a wall time; return the rate, and the part of it in which several ran."""
        calls = round(seconds / CALL)
        counts = {True: 0, False: 0}
        for _ in range(calls):
            several = self.pace.first()
            counts[several] += 1
            self.run_state.seconds += CALL
            self.run_state.collisions += round(self.rates[several] * CALL)
        return sum(counts[who] * self.rates[who] for who in counts) / calls, counts[True] / calls


@pytest.mark.parametrize(("several", "one"), [(1.9e6, 1e6), (1.15e6, 1e6), (0.45e6, 1e6), (0.1e6, 1e6)])
def test_who_is_faster_runs_and_trials_of_the_other_cost_little(several, one):
    machine = Machine(several, one)
    machine.run(30.0)
    rate, part = machine.run(600.0)
    assert rate > (1.0 - 2.0 * COST) * max(several, one)
    slow, fast = sorted((several, one))
    trial = max(LEAST_SECONDS, 0.5 * STRETCH * N / slow)
    lost = 1.0 - slow / fast  # of a trial; all of them lose a part COST of the wall time in the long run
    wait = trial * lost / COST
    # A trial begins a stretch too late at most, lasts a call longer, and there may be one more or less.
    off = (LEAST_SECONDS + CALL) / wait + CALL / trial + (wait + trial) / 600.0
    slower = 1.0 - part if several > one else part
    assert slower == pytest.approx(trial / (wait + trial), rel=off)


def test_one_goes_on_as_soon_as_another_process_takes_a_core_and_several_do_when_it_is_gone():
    machine = Machine(1.4e6, 1e6)
    machine.run(60.0)
    machine.rates[True] = 0.45e6
    rate, _ = machine.run(20.0)
    assert rate > 0.9e6
    machine.rates[True] = 1.4e6
    machine.run(60.0)
    assert machine.run(60.0)[1] > 0.85


def test_two_of_equal_rates_are_not_exchanged_all_the_time():
    machine = Machine(1e6, 1e6)
    changes, before = 0, True
    for _ in range(1000):
        machine.run(CALL)
        several = machine.pace.first()
        changes, before = changes + (several != before), several
    assert changes <= 2 * (1 + 1000 * CALL / (FEWEST_STRETCHES * LEAST_SECONDS))


def test_only_large_systems_in_sectors_try_whether_memory_is_to_be_asked_for_ahead(plain, monkeypatch):
    def asked(kind, n):
        monkeypatch.setattr(sectors, "PREFETCH_FROM", n)
        sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=kind))
        monkeypatch.setattr(sim._state.pace, "first", lambda: False)
        sim.run(collisions=1)
        return sim._state.engine.calendar.control.ahead[0]

    scene = carom.Scene.random(20, 0.1, 2, seed=1)
    assert [asked(*each) for each in (("sectors", 20), ("sectors", 21), ("lists", 20))] == [0, 1, 1]


def test_a_stretch_that_was_disturbed_does_not_decide_for_long():
    machine = Machine(0.45e6, 1e6)
    machine.run(0.2)
    while machine.pace.first():
        machine.run(CALL)
    machine.rates[False] = 0.2e6  # all the while that one is tried
    while not machine.pace.first():
        machine.run(CALL)
    machine.rates[False] = 1e6
    machine.run(20.0)
    assert machine.run(10.0)[1] < 0.15
