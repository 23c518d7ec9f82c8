"""Error bars: known series, coverage of the intervals, and what happens with too little data."""

import math

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from carom.errors import CaromWarning, InputError
from carom.observables.statistics import Estimate, blocking, ratio, unwarned
from carom.observables.volume import _beside

SERIES = 400
SIX_SIGMA = 6.0


def autoregressive(rng, a, n, count):
    """Stationary AR(1) series (count, n) of mean 0, variance 1 and correlation a^lag."""
    noise = rng.standard_normal((count, n)) * math.sqrt(1.0 - a * a)
    noise[:, 0] /= math.sqrt(1.0 - a * a)
    return lfilter([1.0], [1.0, -a], noise, axis=1)


def accepted(level, below, above, count=SERIES):
    """Fewest and most hits for a true coverage at most so far from `level`, but for 1e-4 of cases."""
    return binom.ppf(1e-4, count, level - below), binom.ppf(1 - 1e-4, count, min(level + above, 1.0))


# What blocking promises: the coverage is the level, within 3 % of it when there are 20 independent samples or
# more; below that nobody can know tau, and it may be 5 % too low, or, rather, 15 % too high.
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("n", [64, 256, 2048])
@pytest.mark.parametrize("a", [0.0, 0.3, 0.6, 0.8, 0.9])
def test_confidence_intervals_cover_the_truth_as_often_as_they_say(a, n):
    rng = np.random.default_rng([n, round(10 * a)])
    independent = n * (1 - a) / (1 + a)
    below, above = (0.03, 0.03) if independent >= 20 else (0.05, 0.15)
    estimates = [blocking(x) for x in autoregressive(rng, a, n, SERIES)]
    for level in (0.68, 0.95):
        intervals = [e.confidence(level) for e in estimates]
        hits = sum(low <= 0.0 <= high for low, high in intervals)
        fewest, most = accepted(level, below, above)
        assert fewest <= hits <= most


def test_error_and_tau_of_a_long_series_are_the_exact_ones():
    a, n, count = 0.8, 16384, 100
    estimates = [blocking(x) for x in autoregressive(np.random.default_rng(5), a, n, count)]
    tau = (1 + a) / (1 - a)
    taus = np.array([e.tau for e in estimates])
    # Mean of many, against its own scatter; the variance of the mean of a finite series is smaller by tau /
    # n.
    assert abs(taus.mean() - tau) < SIX_SIGMA * taus.std(ddof=1) / math.sqrt(count) + tau * 0.02
    errors = np.array([e.error for e in estimates])
    assert np.mean(errors**2) == pytest.approx(tau / n, rel=0.1)
    assert all(e.n_eff * e.tau == pytest.approx(n) for e in estimates)


def test_weak_correlation_below_the_noise_is_found_by_later_levels():
    rng = np.random.default_rng(2)
    slow, n, count = 0.95, 4096, 100
    series = 2 * rng.standard_normal((count, n)) + autoregressive(rng, slow, n, count)
    exact = math.sqrt((4 + (1 + slow) / (1 - slow)) / n)
    errors = np.array([blocking(x).error for x in series])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(exact, rel=0.1)


def test_errors_of_independent_samples_are_never_far_too_small():
    rng = np.random.default_rng(11)
    errors = 16 * np.array([blocking(x).error for x in rng.standard_normal((1000, 256))])
    # Of 256 samples the first level knows the error to a tenth, its correlation factor included; where chance
    # makes that level look correlated, coarser ones follow, and those err to the other side.
    assert errors.min() > 1 - 3.5 * 0.1
    assert np.mean(errors > 1.5) < 0.05


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("n", [2, 3, 4, 6, 8, 12])
def test_errors_of_few_independent_samples_are_no_smaller_than_their_scatter(n):
    estimates = [blocking(x) for x in np.random.default_rng(n).standard_normal((1000, n))]
    relative = math.sqrt(n) * np.array([e.error for e in estimates])
    # The median of the error of two is that of a normal deviate, 0.67; 0.05 are three errors of a median.
    assert np.median(relative) > 0.62
    assert np.mean(relative**2) > 1.0 - SIX_SIGMA * math.sqrt(2.0 / (1000 * (n - 1)))
    low, high = np.transpose([e.confidence(0.95) for e in estimates])
    assert np.sum((low <= 0.0) & (high >= 0.0)) >= accepted(0.95, 0.0, 0.05, 1000)[0]


def test_anticorrelated_samples_count_for_more_than_their_number():
    a = -0.5
    estimate = blocking(autoregressive(np.random.default_rng(3), a, 4096, 1)[0])
    # tau is a ratio of variances, each known from about `blocks` numbers.
    assert estimate.tau == pytest.approx((1 + a) / (1 - a), rel=SIX_SIGMA * math.sqrt(2 / estimate.blocks))
    assert estimate.n_eff > 4096


def test_a_constant_series_has_no_error():
    estimate = blocking(np.full(50, 0.1))
    assert (estimate.error, estimate.tau) == (0.0, 1.0)
    assert estimate.mean == pytest.approx(0.1, rel=4 * np.finfo(float).eps)
    assert estimate.confidence(0.95) == (estimate.mean, estimate.mean)


def test_one_sample_has_an_infinite_error_and_says_so():
    with pytest.warns(CaromWarning, match="Fewer than 2 independent"):
        estimate = blocking([3.0])
    assert (estimate.mean, estimate.error) == (3.0, math.inf)
    assert estimate.confidence(0.95) == (-math.inf, math.inf)


def test_a_random_walk_warns_that_its_error_is_a_guess():
    walk = np.cumsum(np.random.default_rng(6).standard_normal(40))
    with pytest.warns(CaromWarning, match="guess"):
        blocking(walk)


@pytest.mark.parametrize("bad", [[], [[1.0, 2.0]], [1.0, math.nan], [math.inf, 1.0]])
def test_unusable_samples_are_refused(bad):
    with pytest.raises(InputError):
        blocking(bad)


@pytest.mark.parametrize("level", [0.0, 1.0, 95])
def test_a_confidence_level_is_a_probability(level):
    with pytest.raises(InputError, match="between 0 and 1"):
        Estimate(1.0, 0.1, 10.0, 1.0, 10).confidence(level)


def test_the_error_of_a_ratio_holds_for_blocks_of_any_length():
    # a = 3 b and noise that does not depend on b: the error of sum(a) / sum(b) is that of the noise over b's
    # mean, to sqrt(3 / 2n) of 6 standard deviations.
    rng = np.random.default_rng(7)
    n = 4096
    b, noise = rng.choice([1.0, 9.0], n), rng.normal(size=n)
    found = ratio(3.0 * b + noise, b)
    assert found.mean == pytest.approx(3.0 + noise.sum() / b.sum(), rel=1e-14)
    assert found.error == pytest.approx(1.0 / (b.mean() * math.sqrt(n)), rel=6 * math.sqrt(1.5 / n))


def test_a_ratio_refuses_blocks_of_no_length():
    with pytest.raises(InputError, match="zero length"):
        ratio([1.0, 2.0], [1.0, 0.0])
    with pytest.raises(InputError, match="for every block"):
        ratio([1.0, 2.0], [1.0])


@pytest.mark.parametrize(
    ("mean", "error", "text"),
    [
        (10.0123, 0.0031, "10.012 +- 0.003"),
        (10.0123, 0.00131, "10.0123 +- 0.0013"),
        (123456.0, 250.0, "123456 +- 250"),
        (1.0, 0.0, "1 +- 0"),
        (2.5, math.inf, "2.5 +- inf"),
    ],
)
def test_estimates_print_the_digits_they_know(mean, error, text):
    estimate = Estimate(mean, error, 1234.0, 1.83, 512)
    assert str(estimate) == text + " (n_eff 1234, tau 1.8 blocks)"


def test_scaling_an_estimate_scales_its_error():
    estimate = Estimate(2.0, 0.1, 30.0, 2.0, 16).scaled(-3.0, offset=1.0)
    assert (estimate.mean, estimate.error) == (-5.0, pytest.approx(0.3))


@pytest.mark.parametrize(("blocks", "n_eff", "freedoms"), [(64, 1e9, 21.0), (64, 10.0, 3.0), (2, 2.0, 1.0)])
def test_an_error_bar_has_a_third_of_the_freedoms_of_its_blocks(blocks, n_eff, freedoms):
    """The variance of the variance is three times that of independent blocks: two of them for r."""
    assert Estimate(1.0, 0.1, n_eff, 1.0, blocks).degrees_of_freedom == freedoms


def test_an_estimate_has_numbers_of_python():
    found = Estimate(np.float64(1.5), np.float64(0.25), np.float64(3.0), np.float64(1.0), 8)
    assert repr(found) == "Estimate(mean=1.5, error=0.25, n_eff=3.0, tau=1.0, blocks=8)"
    assert type(float(found)) is float


def test_the_pressure_at_constant_pressure_is_no_surer_than_the_volume_that_it_follows():
    """Noise of 10 times the scatter by the volume hid its slow part: pulls had a root mean square of 1.6."""
    rng = np.random.default_rng(1)
    count, memory, pulls = 256, 32.0, []
    keep, times = math.exp(-1.0 / memory), np.ones(count)
    for _ in range(400):
        volumes = rng.standard_normal(count)
        for k in range(1, count):
            volumes[k] = keep * volumes[k - 1] + math.sqrt(1.0 - keep**2) * volumes[k]
        with unwarned():
            volume = ratio(10.0 + volumes, times)
            found = _beside(5.0 - volumes + 4.0 * rng.standard_normal(count), 10.0 + volumes, times, volume)
        assert found.n_eff <= volume.n_eff
        pulls.append((found.mean - 5.0) / found.error)
    assert np.sqrt(np.mean(np.square(pulls))) < 1.25
