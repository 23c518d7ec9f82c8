"""What a design costs, and what can be reached in a time, as sums that can be done by hand."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from carom import Scene, Species, theory
from carom.observables import blocking
from carom.studies.planner import diffusion, measures
from carom.studies.planner.choice import CACHES, PART, Costs, Design, design, slowed, within
from carom.studies.planner.diffusion import DiffusionMethod, DiffusionPilot
from carom.studies.planner.pressure import PressureMethod
from carom.studies.planner.sizes import OF_CRYSTAL, residual
from carom.studies.planner.system import System
from carom.studies.transport.analysis import Coefficient


def test_three_replicas_on_two_cores_take_as_long_as_two_of_them():
    plan = Design(100, 3, 10.0, 100.0, 0.01, 0.0, 0.01, cpu_seconds=30.0)
    assert [plan.seconds(cores) for cores in (1, 2, 3, 8)] == [30.0, 20.0, 10.0, 10.0]


@pytest.mark.parametrize("error", [1e-1, 1e-4], ids=["the shortest run", "a long run"])
def test_replicas_share_what_is_measured_and_each_has_its_own_start(error):
    costs = Costs(
        n=500, variance=10.0, bias=0.0, collisions_per_second=1e5, setup_seconds=2.0, equilibration=100.0,
        shortest=1000.0,
    )  # fmt: skip
    one, four = (design(costs, error, replicas) for replicas in (1, 4))
    # Lengths have four digits, those of equilibrations three.
    assert 4 * four.collisions_per_particle == pytest.approx(one.collisions_per_particle, rel=1e-3)
    assert one.collisions_per_particle >= costs.shortest
    assert four.statistical == pytest.approx(one.statistical, rel=1e-3)
    for each in (one, four):
        assert each.equilibration == pytest.approx(max(100.0, PART * each.collisions_per_particle), rel=5e-3)
        length = each.equilibration + each.collisions_per_particle
        seconds = each.replicas * (2.0 + 0.5 * 500 * length / 1e5)
        assert each.cpu_seconds == pytest.approx(seconds, rel=1e-12)


@pytest.mark.parametrize("bias", [0.0, 1e-3, 3e-3])
def test_what_is_said_to_be_within_reach_is_reached_in_the_time(bias):
    costs = Costs(
        n=500, variance=10.0, bias=bias, collisions_per_second=1e5, setup_seconds=2.0,
        equilibration=100.0, shortest=10.0,
    )  # fmt: skip
    found = design(costs, within(costs, cores=1, limit=60.0))
    # Equilibration is counted twice at most: as what is needed, and as a part of the run.
    assert 57.0 < found.seconds(1) <= 60.0 * 1.001


def test_the_shortest_run_that_has_an_error_bar_is_within_reach_and_no_shorter_one():
    costs = Costs(
        n=500, variance=10.0, bias=1e-3, collisions_per_second=1e5, setup_seconds=2.0,
        equilibration=100.0, shortest=1000.0,
    )  # fmt: skip
    measured = 0.5 * 500 * 1000.0
    least = 2.0 + (0.5 * 500 * 100.0 + (1.0 + PART) * measured) / 1e5
    assert within(costs, cores=1, limit=0.999 * least) == math.inf
    error = math.hypot(math.sqrt(10.0 / measured), 1e-3)
    assert 0.99 * error < within(costs, cores=1, limit=1.001 * least) < error


def test_an_error_bar_of_a_plan_comes_from_so_many_blocks_that_it_is_itself_known():
    """White noise of which chance makes the first levels look correlated: see ``measures.FEWEST``."""
    series = np.random.default_rng(11).standard_normal((300, 512))
    usual = [blocking(each).blocks for each in series]
    assert min(usual) < measures.FEWEST
    found = [measures.estimates(each, None, 3)["virial"] for each in series]
    assert min(each.blocks for each in found) >= measures.FEWEST
    errors = np.array([each.error for each in found]) * math.sqrt(512)
    # 64 blocks know an error to 1 / sqrt(2 * 64), and its factor, 1 + r, to the error 1 / sqrt(64) of r.
    assert errors.std() < math.hypot(1.0 / math.sqrt(2 * 64), 1.0 / math.sqrt(64))


def test_a_crystal_is_trusted_to_its_own_part_of_the_shift():
    crystal = System(0.6)
    assert crystal.crystal
    shift = abs(theory.crystal_finite_size_shift(0.6, 500, theory.solid(3)))
    assert residual(crystal, 500) == pytest.approx(OF_CRYSTAL * shift, rel=0.01)
    assert OF_CRYSTAL * shift < residual(crystal, 500)


@pytest.mark.parametrize("fractions", [(1 / 3, 1 / 3, 1 / 3), (0.05, 0.35, 0.6), (0.3, 0.7)])
def test_a_plan_counts_the_species_of_a_mixture_as_its_scene_does(fractions):
    mixed = [{"fraction": part, "diameter": 1.0 + k} for k, part in enumerate(fractions)]
    species = [Species(**each) for each in mixed]
    for n in (64, 70, 91):
        there = Scene.random(n, 0.05, 3, species=species, seed=1)
        assert list(System(0.05, scene={"species": mixed}).counts(n)) == np.bincount(there.species).tolist()


def test_a_pilot_waits_for_the_slowest_species():
    steps = np.array([[3.0, 0.0], [0.0, 3.0], [0.6, 0.8], [3.0, 0.0], [0.0, 0.0]])
    there = np.random.default_rng(1).normal(size=(5, 2))
    for species, slowest in ((None, 5.6), ([0, 0, 0, 1, 1], 4.5), ([0, 0, 1, 0, 1], 0.5)):
        kinds = None if species is None else np.array(species)
        frame = SimpleNamespace(unwrapped=there + steps, box=(4.0, 5.0), n=5, dimension=2, species=kinds)
        pilot = SimpleNamespace(sim=SimpleNamespace(frame=lambda frame=frame: frame), there=there)
        assert measures.Trial.moved(pilot) == pytest.approx(slowest / 4.0)  # squares of the mean spacing


def test_what_two_spheres_carry_is_known_exactly():
    """Their relative speed u is fixed by the energy, mu u^2 = 3 kT. Of directions weighted with the speed of
    approach the mean cosine is 2/3, and a collision carries sigma 2 mu u cos."""
    scene = Scene(
        [[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]], box=8.0, diameter=[1.0, 1.4], mass=[1.0, 0.25], species=[0, 1]
    )
    exact = 4.0 / 3.0 * 1.2 * math.sqrt(3.0 * 0.2 * 1.7)
    assert measures.carried(SimpleNamespace(scene=scene, kT=1.7))[0, 1] == pytest.approx(exact, rel=1e-12)


def test_both_routes_to_z_have_the_error_of_their_best_combination_with_the_memory_of_the_blocks():
    noise, memory = np.random.default_rng(1).normal(size=(2, 4096)), 0.25
    for k in range(1, 4096):
        noise[:, k] += memory * noise[:, k - 1]
    shared, own = noise
    found = measures.estimates(shared + own, shared - own, 3)
    assert [*found] == ["both", *sorted(found.keys() - {"both"}, key=lambda name: found[name].error)]
    assert found["both"].error == pytest.approx(blocking(shared).error, rel=1e-3)
    exact = math.sqrt((1.0 + memory) / (1.0 - memory) / (1.0 - memory**2) / 4096)
    assert found["both"].error == pytest.approx(exact, rel=0.2)
    assert [*measures.estimates(shared, own, 1)] == ["virial"]


def test_what_is_planned_of_diffusion_has_the_units_of_the_scene():
    plain, scaled = (
        DiffusionMethod(System(0.3, scene=scene)) for scene in ({}, {"diameter": 2.0, "mass": 4.0, "kT": 9.0})
    )
    speed, length = math.sqrt(9.0 / 4.0), 2.0
    found = scaled.shift(500, 0.7 * 4.0 * speed / length**2, 0.2 * speed * length)
    assert found == pytest.approx(plain.shift(500, 0.7, 0.2) * speed * length, rel=1e-12)
    assert scaled.block(500) == pytest.approx(plain.block(500), rel=1e-12)  # in collisions


@pytest.mark.parametrize("quantity", ["Z", "P", "g(contact)"])
def test_the_costs_of_a_pressure_are_those_of_z_in_its_unit(quantity):
    system = System(0.3, scene={"diameter": 2.0, "kT": 3.0})
    method, offset, factor = PressureMethod(system, quantity), 0.0, 1.0
    if quantity == "P":
        factor = 0.3 / (math.pi / 6.0 * 8.0) * 3.0  # rho kT
    if quantity == "g(contact)":
        offset, factor = 1.0, 1.0 / (4.0 * 0.3)
    known = 3.0 + 0.03 * np.random.default_rng(2).normal(size=512)
    record = {
        "result": {
            "n": 128, "counts": [128], "by_virial": known.tolist(), "by_rate": None, "collisions": 10**6,
            "equilibration": 50.0, "short": 12_800,
        },
        "provenance": {"cpu_seconds": {"setup": 0.5, "calls": 1.408, "measuring": 15.12}},
    }  # fmt: skip
    pilot = method.found(record)
    # A call takes 0.01 s, and a collision 1e-5 s.
    found = pilot.collisions_per_second, pilot.call_seconds, pilot.setup_seconds, pilot.seconds
    assert (pilot.n, *found) == pytest.approx((128, 1e5, 5.12, 0.5, 17.028), rel=1e-12)
    value = (blocking(known).mean - system.shift(128) - offset) * factor
    assert pilot.value == pytest.approx(value, rel=1e-12)
    variance = measures.estimates(known, None, 3)["virial"].error ** 2 * 1e6
    ns = [64, 128, 512, 4096, 40_000]
    costs = [method.costs(pilot, n) for n in ns]
    for n, each in zip(ns, costs, strict=True):
        assert each.n == n
        assert each.variance == pytest.approx(variance * factor**2)
        assert each.bias == pytest.approx(residual(system, n) * factor)
        assert each.setup_seconds == pytest.approx(0.5 * n / 128 + 5.12)
        assert each.collisions_per_second == pytest.approx(1e5 if n < CACHES else slowed(1e5, 500, n))
    seconds = [design(dataclasses.replace(each, bias=0.0), 1e-3 * factor).cpu_seconds for each in costs]
    assert seconds == sorted(seconds)
    z = 3.0 + np.random.default_rng(1).normal(size=(2, 64))
    records = [
        {"result": {"n": 128, "counts": [128], "dimension": 3, "by_virial": z[k].tolist(), "by_rate": None}}
        for k in (0, 1)
    ]
    found, bias, _ = method.reached(records, "virial")
    assert found.mean == pytest.approx((z.mean() - system.shift(128) - offset) * factor, rel=1e-12)
    assert found.error == pytest.approx(blocking(z.ravel()).error * factor, rel=1e-12)
    assert bias == pytest.approx(residual(system, 128) * factor)


def test_wells_take_from_the_pressure_what_their_second_virial_coefficient_says():
    for kT in (3.0, 6.0):
        well = System(
            0.1, scene={"interaction": {"type": "square-well", "range": 1.5, "depth": 1.0}, "kT": kT}
        )
        # B_2 over that of hard spheres (J. A. Barker and D. Henderson, Rev. Mod. Phys. 48, 587 (1976)).
        second = 1.0 - (1.5**3 - 1.0) * math.expm1(1.0 / kT)
        assert well.z() == pytest.approx(theory.best(3)(0.1) + 4.0 * 0.1 * (second - 1.0), rel=1e-12)


def test_a_mixture_has_the_mean_mass_and_the_density_of_its_species():
    mixed = [
        {"fraction": 0.75, "mass": 2.0, "diameter": 1.0},
        {"fraction": 0.25, "mass": 6.0, "diameter": 2.0},
    ]
    system = System(0.2, scene={"species": mixed})
    assert system.mean_mass == pytest.approx(3.0)
    assert system.density == pytest.approx(0.2 / (math.pi / 6.0 * (0.75 + 0.25 * 8.0)))


def test_diffusion_costs_more_in_a_larger_box_whose_slope_is_taken_later():
    """The window begins at four decay times of the longest wave, which grow with the square of the edge."""
    method = DiffusionMethod(System(0.3))
    pilot = DiffusionPilot(
        n=1000, value=0.2, variances={"displacement": 3.0, "velocity": 2.0}, viscosity=0.7, of_viscosity=0.0,
        collisions_per_second=1e5, setup_seconds=0.0, call_seconds=0.0, equilibration=100.0, sure=True,
        seconds=1.0,
    )  # fmt: skip
    ns = [1000, 2000, 4000, 8000]
    costs = [method.costs(pilot, n) for n in ns]
    assert [each.variance for each in costs] == pytest.approx([2.0 * (n / 1000) ** (2 / 3) for n in ns])
    assert [each.shortest for each in costs] == pytest.approx(
        [costs[0].shortest * (n / 1000) ** (2 / 3) for n in ns]
    )
    biases = [each.bias for each in costs]
    assert biases == sorted(biases, reverse=True)
    # With the same bias, more particles never cost less.
    seconds = [design(dataclasses.replace(each, bias=0.0), 1e-3).cpu_seconds for each in costs]
    assert seconds == sorted(seconds)
    # The viscosity, of which a run gives one value, is known by its time: after as many collisions of more
    # particles it is known worse.
    unsure = dataclasses.replace(pilot, of_viscosity=5.0)
    for n, each in zip(ns, costs, strict=True):
        more = method.costs(unsure, n).variance - each.variance
        assert more == pytest.approx(method.shift(n, 0.7, 0.2) ** 2 * 5.0 * n / 1000)


@pytest.mark.parametrize("species", [0, 1])
def test_the_possible_bias_of_diffusion_is_a_part_of_the_shift_by_the_box_alone(monkeypatch, species):
    """D of N spheres at rest together is smaller by about 1 / N, which is exact and leaves no bias."""
    n, density, one = 64, 0.5, Coefficient(0.3, 0.01, 100.0, 1.0, 100)
    own = (1.0 + 1.0 / n, 1.0 + 3.0 / n)[species]
    point = SimpleNamespace(
        n=n, volume=n / density, kT=1.0, mean_mass=1.0, at_rest=lambda k: (1.0 + 1.0 / n, 1.0 + 3.0 / n)[k],
        shear_viscosity=lambda: one,
        self_diffusion=lambda k: [Coefficient(0.3 * (1.0 + k), 0.01, 100.0, 1.0, 100)] * 2,
    )  # fmt: skip
    monkeypatch.setattr(diffusion, "Point", lambda records: point)
    half = [{"fraction": 0.5, "diameter": 1.0, "mass": mass} for mass in (0.5, 1.5)]
    method = diffusion.DiffusionMethod(System(density * math.pi / 6.0, scene={"species": half}), str(species))
    value, bias, said = method.reached([], "velocity")
    shift = theory.diffusion_shift(n, density, one.mean, self_diffusion=value.mean)
    assert value.mean - shift == pytest.approx(one.mean * (1.0 + species) * own, rel=1e-9)
    assert bias == pytest.approx(diffusion.missed(n) * shift, rel=1e-9)
    assert not said


def test_systems_beyond_the_caches_are_slower():
    assert slowed(1e6, 500, 5000) == 1e6
    assert slowed(1e6, 10**4, 10**7) < 0.2e6
    assert slowed(slowed(1e6, 500, 10**6), 10**6, 500) == pytest.approx(1e6, rel=1e-12)
