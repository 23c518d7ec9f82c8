"""Public functions with numbers that are none, out of range, or of another kind: an error of Carom's."""

import math

import pytest

import carom
from carom.errors import InputError
from carom.simulation.measuring import stretches


@pytest.fixture(scope="module")
def sim():
    return carom.Simulation(carom.Scene([[1.0, 1.0], [3.0, 3.0]], 5.0), seed=1)


WRONG = [math.nan, math.inf, -math.inf, -5, "5", None, True, [1], object()]


@pytest.mark.parametrize("value", WRONG, ids=lambda value: repr(value).partition(" at ")[0])
@pytest.mark.parametrize(
    "call",
    [
        lambda sim, x: stretches.time_for(sim, x),
        lambda sim, x: list(stretches.blocks(sim, x, 1)),
        lambda sim, x: list(stretches.blocks(sim, 1.0, x)),
        lambda sim, x: sim.measure(carom.Pressure(), time=x),
        lambda sim, x: sim.measure(carom.Pressure(), collisions=x),
        lambda sim, x: sim.measure(carom.Pressure(), collisions_per_particle=x),
        lambda sim, x: sim.measure(carom.Pressure(), relative_error=x),
        lambda sim, x: sim.measure(x, time=1.0),
        lambda sim, x: sim.run(time=x),
        lambda sim, x: sim.run(collisions=x),
        lambda sim, x: sim.run(collisions_per_particle=x),
        lambda sim, x: list(sim.sample(every=x, count=1)),
        lambda sim, x: sim.rescale(x),
        lambda sim, x: sim.measure(carom.Pressure(), time=1.0, blocks=x),
        lambda sim, x: carom.WallPressure(0, area=x) if x is not None else sim.run(time=x),
    ],
)
def test_what_is_no_number_of_the_kind_is_refused(sim, call, value):
    with pytest.raises(InputError):
        call(sim, value)


def test_a_part_of_a_collision_is_refused(sim):
    with pytest.raises(InputError, match=r"collisions must be a whole number, found 1\.5"):
        sim.run(collisions=1.5)


def test_times_say_themselves_how_many_frames_there_are(sim):
    with pytest.raises(InputError, match="leave count out"):
        sim.sample(times=[0.0, 0.0, 0.0], count=2)


@pytest.mark.parametrize("observable", [object(), carom.Pressure, "pressure"])
def test_measure_says_what_an_observable_needs(sim, observable):
    with pytest.raises(InputError, match=r"needs an observable.*add.frame.*result"):
        sim.measure(observable, time=1.0)


def test_collisions_beyond_counting_are_as_good_as_endless():
    from carom import checks

    assert checks.collisions_of(1.7e308, 1000) == 2**62
    assert checks.collisions_of(10.0, 7) == 35
