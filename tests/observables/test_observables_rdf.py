"""g(r): ideal gas, the exact Tonks gas, reference histograms, a crystal, bins."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from helpers.frames import frame_of as frame

from carom import theory
from carom.observables import RDF
from carom.observables.rdf import _bin_edges, contact_value

DATA = Path(__file__).parents[1] / "data"
SIX_SIGMA = 6.0


def ideal_gas(dimension, n, frames, seed, diameter=0.0):
    rng = np.random.default_rng(seed)
    box = np.linspace(1.0, 1.5, dimension) if dimension > 1 else np.ones(1)
    return [frame(rng.random((n, dimension)) * box, box, diameter) for _ in range(frames)]


def tonks_frames(n, rho, frames, seed):
    """Exact samples of n rods on a ring: the gaps are uniform on the simplex of the free length."""
    rng = np.random.default_rng(seed)
    length = n / rho
    for _ in range(frames):
        gaps = rng.dirichlet(np.ones(n)) * (length - n)
        x = np.mod(np.cumsum(gaps + 1.0) + rng.uniform(0, length), length)
        yield frame(x[:, None], (length,))


def exact_tonks(r, n, rho):
    """g_N(r) below two diameters: the law of one gap, (1 - s / L_free)^(n - 2), normalized by (n - 1) / L."""
    length = n / rho
    free = length - n
    return length / free * (1.0 - (r - 1.0) / free) ** (n - 2)


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5, 6])
def test_an_ideal_gas_has_g_one_in_every_dimension(dimension):
    frames = ideal_gas(dimension, 200, 40, dimension)
    result = RDF(bins=10).over(frames)
    # Counts of independent pairs are Poisson; the shell is known, so that their mean is.
    volume = theory.ball_volume(dimension) * np.diff((2 * result.edges) ** dimension)
    expected = 40 * 200 * 199 / 2 * volume / math.prod(frames[0].box)
    assert (np.abs(result.counts - expected) < SIX_SIGMA * np.sqrt(expected) + 1).all()
    np.testing.assert_allclose(result.g, result.counts / expected, rtol=1e-13)
    assert result.edges[0] == 0.0
    assert result.contact_value is None


def test_errors_of_an_ideal_gas_are_those_of_independent_pairs():
    result = RDF(bins=20).over(ideal_gas(2, 100, 256, 1))
    poisson = np.sqrt(result.counts) * result.g / result.counts
    # A standard error from about 256 blocks is known to 1 / sqrt(512); 20 bins, six sigma.
    assert (np.abs(result.error / poisson - 1) < SIX_SIGMA / math.sqrt(512)).all()


def test_correlated_frames_have_larger_errors():
    independent = ideal_gas(2, 100, 64, 2)
    once = RDF(bins=10).over(independent)
    is_periodic = RDF(bins=10).over([f for f in independent for _ in range(8)])
    np.testing.assert_array_equal(once.g, is_periodic.g)
    # Eight copies of a frame are one sample. Each ratio is known to about 1 / sqrt(blocks) = 0.25.
    assert np.mean(is_periodic.error / once.error) == pytest.approx(1.0, abs=SIX_SIGMA * 0.25 / math.sqrt(10))


def test_rods_have_the_exact_g_and_contact_value():
    n, rho, count = 50, 0.5, 400
    result = RDF(width=0.05, rmax=2.0).over(tonks_frames(n, rho, count, 3))
    exact = np.array(
        [
            np.mean(exact_tonks(np.linspace(lo, hi, 101), n, rho))
            for lo, hi in zip(result.edges[:-1], result.edges[1:], strict=True)
        ]
    )
    # Averages over 101 points of each bin are good to 1e-5, the largest error to 0.02.
    assert (np.abs(result.g - exact) < SIX_SIGMA * result.error).all()
    contact = result.contact_value
    assert abs(contact.mean - 1 / (1 - rho)) < SIX_SIGMA * contact.error
    # At the end of its range a polynomial of degree k has (k + 1) times the error of the mean of its points.
    pairs = result.counts[:5].sum()
    assert contact.error == pytest.approx(3 * contact.mean / math.sqrt(pairs), rel=0.3)
    z = theory.compressibility_factor(contact.mean, rho, 1, n)
    assert z == pytest.approx(theory.tonks(rho, n), rel=SIX_SIGMA * contact.error)


def test_contact_errors_do_not_shrink_when_frames_are_repeated():
    frames = list(tonks_frames(50, 0.6, 128, 8))
    once = RDF(width=0.05, rmax=1.5).over(frames).contact_value
    is_periodic = RDF(width=0.05, rmax=1.5).over([f for f in frames for _ in range(16)]).contact_value
    # The histogram is the same in proportion; the fit stops within a hundredth of its error.
    assert is_periodic.mean == pytest.approx(once.mean, abs=0.05 * once.error)
    assert is_periodic.error > 0.5 * once.error


def test_a_contact_value_of_few_frames_has_the_error_of_independent_pairs_or_more():
    edges, ideal = np.linspace(1.0, 1.25, 11), np.full(10, 50.0)
    counts = np.tile([160, 140, 122, 108, 96, 85, 76, 68, 61, 55], (10, 1))  # by chance all alike
    found = contact_value(counts, ideal, edges, 3)
    assert 0.025 < found.error / found.mean < 0.1  # the first bins hold 2800 pairs, and the fit is a parabola
    assert found.n_eff == 10


@pytest.mark.parametrize("rho", [0.5, 0.8])
def test_contact_value_of_reference_histograms_is_the_one_that_z_implies(rho):
    path = DATA / f"hard_spheres_gr_rho{rho}.csv"
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    edges = np.array([float(row["r_lo"]) for row in rows] + [float(rows[-1]["r_hi"])])
    g = np.array([float(row["g_MD"]) for row in rows])
    # N = 864 and 12059 snapshots, as the file says.
    n, snapshots = 864, 12059
    ideal = snapshots * 0.5 * n * (n - 1) * 4 / 3 * math.pi * np.diff(edges**3) * rho / n
    fitted = contact_value(np.rint(g * ideal)[None].astype(int), ideal, edges, 3)
    eta = rho * math.pi / 6
    z = theory.pieprzyk(eta) + theory.finite_size_shift(eta, n, theory.pieprzyk)
    # Snapshots are correlated: the file grants 1.5 times the Poisson error that one histogram allows.
    assert abs(fitted.mean - theory.contact_value(z, eta, 3, n)) < 3 * 1.5 * fitted.error
    assert fitted.error < 2e-3 * fitted.mean


def test_the_contact_value_of_a_crystal_is_the_one_that_z_implies_or_none():
    # Pairs by shells of .02 in an fcc crystal of 500 spheres at packing fraction .6: 600 frames of six runs,
    # whose collisions say 6.050(1) at contact. A parabola down to half is 5.988.
    counts = [267132, 272450, 264677, 244186, 211510, 172655, 131987, 94181, 62136]
    counts += [37509, 21427, 11079, 5321, 2520, 1165, 1073, 1828, 3670]
    edges = 1.0 + 0.02 * np.arange(19)
    ideal = 600 * 0.5 * 499 * 4 / 3 * math.pi * np.diff(edges**3) * 0.6 / (math.pi / 6)
    fitted = contact_value(np.array([counts]), ideal, edges, 3)
    assert abs(fitted.mean - 6.05) < 2 * fitted.error
    assert fitted.error < 0.02
    coarse = [np.add.reduceat(each, range(0, 18, 3)) for each in (counts, ideal)]
    assert contact_value(coarse[0][None], coarse[1], edges[::3], 3) is None


def test_bins_begin_at_contact_and_end_at_half_the_box():
    frames = list(tonks_frames(6, 0.5, 2, 1))
    assert RDF().over(frames).edges[0] == 1.0
    # 5 diameters and half of the edge of 12 are both possible; the nearer one is taken.
    assert RDF().over(frames).edges[-1] == 5.0
    assert RDF(rmax=6.0, bins=10).over(frames).edges[-1] == 6.0
    np.testing.assert_allclose(
        RDF(bins=10, width=0.25).over(frames).edges, 1 + 0.25 * np.arange(11), rtol=1e-15
    )
    assert RDF(width=0.7, rmax=2.0).over(frames).edges[-1] == pytest.approx(1.7, rel=1e-15)
    assert len(RDF(width=0.1, rmax=1.7).over(frames).g) == 7  # though 0.7 / 0.1 is less by rounding


@pytest.mark.parametrize("width", [0.1, 0.05, 0.3, 0.7])
def test_a_range_of_whole_widths_keeps_its_last_bin(width):
    for count in range(1, 40):
        rmax = round(1.0 + count * width, 2)  # as it is typed
        edges = _bin_edges(1.0, 60.0, None, width, rmax)
        np.testing.assert_allclose(edges, np.linspace(1.0, rmax, count + 1), rtol=1e-15)


def test_the_quadrature_over_a_shell_is_exact_for_polynomials():
    from carom.observables.analysis.contact_extrapolation import NODES, WEIGHTS

    for power in range(6):
        exact = 2.0 / (power + 1) if power % 2 == 0 else 0.0
        found = sum(w * x**power for x, w in zip(NODES, WEIGHTS, strict=True))
        assert found == pytest.approx(exact, abs=4 * np.finfo(float).eps)
