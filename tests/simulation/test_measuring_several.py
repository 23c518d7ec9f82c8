"""Several observables in one pass: the numbers of each alone, and one run."""

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.models import Ball
from carom.observables import PairDistribution


class Fastest:
    """Largest speed of each frame."""

    def update(self, frame):
        return float(np.sqrt(np.max(np.sum(frame.velocities**2, axis=1))))


def fluid():
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, seed=1), seed=1)
    sim.run(collisions_per_particle=40)
    return sim


def test_several_observables_are_measured_in_one_pass_and_each_as_alone():
    together = fluid()
    pressure, g, fastest = together.measure(
        carom.Pressure(), PairDistribution(rmax=3.0), Fastest(), collisions_per_particle=40
    )
    each = carom.Pressure(), PairDistribution(rmax=3.0), Fastest()
    for observable, found in zip(each, (pressure, g, fastest), strict=True):
        alone = fluid()
        expected = alone.measure(observable, collisions_per_particle=40)
        assert repr(expected) == repr(found)
        assert alone.time == together.time
    assert (together.frame().positions == alone.frame().positions).all()


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")  # of few independent samples
def test_blocks_suit_every_observable():
    """An observable of frames sees as many as alone, one of blocks all of them."""
    few, many = fluid().measure(
        carom.Pressure(blocks=32), carom.Pressure(blocks=128), collisions_per_particle=40
    )
    assert repr(few) == repr(many)
    counted = Fastest()
    counted.blocks = 48
    assert repr(fluid().measure(counted, time=3.0)) == repr(
        fluid().measure(carom.Pressure(blocks=32), counted, time=3.0)[1]
    )


def test_progress_changes_no_number():
    seen = []
    found = fluid().measure(carom.Pressure(blocks=32), collisions_per_particle=40, progress=seen.append)
    assert repr(found) == repr(fluid().measure(carom.Pressure(blocks=32), collisions_per_particle=40))
    assert seen[-1] == 1.0
    assert len(seen) == 32


def test_what_goes_with_one_observable_only_is_said():
    with pytest.raises(InputError, match="found none"):
        fluid().measure(time=1.0)
    with pytest.raises(InputError, match="relative_error goes with one observable"):
        fluid().measure(carom.Pressure(), carom.Pressure(), relative_error=0.1)
    with pytest.raises(InputError, match=r"needs an observable.*found a Ball"):
        fluid().measure(carom.Pressure(), Ball((1.0, 1.0), 0.5), time=1.0)
