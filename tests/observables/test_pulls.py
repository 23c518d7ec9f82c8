"""Error bars of fits and extrapolations: (found - true) / error has the variance 1, neither more nor less."""

import math
from types import SimpleNamespace

import numpy as np

from carom.observables.rdf import contact_value
from carom.studies.eos import fits

RUNS = 800


def assert_unit(pulls, slack=0.0):
    """The scatter of m pulls is known to 1 / sqrt(2 m); four times that, and what errors are known to."""
    room = 4.0 / math.sqrt(2.0 * len(pulls)) + slack
    assert abs(np.std(pulls) - 1.0) < room
    assert abs(np.mean(pulls)) < 4.0 / math.sqrt(len(pulls))


def row(n, eta, z, error, infinite=math.nan):
    return SimpleNamespace(
        n=n, packing_fraction=eta, Z=z, Z_error=error, Z_infinite=infinite, phase="fluid",
        equilibrated=True, theory=math.nan, dimension=3,
    )  # fmt: skip


def test_pulls_of_the_extrapolation_and_of_its_slope():
    rng = np.random.default_rng(1)
    sizes, errors = np.array([100, 200, 400, 1600]), np.array([1e-3, 2e-3, 1e-3, 5e-4])
    found = []
    for _ in range(RUNS):
        z = 3.0 - 2.5 / sizes + errors * rng.standard_normal(4)
        rows = [row(int(n), 0.3, v, e) for n, v, e in zip(sizes, z, errors, strict=True)]
        (fit,) = fits.extrapolate(rows)
        found.append(((fit.Z - 3.0) / fit.Z_error, (fit.slope + 2.5) / fit.slope_error))
    for pulls in np.transpose(found):
        assert_unit(pulls)


def test_pulls_of_virial_coefficients():
    rng = np.random.default_rng(2)
    etas = np.linspace(0.02, 0.3, 10)
    y = etas / (1.0 - etas)
    found = []
    for _ in range(RUNS):
        # The terms beyond the free ones are as uncertain as the fit takes them to be.
        c = np.concatenate([[4.0, 6.0, 2.0][: fits.FREE], 4.0 * rng.standard_normal(fits.TERMS - fits.FREE)])
        error = 1e-3
        z = 1.0 + sum(c[j] * y ** (j + 1) for j in range(fits.TERMS)) + error * rng.standard_normal(10)
        fit = fits.virials(
            [row(4000, eta, v, error, v) for eta, v in zip(etas, z, strict=True)], up_to=0.4, order=3
        )
        # y = eta + eta^2 + ...: beta_2 = c_1, beta_3 = c_1 + c_2.
        pulls = np.subtract(fit.values, (c[0], c[0] + c[1])) / fit.errors
        found.append(pulls)
    for pulls in np.transpose(found):
        assert_unit(pulls)


def test_pulls_of_the_contact_value_from_a_histogram():
    rng = np.random.default_rng(3)
    edges = np.linspace(1.0, 1.5, 51)
    r = 0.5 * (edges[1:] + edges[:-1])
    ideal = 40.0 * r**2
    g = np.exp(1.0 - 4.0 * (r - 1.0) + 2.0 * (r - 1.0) ** 2)
    pulls = []
    for _ in range(50):
        found = contact_value(rng.poisson(g * ideal, (64, 50)), ideal, edges, 3)
        pulls.append((found.mean - math.e) / found.error)
    # The jackknife of 64 frames knows the error to 15 %, which adds 2 % to the scatter of 10 %.
    rms = math.sqrt(np.mean(np.square(pulls)))
    assert 0.73 < rms < 1.3, rms
