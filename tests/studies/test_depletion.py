"""The example of depletion: known potentials of mean force, of rods and of two spheres alone."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.scripts import module_of

import carom
from carom.models import Steps, StepTable

CORES = StepTable(Steps([1.0], [math.inf]))

FOUR_SIGMA = 4.0
"""Standard errors within which the worst of some edges is: one run in 4000 would fail by chance, once."""


@pytest.fixture
def frequencies():
    return module_of(Path(__file__).parents[2] / "examples" / "depletion.py").frequencies


def logarithms(frequencies, scene, edges, exact, **how):
    """Return log(found / exact) at each edge without its mean, and its standard error, by eight seeds."""
    found = np.array(
        [np.log(frequencies(scene, CORES, edges, seed=seed, **how) / exact) for seed in range(8)]
    )
    found -= found.mean(axis=1, keepdims=True)
    # One error for all edges, which are alike: of at least three times seven squares, known to a sixth.
    return found.mean(axis=0), math.sqrt(found.var(axis=0, ddof=1).mean() / 8)


@pytest.mark.slow  # the rods have the same bond and rounds
@pytest.mark.usefixtures("plain")
def test_two_spheres_alone_have_no_force_but_the_surface_that_grows(frequencies):
    edges = np.linspace(1.0, 1.9, 4)
    scene = carom.Scene([[2.0, 2.0, 2.0], [3.4, 2.0, 2.0]], 4.2)
    found, error = logarithms(frequencies, scene, edges, edges**2, time=8.0, rate=4.0)
    assert error < 0.1
    assert np.abs(found).max() < FOUR_SIGMA * error
    assert np.log(edges**2).max() - np.log(edges**2).mean() > 5.0 * error


@pytest.mark.usefixtures("plain")
def test_neighboring_rods_have_the_gaps_of_points_on_a_ring(frequencies):
    # Without their lengths four rods are points on a ring of length 4 (F. Zernike and J. A. Prins, Z. Phys.
    # 41, 184 (1927), for infinitely many): the two others are elsewhere with (1 - gap / 4)^2.
    scene = carom.Scene([[0.5], [2.0], [4.5], [6.5]], 8.0)
    edges = np.linspace(1.0, 3.0, 3)
    exact = (1.0 - (edges - 1.0) / 4.0) ** 2
    found, error = logarithms(frequencies, scene, edges, exact, time=20.0, rate=1.0)
    assert error < 0.13
    assert np.abs(found).max() < FOUR_SIGMA * error
    assert np.log(exact).mean() - np.log(exact).min() > 5.0 * error
