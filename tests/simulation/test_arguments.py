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
PRESSURE = carom.Pressure()
CALLS = [
    ("collisions", lambda sim, x: stretches.time_for(sim, x)),
    ("duration", lambda sim, x: list(stretches.blocks(sim, x, 1))),
    ("count", lambda sim, x: list(stretches.blocks(sim, 1.0, x))),
    *(
        (name, lambda sim, x, name=name: sim.measure(PRESSURE, **{name: x}))
        for name in ("time", "collisions", "collisions_per_particle", "relative_error")
    ),
    ("blocks", lambda sim, x: sim.measure(PRESSURE, time=1.0, blocks=x)),
    *(
        (name, lambda sim, x, name=name: sim.run(**{name: x}))
        for name in ("time", "collisions", "collisions_per_particle", "walltime")
    ),
    ("every", lambda sim, x: list(sim.sample(every=x, count=1))),
    ("kT", lambda sim, x: sim.rescale(x)),
    ("area", lambda sim, x: carom.WallPressure(0, area=x)),
    ("shell", lambda sim, x: carom.Tuning(shell=x)),
    ("growth", lambda sim, x: carom.Simulation(sim.scene, growth=x)),
]
MAY_BE_LEFT_OUT = ("area", "shell", "growth")


@pytest.mark.parametrize("value", WRONG, ids=lambda value: repr(value).partition(" at ")[0])
@pytest.mark.parametrize(("name", "call"), CALLS)
def test_what_is_no_number_of_the_kind_is_refused(sim, name, call, value):
    if value is None and name in MAY_BE_LEFT_OUT:
        call(sim, value)
        return
    with pytest.raises(InputError) as caught:
        call(sim, value)
    said = str(caught.value)
    assert said.startswith(f"{name} must be") or (value is None and "() needs" in said)
    assert sim.collisions == 0


def test_a_part_of_a_collision_is_refused(sim):
    with pytest.raises(InputError, match=r"collisions must be a whole number, found 1\.5"):
        sim.run(collisions=1.5)
    with pytest.raises(InputError, match="count must be an integer"):
        list(stretches.blocks(sim, 0.1, 2.5))


def test_times_say_themselves_how_many_frames_there_are(sim):
    with pytest.raises(InputError, match="leave count out"):
        sim.sample(times=[0.0, 0.0, 0.0], count=2)


def test_collisions_beyond_counting_are_as_good_as_endless():
    from carom import checks

    assert checks.collisions_of(1.7e308, 1000) == 2**62
    assert checks.collisions_of(10.0, 7) == 35
