"""What a measured number is checked for: a drift, too few independent samples, temperatures of species."""

import math
import re
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.mixtures import mixed, mixture
from scipy.signal import lfilter
from scipy.stats import binom, chi2

import carom
from carom.errors import CaromWarning
from carom.observables.analysis.drift import LEVEL, drifts, relaxation
from carom.observables.analysis.equilibrium import (
    RENEWED,
    RENEWED_OTHERWISE,
    doubts,
    doubts_about,
    equipartition,
    slow_exchange,
    slow_structure,
)
from carom.observables.statistics import FEW_SAMPLES, Estimate, blocking
from carom.simulation.measuring.equipartition import Thermometer


def series(rng, a, n):
    """Return a stationary AR(1) series of variance 1."""
    noise = rng.standard_normal(n) * math.sqrt(1.0 - a * a)
    noise[0] /= math.sqrt(1.0 - a * a)
    return lfilter([1.0], [1.0, -a], noise)


def alarms(a, n, runs):
    rng = np.random.default_rng([n, round(10 * a)])
    return sum(bool(doubts("Z", blocking(x), x)) for x in (series(rng, a, n) for _ in range(runs)))


@pytest.mark.parametrize(("a", "n"), [(0.0, 256), (0.3, 256), (0.8, 1024)])
def test_hardly_more_than_one_of_a_thousand_stationary_runs_is_doubted(a, n):
    # Correlated parts may make it two of a thousand; one of 1e4 tests of that would fail.
    assert alarms(a, n, 500) <= binom.ppf(1 - 1e-4, 500, 2 * LEVEL)


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_a_trend_of_six_errors_is_seen():
    rng = np.random.default_rng(3)
    seen = 0
    for _ in range(100):
        # The slope of 256 numbers has an error of sqrt(3) / 16 over the half length, here a sixth of it.
        x = rng.standard_normal(256) + 6.0 * math.sqrt(3.0) / 16.0 * np.linspace(1.0, -1.0, 256)
        seen += bool(doubts("Z", blocking(x), x))
    assert seen > 80


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_decay_at_the_start_is_seen(way):
    # It bends the line of a trend, and correlates the rest about it: a trend is seen in none of these.
    rng = np.random.default_rng(4)
    decay = 6.0 * way * np.exp(-np.arange(256) / 64.0)
    runs = [series(rng, 0.6, 256) + decay for _ in range(100)]
    said = [doubts("the pressure", blocking(x), x) for x in runs]
    assert sum(bool(sentences) for sentences in said) > 60
    assert any("its first quarter is" in text for sentences in said for text in sentences)
    # Of nearly all others blocking has said that the error bar is a guess.
    silent = [x for sentences, x in zip(said, runs, strict=True) if not sentences]
    assert sum(blocking(x).n_eff >= FEW_SAMPLES for x in silent) < 5


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_of_independent_runs_a_trend_of_one_or_of_all_is_seen_either_way(way):
    assert drifts([6.0 * way, *[-2.0 * way] * 3])  # all together have none
    assert drifts([2.0 * way] * 4)  # none alone
    assert not drifts([2.0 * way, -2.0 * way])


def test_what_does_not_change_relaxes_not():
    assert relaxation([3.7] * 64) == 0.0
    assert relaxation(0.1 + 1e-18 * np.arange(64)) == 0.0
    assert relaxation([1.0, 2.0] * 15) == 0.0  # too few to say


def test_slow_changes_are_no_error_bar():
    found = Estimate(9.4, 0.19, 7.0, 256 / 7.0, 16)
    [sentence] = doubts("the pressure", found, [9.3, 9.5] * 128)
    assert re.search("Only 7 independent samples of the pressure .* 256 blocks.*Run longer", sentence)
    # Who asks for few blocks gets few, and an error bar that knows it.
    assert doubts("the pressure", Estimate(9.4, 0.19, 7.0, 1.1, 8), [9.3, 9.5] * 4) == []
    # Where there are hardly any, it is said of what.
    [sentence] = doubts("the volume", Estimate(9.4, 0.19, 0.5, 16.0, 8), [9.3, 9.5] * 4)
    assert sentence.startswith("Fewer than 2 independent samples of the volume were found")


def test_estimates_without_blocks_are_not_doubted():
    class Found:
        primary = Estimate(1.0, 0.1, 1.0, 256.0, 16)

    assert doubts_about(Found()) == []


FREEDOMS = (120.0, 12000.0)


def ratios(rng, a, looks, hot=0.0):
    """Temperatures of few heavy spheres and many light ones; energy is conserved."""
    first = 1.0 + hot + math.sqrt(2.0 / FREEDOMS[0]) * series(rng, a, looks)
    return np.column_stack([first, (sum(FREEDOMS) - FREEDOMS[0] * first) / FREEDOMS[1]])


@pytest.mark.parametrize("a", [0.0, 0.8])
def test_species_in_equilibrium_differ_by_chance_only(a):
    rng = np.random.default_rng(5)
    runs = [equipartition(("big", "small"), ratios(rng, a, 256), FREEDOMS) for _ in range(500)]
    assert sum(map(bool, runs)) <= binom.ppf(1 - 1e-4, 500, 2 * LEVEL)


def test_a_species_that_is_hot_on_average_is_named():
    rng = np.random.default_rng(6)
    [sentence] = equipartition(("big", "small"), ratios(rng, 0.6, 256, hot=0.37), FREEDOMS)
    assert re.search(r"big at 1\.3\d kT.*Equilibrate longer", sentence)


def test_a_species_that_keeps_its_temperature_is_compared_with_chance():
    # 0.37 is 2.9 of sqrt(2 / 120), which chance may do; 0.7 is not.
    assert equipartition(("big", "small"), np.tile([1.37, 1 - 0.0037], (64, 1)), FREEDOMS) == []
    assert equipartition(("big", "small"), np.tile([1.7, 1 - 0.007], (64, 1)), FREEDOMS)


def test_measure_says_that_species_differ_in_temperature(plain):
    scene = mixture_of_disks(1e4, 20)
    # Heavy disks much hotter than light ones cool over thousands of collisions.
    rng = np.random.default_rng(1)
    speeds = rng.standard_normal((40, 2)) / np.sqrt(scene.masses)[:, None]
    speeds[:20] *= 30.0
    sim = carom.Simulation(scene.replace(velocities=speeds), seed=0)
    with pytest.warns(CaromWarning) as said:
        sim.measure(carom.Pressure(), time=20.0, blocks=64)
    texts = [str(each.message) for each in said]
    assert any("species differ in temperature (big at" in text for text in texts), texts


@pytest.mark.parametrize("a", [0.8, 0.98, 0.999])
def test_species_are_named_that_exchange_energy_more_slowly_than_the_stretch_lasts(a):
    """256 looks are 28, 2.6 and 0.13 independent ones."""
    rng = np.random.default_rng(7)
    runs = [slow_exchange(("big", "small"), ratios(rng, a, 256), FREEDOMS, 0.01) for _ in range(200)]
    named = sum(map(bool, runs))
    if a == 0.8:
        assert named == 0
    else:
        assert named > 190
        assert "big" in next(filter(None, runs))[0]
    # Where the error bar is larger than what temperatures do, only those are named that hardly change.
    coarse = [slow_exchange(("big", "small"), ratios(rng, a, 256), FREEDOMS, 0.2) for _ in range(200)]
    assert sum(map(bool, coarse)) == (200 if a == 0.999 else 0)


def mixture_of_disks(mass, count=8):
    return mixture(
        [count, count], masses=[mass, 1.0], names=["big", "small"], dimension=2, packing_fraction=0.1, seed=0
    )


def test_measure_says_that_a_stretch_is_short_for_heavy_disks(plain):
    with pytest.warns(CaromWarning, match=r"temperatures of species change slowly \(big: 0\."):
        carom.Simulation(mixture_of_disks(1000.0), seed=2).measure(carom.Pressure(), time=20.0)
    # Twice as heavy ones take some collisions only; a warning would be an error here.
    carom.Simulation(mixture_of_disks(2.0), seed=2).measure(carom.Pressure(), time=80.0)


def test_the_few_that_hold_nearly_all_mass_are_not_cold():
    """Two hold 99 % of the mass. Momentum is conserved, so <m v^2> is d kT (1 - m / M): half for them."""
    counts, dice = (2, 20), np.random.default_rng(1)
    scene = carom.Scene.random(
        species=mixed(counts=counts, diameters=(1.0, 0.5), masses=(1000.0, 1.0)),
        packing_fraction=0.01,
        seed=1,
    )
    machine = SimpleNamespace(scene=scene, system=SimpleNamespace(rates=None, elastic=True))
    thermometer = Thermometer(machine)
    for _ in range(4000):
        v = dice.normal(size=(22, 3)) / np.sqrt(scene.masses)[:, None]
        machine.speeds = v - np.average(v, axis=0, weights=scene.masses)
        thermometer.look()
    found = np.array(thermometer.series)
    error = found.std(axis=0) / np.sqrt(len(found))
    # All together have d (n - 1) degrees of freedom; what is shared out adds up to that.
    assert (np.abs(found.mean(axis=0) - 1.0) < 4.0 * error).all()
    assert (error < 0.02).all()


def test_species_that_lose_energy_at_contacts_are_not_compared():
    scene = mixture_of_disks(100.0)
    for elastic in (True, False):  # scene.impact.restitution is 1 for a Loss, too
        machine = SimpleNamespace(scene=scene, system=SimpleNamespace(rates=None, elastic=elastic))
        assert bool(Thermometer(machine).names) == elastic


@pytest.mark.parametrize("d", [2, 3, 4])
def test_near_freezing_a_stretch_must_last_until_particles_have_left_their_neighborhoods(d):
    eta = 0.98 * carom.theory.FREEZING[d]
    needed = RENEWED.get(d, RENEWED_OTHERWISE)
    unit = 2.0**-30  # of length: the mean spacing
    dense = SimpleNamespace(dimension=d, n=20, volume=20.0 * unit**d, packing_fraction=eta)
    (said,) = slow_structure(dense, (0.5 * needed * unit) ** 2)
    assert f"moved by {0.5 * needed:.2g} mean spacings" in said
    assert "Run 4 times as long" in said
    assert not slow_structure(dense, (1.01 * needed * unit) ** 2)
    assert not slow_structure(dense, (0.2 * unit) ** 2)  # in the cages of a crystal
    thin = SimpleNamespace(dimension=d, n=20, volume=20.0 * unit**d, packing_fraction=0.9 * eta)
    assert not slow_structure(thin, (0.5 * unit) ** 2)


def test_a_crystal_is_not_told_how_far_its_particles_should_move():
    """Disks of a crystal at 0.73 move by 0.25 mean spacings (1152 of them), and never by 2.5."""
    for crystal in (
        carom.Scene.crystal(lattice="triangular", cells=8, packing_fraction=0.73),
        carom.Scene.crystal(lattice="fcc", cells=3, packing_fraction=0.55),
    ):
        square = (crystal.volume / crystal.n) ** (2.0 / crystal.dimension)
        assert not slow_structure(crystal, 0.3**2 * square)
        assert slow_structure(crystal, 0.6**2 * square)  # it melts
        glass = crystal.replace(mass=np.where(np.arange(crystal.n) % 2, 1.0, 2.0))
        assert slow_structure(glass, 0.3**2 * square)


@pytest.mark.parametrize("eta", [0.72, 0.72 - 2.0**-50, 0.72 + 2.0**-50])
def test_disks_at_melting_are_told_how_far_they_should_move_whatever_the_last_bit(eta):
    melting = carom.Scene.crystal(lattice="triangular", cells=8, packing_fraction=eta)
    assert slow_structure(melting, 0.3**2 * melting.volume / melting.n)


def test_rods_on_a_line_never_freeze():
    assert not slow_structure(SimpleNamespace(dimension=1, n=10, volume=10.0, packing_fraction=0.99), 0.25)


def test_a_short_run_near_freezing_says_that_its_error_bar_is_too_small():
    scene = carom.Scene.random(108, 0.49, seed=1)
    sim = carom.Simulation(scene, seed=2)
    sim.run(collisions_per_particle=50)
    with pytest.warns(CaromWarning, match=r"moved by 0\.[3-9]\d* mean spacings .* as long"):
        sim.measure(carom.Pressure(), collisions_per_particle=100)
    sim.measure(carom.Pressure(), collisions_per_particle=1000)


STATES = [(3, 0.30), (3, 0.49), (3, 0.494), (2, 0.68), (2, 0.72)]


@pytest.mark.slow
@pytest.mark.parametrize("length", [200, 2000])
@pytest.mark.parametrize(("d", "eta"), STATES)
def test_errors_of_short_runs_near_freezing_are_right_or_said_to_be_too_small(d, eta, length):
    # One long run in 100 stretches: its mean is known ten times as well as that of one of them.
    runs = 100
    sim = carom.Simulation(carom.Scene.random(256, eta, d, seed=5), seed=6)
    sim.run(collisions_per_particle=2000)
    means, errors, silent = [], [], []
    for _ in range(runs):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            z = sim.measure(carom.Pressure(), collisions_per_particle=length).Z
        means.append(z.mean)
        errors.append(z.error)
        silent.append(not said)
    pulls = ((np.array(means) - np.mean(means)) / np.array(errors))[np.array(silent)]
    near = eta > carom.theory.NEAR_FREEZING * carom.theory.FREEZING[d]
    if not near:
        assert len(pulls) > 0.95 * runs  # no false alarm
    if len(pulls) > 20:
        # Errors may be too small by 1.15 there (RENEWED), or too wide by that; beyond it, chance of one in a
        # thousand, by chi squared.
        rms = math.sqrt(float(np.mean(pulls**2)))
        print(
            f"d = {d}, eta = {eta}, {length} collisions a particle: {len(pulls)} silent, rms pull {rms:.2f}"
        )
        low, high = np.sqrt(chi2.ppf([1e-3, 1.0 - 1e-3], len(pulls) - 1) / (len(pulls) - 1))
        assert low / 1.15 < rms < high * 1.15


def test_of_a_run_the_part_of_the_displacement_in_its_measured_stretch_counts(monkeypatch):
    from carom.studies.runs import report

    start = np.random.default_rng(1).normal(size=(50, 3))
    moved = np.random.default_rng(2).normal(size=(50, 3))
    scene = SimpleNamespace(positions=start, interaction=None)
    frame = SimpleNamespace(unwrapped=start + moved, tilt=None, dimension=3)
    sim = SimpleNamespace(scene=scene, time=8.0, frame=lambda: frame)
    run = SimpleNamespace(
        sim=sim,
        first_places=start,
        measured=[SimpleNamespace(duration=0.5)] * 4,
        thermometer=SimpleNamespace(doubts=lambda error: []),
    )
    pressure = SimpleNamespace(steady=True, primary=Estimate(1.0, 0.1, 100.0, 1.0, 100))
    monkeypatch.setattr(report, "slow_structure", lambda scene, square: [square])
    (square,) = report._doubts(run, pressure, None)
    own = moved - moved.mean(axis=0)
    assert square == pytest.approx(2.0 / 8.0 * np.mean(np.sum(own**2, axis=1)), rel=1e-12)
