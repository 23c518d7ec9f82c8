"""The example of relaxation: F_s of points that fly freely, and lower bounds."""

from pathlib import Path

import numpy as np
import pytest
from helpers.scripts import module_of

import carom

FOUR_SIGMA = 4.0
"""Above the standard error of some hundred means of one run, which go together: a seed in 100 would fail."""


@pytest.fixture(scope="module")
def example():
    return module_of(Path(__file__).parents[2] / "examples" / "glassy_relaxation.py")


@pytest.mark.usefixtures("plain")
def test_free_spheres_scatter_as_a_gas(example):
    """F_s = exp(-k^2 t^2 kT / 2m), of velocities about the center of mass."""
    n = 30
    sim = carom.Simulation(
        carom.Scene.random(n, 1e-9, diameter=1.0), seed=1, tuning=carom.Tuning(neighbors="lists")
    )
    k = 2.0 * np.pi / sim.scene.box[0] * round(sim.scene.box[0])
    times, curves = example.scattering(sim, 0.6, origins=2)
    gas = np.exp(-0.5 * (k * times) ** 2 * (1.0 - 1.0 / n))
    # The mean of 3n cosines of a normal number x of variance s: their variance is (1 - exp(-s))^2 / 2.
    error = (1.0 - gas**2) / np.sqrt(2.0 * 3 * n)
    assert (np.abs(curves - gas) < FOUR_SIGMA * error + 1e-9).all()
    assert gas[-1] < 0.01


def test_a_run_that_keeps_its_memory_gives_a_lower_bound(example):
    times = np.array([1.0, 2.0, 4.0])
    falls, stays = [0.9, 0.6, 0.1], [0.9, 0.8, 0.7]
    assert 2.0 < example.tau(times, np.array(falls)) < 4.0
    assert example.tau(times, np.array(stays)) == 4.0
    row = example.row(
        0.6, False, 10, [{"times": times, "F_s": [each], "accepted": 0.0} for each in (falls, stays)]
    )
    assert row.bound == "or longer"
    assert np.isnan(row.tau_error)
    assert row.tau < 4.0  # the mean, with those that stay counted as their last time
    again = example.row(0.6, True, 10, [{"times": times, "F_s": [falls, falls], "accepted": 0.5}] * 2)
    assert (again.bound, again.tau_error, again.chi4) == ("", 0.0, 0.0)
