"""Several observables in one pass: the numbers of each alone, and one run."""

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models import Ball
from carom.observables import RDF


class Fastest:
    """Largest speed of each frame."""

    def add(self, frame):
        return float(np.sqrt(np.max(np.sum(frame.velocities**2, axis=1))))


def fluid():
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, seed=1), seed=1)
    sim.run(collisions_per_particle=40)
    return sim


def test_several_observables_are_measured_in_one_pass_and_each_as_alone():
    together = fluid()
    pressure, g, fastest = together.measure(
        carom.Pressure(), RDF(rmax=3.0), Fastest(), collisions_per_particle=40
    )
    each = carom.Pressure(), RDF(rmax=3.0), Fastest()
    for observable, found in zip(each, (pressure, g, fastest), strict=True):
        alone = fluid()
        expected = alone.measure(observable, collisions_per_particle=40)
        assert expected == found
        assert alone.time == together.time
    assert (together.frame().positions == alone.frame().positions).all()


def test_an_observable_is_a_value_that_begins_anew_each_time():
    sim, g = fluid(), RDF(rmax=3.0)
    first, second = (sim.measure(g, time=1.0, blocks=8) for _ in range(2))
    assert first.frames == second.frames == 9
    with pytest.raises(InputError, match="No frame"):
        g.result()


def test_progress_changes_no_number():
    seen = []
    found = fluid().measure(carom.Pressure(), collisions_per_particle=40, progress=seen.append, blocks=32)
    assert found == (fluid().measure(carom.Pressure(), collisions_per_particle=40, blocks=32))
    assert seen[-1] == 1.0
    assert len(seen) == 32


def test_what_goes_with_one_observable_only_is_said():
    with pytest.raises(InputError, match="found none"):
        fluid().measure(time=1.0)
    with pytest.raises(InputError, match="relative_error goes with one observable"):
        fluid().measure(carom.Pressure(), carom.Pressure(), relative_error=0.1)
    with pytest.raises(InputError, match=r"needs an observable.*found a Ball"):
        fluid().measure(carom.Pressure(), Ball((1.0, 1.0), 0.5), time=1.0)
