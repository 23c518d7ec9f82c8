"""Rounding of impulses is fair: no collision gives more energy, on average, than the next one takes."""

import math
from fractions import Fraction

import numpy as np
import pytest

import carom
from carom.models.mathematics.contact import shares
from carom.models.motions.free_flight import Inertial

UNIT = 2.0**-53
"""Half of the distance of doubles from 1 on."""

SAMPLES = 4000


def fair(errors, unfair):
    """Tell whether the mean of ``errors`` (n,) is zero within 5 standard errors, which ``unfair`` exceeds."""
    error = errors.std() / math.sqrt(len(errors))
    assert unfair > 10.0 * error  # else the test could not fail
    return abs(errors.mean()) < 5.0 * error


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("diameter", [1.0, 1.1, 4.0])
def test_energy_of_spheres_drifts_neither_way(diameter, dimension):
    """Unfair quotients added 1e-13 of the energy where the diameter is a power of two, for every seed."""
    drifts = []
    for seed in range(5):
        scene = carom.Scene.random(64, 0.3, dimension, diameter=diameter, seed=seed)
        sim = carom.Simulation(scene, kT=1.0, seed=seed)
        before = math.fsum(v * v for v in sim.velocities.ravel())
        sim.run(collisions=400_000)
        drifts.append(math.fsum(v * v for v in sim.velocities.ravel()) / before - 1.0)
    # Two roundings of a velocity in a collision are a walk of 1e-14, and the mean of five one of 4e-15.
    assert abs(np.mean(drifts)) < 2e-14


@pytest.mark.parametrize(("ours", "theirs"), [(1.0, 1.0), (0.7, 0.3), (1 / 3, 0.1), (1.0, 1e-4), (0.0, 1.0)])
def test_shares_of_two_masses_are_rounded_fairly(ours, theirs):
    """That of their sum was the same at all contacts of the two."""
    rng = np.random.default_rng(1)
    exact = Fraction(theirs) / (Fraction(ours) + Fraction(theirs))
    errors = []
    for _ in range(SAMPLES):
        rr, lost = 1.0 + 1e-10 + UNIT * int(rng.integers(-8, 8)), -float(rng.rayleigh())
        a, _ = shares(ours, theirs, rr, lost)
        wanted = exact * Fraction(lost) / Fraction(rr)
        errors.append(float((Fraction(a) - wanted) / wanted) / UNIT)
    assert fair(np.array(errors), 0.14)


@pytest.mark.parametrize("normal", [(0.6, 0.8), (math.sqrt(0.2), math.sqrt(0.8)), (1 / 3, 2 / 3, 2 / 3)])
def test_a_wall_throws_back_with_the_energy_of_before(normal):
    """A unit normal is too long or too short by its rounding, and was so at every contact with the wall."""
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(SAMPLES):
        v = rng.normal(size=len(normal))
        before = sum(Fraction(x) ** 2 for x in v.tolist())
        approach = 0.0
        for axis, n in enumerate(normal):
            approach -= n * v[axis]
        Inertial().push(2.0 * approach, v, normal)
        errors.append(float(sum(Fraction(x) ** 2 for x in v.tolist()) - before) / UNIT)
    assert fair(np.array(errors), 1.0)
