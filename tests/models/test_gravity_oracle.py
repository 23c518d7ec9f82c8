"""Gravity over a shaken floor in one to four dimensions: the oracle's events in its order."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from helpers.naive.falling import fall, over_a_floor as events_over_a_floor

import carom
from carom.io.events import read_events
from carom.models import Gravity, Loss, Plane, Sine
from carom.models.obstacles.named_walls import axes_without

HEIGHT, EDGE, OFFSET = 12.0, 4.5, 0.5
AMPLITUDE, PERIOD, CONTACT_TIME = 0.3, 2.0, 1e-3


def bed(d, restitution, n=5):
    """Return spheres of diameter 1 over a floor; the field is oblique where there is an axis across."""
    rng = np.random.default_rng(d)
    places = np.full((n, d), 1.0)
    for k in range(n):
        places[k, -1] = 1.6 + 1.4 * k  # a column, a little out of line
        places[k, :-1] += 0.1 * k
    loss = Loss(restitution, contact_time=CONTACT_TIME)
    up = (*[0.0] * (d - 1), 1.0)
    floor = Plane(up, OFFSET, "floor", shake=Sine(AMPLITUDE, PERIOD), impact=loss)
    return carom.Scene(
        places, (*[EDGE] * (d - 1), HEIGHT), velocities=0.3 * rng.normal(size=places.shape),
        walls=axes_without((*[True] * (d - 1), False)), motion=Gravity((*[0.1] * (d - 1), -1.0)),
        obstacles=[floor], impact=loss,
    )  # fmt: skip


def oracle(scene, restitution):
    lost = {"restitution": restitution, "contact_time": CONTACT_TIME}
    return events_over_a_floor(scene, OFFSET, AMPLITUDE, PERIOD, restitution, **lost)


def assert_events_are_the_oracles(d, restitution, count, time=60.0):
    scene = bed(d, restitution)
    with tempfile.TemporaryDirectory() as folder:
        with carom.Simulation(scene, event_log=Path(folder) / "log.h5", seed=0) as sim:
            sim.run(time=time)
            length = sim._state.epoch_length
        found = read_events(Path(folder) / "log.h5")
    rows = zip(found.epoch, found.time, found.i, found.j, strict=True)
    events = [(epoch * length + t, i, j) for epoch, t, i, j in rows]
    assert len(events) >= count
    pairs = 0
    for k, (step, (at, i, j)) in enumerate(zip(oracle(scene, restitution), events[:count], strict=False)):
        assert {step.i, step.j} == {i, j}
        # A sphere flies some five diameters and amplifies errors by twenty at a collision. Half of the events
        # are collisions, of two of five.
        assert abs(float(step.time) - at) < 1e-14 * 20.0 ** (0.2 * k + 1)
        pairs += step.j < scene.n
    return pairs


@pytest.mark.parametrize(("d", "count", "time"), [(2, 30, 14.0), (3, 18, 16.0)])
def test_events_are_those_of_the_oracle(plain, d, count, time):
    assert assert_events_are_the_oracles(d, 0.9, count, time) > 3


@pytest.mark.slow
@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("restitution", [1.0, 0.9])
def test_compiled_events_in_any_dimension_are_those_of_the_oracle(d, restitution):
    assert assert_events_are_the_oracles(d, restitution, 40) > 5


def test_an_oracle_that_nobody_would_end_says_so():
    """Two that fly past each other in a box for ever, but for nothing to fall on."""
    run = fall([[1.0, 1.0], [3.0, 3.0]], [[1.0, 0.0], [0.0, 0.0]], (0.0, -1.0), [], box=(EDGE, 0))
    with pytest.raises(ValueError, match="falls on a floor"):
        next(run)
