"""Z, P and contact values while contacts lose energy or diameters grow, compared with kinetic theory."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import carom
from carom import theory
from carom.block import Block, Sizes
from carom.errors import InputError
from carom.observables import Pressure
from carom.observables.analysis.drifting_kT import Course
from carom.simulation.measuring import mechanics, stretches
from carom.simulation.measuring.stretches import Blocks
from carom.units import TimeUnit

SIX_SIGMA = 6.0


@pytest.mark.slow
def test_spheres_that_cool_have_the_pressure_of_enskog():
    # Z - 1 of a homogeneous inelastic gas is (1 + e) / 2 of that of elastic spheres: a contact exchanges so
    # much of the momentum.
    n, eta, e = 108, 0.2, 0.95
    found = []
    for seed in range(4):
        scene = carom.Scene.random(n, eta, seed=seed).replace(impact=e)
        sim = carom.Simulation(scene, seed=seed)
        sim.run(collisions_per_particle=20)
        before = sim.kT
        result = sim.measure(Pressure(), collisions_per_particle=100)
        found.append(result.Z)
        assert sim.kT < 0.05 * before
        assert sim.kT < result.kT < before
        assert result.pressure.mean == pytest.approx(found[-1].mean * result.kT * n / scene.volume)
        assert "Contacts change the energy" in str(result)
    mean = np.mean([z.mean for z in found])
    error = math.sqrt(sum(z.error**2 for z in found)) / len(found)
    shift = theory.finite_size_shift(eta, n, theory.carnahan_starling)
    right = 1 + 0.5 * (1 + e) * (theory.carnahan_starling(eta) + shift - 1)
    assert error < 0.015
    assert abs(mean - right) < 4 * error
    # Independent collisions, <u^2> / <u>^2 = 4 / pi: what an error bar of so many cannot be far from.
    expected = (right - 1) * math.sqrt(4 / math.pi / (4 * 50 * n))
    assert 0.6 * expected < error < 1.6 * expected


def along(eta, n, growth, duration):
    """Return Z, kT and g(sigma+) along slow growth from kT = 1: heat is the work against the pressure."""
    times = np.linspace(0.0, duration, 20_001)
    fractions = eta * (1 + growth * times) ** 3
    equation = theory.carnahan_starling
    # Surfaces that approach strike harder: <(u + g)^2> over <u^2> is 1 + 2 g / sqrt(pi kT) to first order.
    z, kT = np.empty_like(times), np.ones_like(times)
    for k, filled in enumerate(fractions):
        excess = equation(filled) + theory.finite_size_shift(filled, n, equation) - 1
        z[k] = 1 + excess * (1 + 2 * growth / math.sqrt(math.pi * kT[k]))
        if k + 1 < len(times):
            kT[k + 1] = kT[k] * (fractions[k + 1] / filled) ** (2 / 3 * (z[k] - 1))
    return z, kT, fractions, theory.contact_value(z, fractions, 3, n)


@pytest.mark.slow
def test_slow_growth_measures_the_equation_of_state_along_the_stretch():
    n, eta, growth, duration = 256, 0.2, 2e-3, 40.0
    scene = carom.Scene.random(n, eta, seed=1)
    sim = carom.Simulation(scene, seed=2, growth=1e-9)
    sim.run(collisions_per_particle=30)
    sim.rescale(1.0, growth=growth)
    result = sim.measure(Pressure(), time=duration)
    z, kT, fractions, contact = along(eta, n, growth, duration)
    assert result.packing_fraction == pytest.approx(fractions.mean(), rel=1e-4)
    found = result.Z
    assert found.error < 0.01 * found.mean
    assert abs(found.mean - np.average(z, weights=kT)) < 4 * found.error
    g = result.contact_value
    assert abs(g.mean - np.average(contact, weights=kT * fractions)) < 4 * g.error
    # The heat is the work, whose relative error is that of Z - 1.
    gain = kT[-1] - 1.0
    assert abs(sim.kT - kT[-1]) < 4 * gain * found.error / (found.mean - 1)
    assert abs(result.Z_from_rate.mean - found.mean) < 4 * found.error
    assert "Diameters grow" in result.note
    with pytest.raises(InputError, match="how diameters grew"):
        stretches.estimate(sim, Pressure(), [stretches.tally(sim)])


def test_a_stretch_that_grows_has_its_mean_packing_fraction_and_its_heat_is_its_work():
    n, eta, growth, duration = 16, 0.2, 4e-3, 10.0
    sim = carom.Simulation(
        carom.Scene.random(n, eta, seed=1), kT=1.0, seed=2, growth=growth,
        tuning=carom.Tuning(neighbors="sectors"),
    )  # fmt: skip
    result = sim.measure(Pressure(), time=duration, blocks=16)
    _, kT, fractions, _ = along(eta, n, growth, duration)
    assert result.packing_fraction == pytest.approx(fractions.mean(), rel=1e-4)
    assert "Diameters grow" in result.note
    # Six seeds heat by 7 to 14 % more in twice the time: so few particles, and so fast a growth.
    assert sim.kT - 1.0 == pytest.approx(kT[-1] - 1.0, rel=0.25)
    with pytest.raises(InputError, match="how diameters grew"):
        stretches.estimate(sim, Pressure(), [stretches.tally(sim)])


def cooling_blocks(count, rng):
    """Blocks of an ideal story: kT falls by e^-6, 40 collisions each, Z = 3, n = 10, d = 3."""
    kT = np.exp(-6 * np.arange(count) / count)
    durations = 1 / np.sqrt(kT)
    virials = 2 * 3 * 10 * kT * durations * (1 + 0.2 * rng.normal(size=count))
    return [Block(t, 40, w, kT_time=k * t) for t, w, k in zip(durations, virials, kT, strict=True)]


def estimate(blocks):
    return Pressure.estimate(blocks, n=10, dimension=3, volume=100.0, diameter=1.0, kT=777.0)


def test_blocks_of_a_gas_that_cools_hold_equally_many_collisions_by_haffs_law(monkeypatch):
    # P. K. Haff, J. Fluid Mech. 134, 401 (1983): speeds, and so collisions a time, fall as 1 / (1 + t).
    rate, wanted = 1000.0, 50.0
    system = SimpleNamespace(conserves_energy=False, rates=None, motion=None)
    gas = SimpleNamespace(time=0.0, kT=1.0, _state=SimpleNamespace(system=system))

    def run(gas, duration, count):
        begin, end = 1.0 + gas.time, 1.0 + gas.time + duration
        gas.time, gas.kT = gas.time + duration, end**-2
        return [Block(duration, rate * math.log(end / begin), 0.0, kT_time=1.0 / begin - 1.0 / end)]

    monkeypatch.setattr(stretches, "blocks", run)
    monkeypatch.setattr(stretches, "time_for", lambda gas, collisions: collisions / rate)
    cooling = Blocks(gas, wanted)
    found = np.array([cooling.next().collisions for _ in range(200)])
    # In a block speeds fall by wanted / rate, which its length does not follow from.
    assert ((found > (1.0 - wanted / rate) * wanted) & (found <= wanted)).all()
    assert gas.kT < 1e-8


def test_every_block_of_a_gas_that_cools_counts_alike_and_error_bars_cover():
    rng = np.random.default_rng(1)
    found = [estimate(cooling_blocks(128, rng)).Z for _ in range(200)]
    pulls = np.array([(z.mean - 3) / z.error for z in found])
    assert abs(pulls.mean()) < SIX_SIGMA / math.sqrt(200)
    assert 0.8 < pulls.std() < 1.2
    # No block has more weight than another: 0.2 of two, by the root of their number.
    assert np.mean([z.error for z in found]) == pytest.approx(0.4 / math.sqrt(128), rel=0.1)


def test_a_trend_is_no_scatter_and_the_scatter_is_covered():
    rng = np.random.default_rng(2)
    pulls = []
    for _ in range(200):
        part = (np.arange(96) + 0.5) / 96
        z, kT, cube = 2 + 3 * part**2, 1 + part, 1 + 0.5 * part
        virials = (z - 1) * 30 * kT * (1 + 0.1 * rng.normal(size=96))
        rows = zip(virials, kT, cube, strict=True)
        blocks = [Block(1.0, 40, w, kT_time=k, sizes=Sizes(0.1 * c, c, True)) for w, k, c in rows]
        result = estimate(blocks)
        found = result.Z
        pulls.append((found.mean - np.average(z, weights=kT)) / found.error)
    assert abs(np.mean(pulls)) < SIX_SIGMA / math.sqrt(200)
    assert 0.8 < np.std(pulls) < 1.2


def test_blocks_without_any_change_are_those_of_before():
    blocks = [Block(2.0, 30, 45.0), Block(1.0, 14, 22.0), Block(3.0, 47, 70.0)]
    course = Course.of(blocks, 1.5, 0.3, 2.0)
    assert (course.kT, course.packing_fraction, course.cube, course.note) == (1.5, 0.3, 2.0, "")
    assert (course.heat == 1.0).all()
    assert (course.filling == 1.0).all()


def test_unequal_rates_make_spheres_unequal_and_leave_contact_values_out():
    sizes = [Sizes(0.1, 1.0, True), Sizes(0.1, 1.1, False)]
    result = estimate([Block(1.0, 40, 60.0, kT_time=1.0, sizes=size) for size in sizes * 8])
    assert math.isnan(result.contact_value.mean)
    assert math.isnan(result.Z_from_rate.mean)


def test_the_note_does_not_say_that_a_gas_cools_which_a_surface_heats():
    blocks = [Block(1.0, 40, 60.0, kT_time=5.0 + 0.1 * k) for k in range(16)]
    note = Course.of(blocks, 777.0, 0.1, 1.0).note
    assert note.startswith("Contacts change the energy (kT from 5 to 6.5)")


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5])
def test_sizes_of_a_block_are_their_exact_means_over_it(dimension):
    first, growth, duration, unit = np.array([1.0, 0.5, 0.8]), np.array([0.1, 0.3, 0.0]), 2.0, TimeUnit(3)
    system = SimpleNamespace(rates=unit.to_kernel(0.5 * growth, -1))
    scene = SimpleNamespace(dimension=dimension, volume=20.0)
    machine = SimpleNamespace(scene=scene, system=system, unit=unit, sweeps=None)
    found = mechanics.sizes(machine, first, duration)
    last = first + growth * duration

    def mean(power, a, b):
        return (b ** (power + 1) - a ** (power + 1)) / ((power + 1) * (b - a)) if b > a else a**power

    means = [mean(dimension, a, b) for a, b in zip(first, last, strict=True)]
    filled = theory.ball_volume(dimension, 1.0) * sum(means)
    assert found.packing_fraction == pytest.approx(filled / 20.0, rel=1e-13)
    assert found.cube == pytest.approx(means[0], rel=1e-13)  # the first is the largest all the time
    assert not found.equal
    system.rates[:] = system.rates[0]
    assert mechanics.sizes(machine, np.ones(3), 1.0).equal


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_number_of_collisions_of_growing_spheres_gives_the_z_that_made_it(dimension):
    """Diameters grow to 1.6, kT to four times as much: at constant Z the rate is as sqrt(kT) / diameter."""
    n, z, duration, rng = 10, 3.0, 1e7, np.random.default_rng(1)  # counts are rounded to a part of 1e-8
    sigmas, kTs = np.linspace(1.0, 1.6, 32), np.linspace(1.0, 2.0, 32) ** 2
    blocks = []
    for sigma, kT in zip(sigmas, kTs, strict=True):
        rate = theory.collision_rate(z, dimension, n=n, diameter=sigma, kT=kT)
        filled = n * theory.ball_volume(dimension, sigma) / 100.0
        sizes = Sizes(filled, sigma**dimension, True)
        count = round(0.5 * n * rate * duration)
        virial = 2.0 * dimension * n * kT * duration * (1.0 + 0.1 * rng.normal())
        blocks.append(Block(duration, count, virial, kT_time=kT * duration, sizes=sizes))
    found = Pressure.estimate(blocks, n=n, dimension=dimension, volume=100.0, diameter=1.0, kT=1.0)
    assert found.Z_from_rate.mean == pytest.approx(z, rel=1e-7)
