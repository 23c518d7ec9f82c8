"""Diameters of polydisperse particles: exact moments, one composition for all seeds, what is refused."""

import math

import numpy as np
import pytest

import carom
from carom.errors import InputError

N = 4000


def moment(ratio, exponent, k):
    """Return the mean of s^k for P(s) ~ s^-exponent between ratio and 1."""

    def integral(power):
        return -math.log(ratio) if power == -1 else (1.0 - ratio ** (power + 1)) / (power + 1)

    return integral(k - exponent) / integral(-exponent)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 3.0, 3.5])
def test_power_laws_have_the_moments_of_their_density(exponent):
    sizes = carom.sizes.power(N, ratio=0.45, exponent=exponent)
    assert sizes.mean() == pytest.approx(1.0, rel=1e-13)
    for k in (2, 3, -1):
        # The midpoint rule, of smooth functions: its error is of the order of 1 / n^2.
        exact = moment(0.45, exponent, k) / moment(0.45, exponent, 1) ** k
        assert np.mean(sizes**k) == pytest.approx(exact, rel=100.0 / N**2)
    assert sizes.min() / sizes.max() == pytest.approx(0.45, rel=20.0 / N)


def test_uniform_sizes_have_exactly_the_variance_of_their_quantiles():
    sizes = carom.sizes.uniform(N, polydispersity=0.2)
    assert sizes.std() == pytest.approx(0.2 * math.sqrt(1.0 - 1.0 / N**2), rel=1e-12)
    assert np.allclose(np.diff(np.sort(sizes)), 0.4 * math.sqrt(3.0) / N, rtol=1e-9)


def test_gaussian_sizes_have_the_moments_of_the_normal_distribution():
    sizes = carom.sizes.gaussian(N, polydispersity=0.1)
    # Cut off where the tail is 1 / 2n: both moments lack about (tail) (width of the cut)^k.
    assert sizes.std() == pytest.approx(0.1, rel=10.0 / N)
    assert np.mean(((sizes - 1.0) / 0.1) ** 4) == pytest.approx(3.0, rel=200.0 / N)
    assert np.mean((sizes - 1.0) ** 3) == pytest.approx(0.0, abs=1e-12)


def test_all_seeds_give_one_composition_in_another_order():
    one, same, other = (carom.sizes.power(50, ratio=0.5, seed=seed) for seed in (1, 1, 2))
    assert (one == same).all()
    assert (one != other).any()
    assert (np.sort(one) == np.sort(other)).all()


def test_sizes_are_diameters_of_a_random_scene():
    sizes = carom.sizes.uniform(40, polydispersity=0.1)
    scene = carom.Scene.random(packing_fraction=0.2, dimension=2, diameter=sizes)
    assert (scene.diameters == sizes).all()
    assert scene.packing_fraction == pytest.approx(0.2)
    with pytest.raises(InputError, match="one number or 30"):
        carom.Scene.random(30, diameter=sizes)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: carom.sizes.power(10, ratio=0.0), "ratio"),
        (lambda: carom.sizes.power(0, ratio=0.5), "n must"),
        (lambda: carom.sizes.uniform(10, polydispersity=0.7), "lower polydispersity"),
        (lambda: carom.sizes.gaussian(1000, polydispersity=0.4), "lower polydispersity"),
    ],
)
def test_sizes_that_are_none_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


@pytest.mark.parametrize("exponent", [1.0 + 2.0**-52, 1.0 - 2.0**-50, 1.0 + 1e-12])
def test_an_exponent_that_is_hardly_one_gives_the_sizes_of_one(exponent):
    sizes, limit = (carom.sizes.power(100, ratio=0.45, exponent=each) for each in (exponent, 1.0))
    np.testing.assert_allclose(sizes, limit, rtol=1e-11)


def test_steep_laws_of_very_different_sizes_are_no_overflow():
    sizes = carom.sizes.power(100, ratio=1e-4, exponent=90.0)
    assert 1.0 < sizes.max() / sizes.min() < 1.1
