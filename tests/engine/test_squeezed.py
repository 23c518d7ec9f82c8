"""A light component between heavy ones: many contacts in a time that the clock may not resolve."""

import math

import pytest

import carom


def contacts_of_galperin(ratio, precision):
    """Return the contacts of a ball at rest beside a wall, with the wall and with a heavy one that comes."""
    scene = carom.Scene([[2.0], [4.0]], (40.0,), mass=[1.0, ratio], velocities=[[0.0], [-1.0]], walls=True)
    sim = carom.Simulation(scene, tuning=carom.Tuning(precision=precision), seed=0)
    sim.run(time=10.0)
    assert sim.time == 10.0
    assert sim.frame().velocities[1, 0] == pytest.approx(1.0, abs=4.0 / math.sqrt(ratio))
    return sim.collisions + sum(impact.hits for impact in sim.obstacles)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("precision", "ratio"),
    [
        ("single", 1e8),  # took "infinitely many collisions" once, while the clock of 24 bits stood still
        ("double", 1e8),
        ("double", 1e12),
        ("single", 1e10),
    ],
)
def test_two_balls_and_a_wall_count_the_digits_of_pi(precision, ratio):
    """Galperin, Regul. Chaotic Dyn. 8, 375 (2003): as many contacts as the digits of pi say."""
    assert contacts_of_galperin(ratio, precision) == math.floor(math.pi * math.sqrt(ratio))
