"""Accuracy as a request: measure until the error bar is small enough, and not by luck."""

import math
import time
from dataclasses import replace

import pytest

import carom
from carom.errors import CaromWarning, InputError
from carom.observables.analysis.precision import FLOOR, Goal, lengthen
from carom.observables.statistics import Estimate

PRESSURE = carom.Pressure()


@pytest.fixture
def sim():
    sim = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=50)
    return sim


@pytest.mark.parametrize("relative_error", [3e-2, 1e-2, 3e-3])
def test_a_measurement_reaches_the_relative_error_it_was_asked_for(sim, relative_error):
    z = sim.measure(PRESSURE, relative_error=relative_error).Z
    assert z.error <= relative_error * z.mean
    assert min(z.n_eff, z.blocks) >= FLOOR


def test_a_measurement_takes_no_more_than_the_law_of_large_numbers_asks(sim):
    # sigma(Z - 1) / (Z - 1) ~ 1.1 / sqrt(collisions) in a fluid (reference data, README). The square of an
    # error bar from the 256 blocks that there are at least in the end is known to sqrt(6 / 255); four of
    # these, a tenth for a last look that came late, and a tenth for the law itself.
    before = sim.collisions
    z = sim.measure(PRESSURE, relative_error=2e-3).Z
    expected = (1.1 * (z.mean - 1) / z.mean / 2e-3) ** 2
    known = 4 * math.sqrt(6 / 255)
    assert (1 - known) / 1.1 * expected < sim.collisions - before < (1 + known) * 1.1 * 1.1 * expected


def test_the_length_depends_on_nothing_but_the_run(sim):
    scene = sim.scene
    other = carom.Simulation(scene, seed=1)
    other.run(collisions_per_particle=20)
    other.frame()
    other.run(collisions=sim.collisions - other.collisions)
    fractions, predictions = [], []
    one = sim.measure(PRESSURE, relative_error=1e-2)
    two = other.measure(
        PRESSURE, relative_error=1e-2, progress=fractions.append, predicted=predictions.append
    )
    assert one == two
    assert (sim.time, sim.collisions) == (other.time, other.collisions)
    assert fractions[-1] == 1.0
    assert all(0.0 <= fraction <= 1.0 for fraction in fractions)


def test_a_pilot_predicts_what_is_still_to_come(sim):
    predictions, done = [], []

    def look(prediction):
        predictions.append(prediction)
        done.append(sim.collisions)

    z = sim.measure(PRESSURE, relative_error=2e-3, predicted=look).Z
    first, last = predictions[0], predictions[-1]
    # The square of the pilot's error bar, from 64 blocks, is known to sqrt(6 / 63); four of these.
    total, known = done[0] + first.collisions, 1 + 4 * math.sqrt(6 / 63)
    assert sim.collisions / known < total < sim.collisions * known
    assert 0.0 < first.seconds < math.inf
    assert last.relative_error > 2e-3 >= z.error / z.mean


@pytest.mark.timing
def test_the_wall_time_bounds_a_request_out_of_reach(sim):
    began = time.perf_counter()
    fractions = []
    with pytest.warns(CaromWarning, match="walltime"):
        z = sim.measure(PRESSURE, relative_error=1e-9, walltime=0.3, progress=fractions.append)
    assert 0.3 <= time.perf_counter() - began < 10.0
    assert z.Z.error > 1e-9
    assert fractions == sorted(fractions)


def test_hardly_any_wall_time_leaves_an_estimate_and_warnings(sim):
    with pytest.warns(CaromWarning):
        z = sim.measure(PRESSURE, relative_error=1e-3, walltime=1e-9).Z
    assert math.isfinite(z.mean)


@pytest.mark.parametrize("value", [0.0, 1.5, math.nan, "1e-3"])
def test_an_impossible_relative_error_is_refused(sim, value):
    with pytest.raises(InputError, match="relative_error"):
        sim.measure(PRESSURE, relative_error=value)


def test_a_measurement_has_one_length(sim):
    with pytest.raises(InputError, match="exactly one"):
        sim.measure(PRESSURE, relative_error=1e-2, time=1.0)
    with pytest.raises(InputError, match="exactly one"):
        sim.measure(PRESSURE)
    with pytest.raises(InputError, match="go with relative_error"):
        sim.measure(PRESSURE, time=1.0, walltime=1.0)


def test_a_lonely_sphere_has_nothing_to_measure(unscheduled):
    sim = carom.Simulation(carom.Scene([[0.5, 0.5]], 2.0), seed=1)
    with pytest.raises(InputError, match="Nothing collides"):
        sim.measure(PRESSURE, relative_error=1e-2)


def test_a_small_error_bar_from_few_blocks_is_not_believed():
    lucky = Estimate(mean=5.0, error=1e-4, n_eff=20.0, tau=3.0, blocks=20)
    sound = Estimate(mean=5.0, error=1e-4, n_eff=200.0, tau=3.0, blocks=100)
    goal = Goal(1e-3)
    assert not goal.reached(lucky)
    assert goal.reached(sound)
    # It has 20 of the 64 blocks that are needed.
    assert goal.remaining(lucky) == pytest.approx(FLOOR / 20)


def test_a_stretch_grows_with_the_square_of_the_error_and_never_too_much():
    goal = Goal(1e-2)
    assert goal.remaining(Estimate(2.0, 0.06, 100.0, 1.0, 100)) == pytest.approx(9.0)
    assert goal.next_look(100, Estimate(2.0, 0.06, 100.0, 1.0, 100)) == 400
    assert goal.next_look(100, Estimate(2.0, 0.03, 100.0, 1.0, 100)) == 225
    assert goal.next_look(100, Estimate(2.0, 0.0201, 100.0, 1.0, 100)) == 111
    assert goal.remaining(Estimate(0.0, 0.1, 100.0, 1.0, 100)) == math.inf


def test_anticorrelated_blocks_do_not_wait_for_ever():
    # Of rods on a ring, which move periodically, blocking always ends with 16 blocks, fewer than the floor.
    found = Estimate(mean=1.9, error=1e-3, n_eff=5000.0, tau=0.2, blocks=16)
    assert Goal(1e-3).reached(found)
    assert not Goal(1e-3).reached(replace(found, n_eff=16.0))


def test_a_stretch_grows_until_its_error_fits_and_no_longer():
    looks = []

    def extend(length):
        looks.append(length)
        return length

    def error_bar():  # one that falls as the square root of the length
        n = looks[-1]
        return Estimate(mean=1.0, error=n**-0.5, n_eff=float(n), tau=1.0, blocks=n)

    assert lengthen(Goal(0.02), 64, extend, error_bar)
    # Four times as long at most, then what 1 / 0.02^2 asks for.
    assert looks == [64, 256, 1024, 2500]
    assert not lengthen(Goal(0.02), 64, lambda length: None, error_bar)
    assert lengthen(Goal(0.02), 64, extend, lambda: None)
